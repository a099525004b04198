"""Mesh files as other programs write them: read for what they hold, or refused by name."""

import io
import struct
import zipfile

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.records import mesh, mesh_formats
from dmpcli.records.file_io import Source
from tests.records.meshes import box, grid, obj, written

V, F = grid()
HEXAGON = [[np.cos(a), np.sin(a), 0.0] for a in np.arange(6) * np.pi / 3]
U = [
    [0, 0, 0],
    [60, 0, 0],
    [60, 40, 0],
    [40, 40, 0],
    [40, 10, 0],
    [20, 10, 0],
    [20, 40, 0],
    [0, 40, 0],
]


def read(content, name="part"):
    return mesh_formats.triangles(Source(name, content))


def area(found):
    return float(igl.doublearea(np.asarray(found.V, dtype=float), found.F).sum() / 2.0)


def refused(content, name="part"):
    with pytest.raises(InputError) as error:
        read(content, name)
    assert str(error.value).startswith(f"{name}: ")
    assert len(str(error.value).splitlines()) == 1
    return str(error.value)


def ply(places, faces, form="ascii", size="uchar", index="int", name="vertex_indices"):
    """PLY with vertices that also have a colour, faces with a quality after their list."""
    codes = {"uchar": "B", "ushort": "H", "int": "i", "uint": "I", "short": "h", "char": "b"}
    head = (
        f"ply\nformat {form} 1.0\ncomment made by hand\nelement vertex {len(places)}\n"
        "property float x\nproperty float y\nproperty uchar red\nproperty double z\n"
        f"element face {len(faces)}\nproperty list {size} {index} {name}\n"
        "property float quality\nend_header\n"
    ).encode()
    if form == "ascii":
        rows = [f"{x!r} {y!r} 7 {z!r}" for x, y, z in np.asarray(places, dtype=float).tolist()]
        rows += [" ".join(map(str, [len(f), *f, 0.5])) for f in faces]
        return head + "\n".join(rows).encode() + b"\n"
    order = "<" if "little" in form else ">"
    body = [struct.pack(f"{order}ffBd", x, y, 7, z) for x, y, z in np.asarray(places).tolist()]
    row = codes[size], codes[index]
    body += [struct.pack(f"{order}{row[0]}{len(f)}{row[1]}f", len(f), *f, 0.5) for f in faces]
    return head + b"".join(body)


def off(places, faces, head="OFF\n"):
    lines = [" ".join(map(repr, row)) for row in np.asarray(places, dtype=float).tolist()]
    lines += [" ".join(map(str, [len(f), *f])) for f in faces]
    return (f"{head}{len(places)} {len(faces)} 0\n" + "\n".join(lines) + "\n").encode()


FORMS = ["ascii", "binary_little_endian", "binary_big_endian"]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("size", "index"), [("uchar", "int"), ("int", "uint"), ("ushort", "short"), ("char", "uchar")]
)
def test_ply_faces_may_have_any_number_of_corners(form, size, index):
    hexagon = read(ply(HEXAGON, [range(6)], form, size, index))
    assert area(hexagon) == pytest.approx(1.5 * np.sqrt(3.0), rel=1e-6)
    mixed = read(ply(U, [range(8), [0, 1, 5], [0, 1, 4, 5]], form, size, index, "vertex_index"))
    assert len(mixed.F) == 6 + 1 + 2
    assert area(mixed) == pytest.approx(1800.0 + 300.0 + 400.0)


def test_every_format_covers_a_notch_as_little():
    faces = [np.roll(range(8), 3).tolist()]
    for content in (obj(U, faces), off(U, faces), *(ply(U, faces, form) for form in FORMS)):
        assert area(read(content)) == pytest.approx(1800.0)


@pytest.mark.parametrize("form", FORMS)
def test_ply_strips_are_triangles_wound_alike(form):
    # Two strips of a flat ribbon, the second after a -1; a vertex named twice turns a corner.
    places = [[x, y, 0.0] for x in range(5) for y in (0.0, 1.0)]
    strip = [1, 0, 3, 2, 5, 4, -1, 5, 4, 7, 6, 6, 9, 8]
    head = (
        f"ply\nformat {form} 1.0\nelement vertex 10\nproperty float x\nproperty float y\n"
        f"property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    ).encode()
    if form == "ascii":
        rows = [" ".join(map(str, row)) for row in places] + [" ".join(map(str, [14, *strip]))]
        content = head + "\n".join(rows).encode()
    else:
        order = "<" if "little" in form else ">"
        content = head + np.array(places, dtype=f"{order}f4").tobytes()
        content += np.array([14, *strip], dtype=f"{order}i4").tobytes()
    found = read(content)
    assert len(found.F) == 8 - 1
    a, b, c = np.moveaxis(found.V[found.F], 1, 0)
    up = np.cross(b - a, c - a)[:, 2]
    # After the vertex named twice the winding of what follows is the strip's own.
    assert (up[:6] > 0).all()
    assert area(found) == pytest.approx(3.5)


@pytest.mark.parametrize("form", FORMS[1:])
def test_a_ply_element_that_is_not_known_is_passed_over(form):
    order = "<" if "little" in form else ">"
    head, _, body = ply(HEXAGON, [range(6)], form).partition(b"element vertex")
    other = b"element camera 2\nproperty float a\nproperty list uchar short b\n"
    text, _, rows = body.partition(b"end_header\n")
    rows = struct.pack(f"{order}fB2hfB1h", 1.0, 2, 3, 4, 5.0, 1, 6) + rows
    found = read(head + other + b"element vertex" + text + b"end_header\n" + rows)
    assert area(found) == pytest.approx(1.5 * np.sqrt(3.0), rel=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_a_ply_that_claims_more_than_it_holds_is_refused_before_memory_is_taken(form):
    content = ply(HEXAGON, [range(6)], form)
    for element in (b"vertex 6", b"face 1"):
        huge = content.replace(element, element.split()[0] + b" 4000000000000")
        assert "announces 4000000000000 rows" in refused(huge)
    assert "truncated" in refused(content[: -6 if form != "ascii" else -20])


@pytest.mark.parametrize(
    "head",
    [
        "OFF\n",
        "OFF ",
        "OFF",
        "# made by hand\n\nOFF\n# counts\n\n",
        "COFF\n",
        "NOFF # with normals\n",
        "STCNOFF\n",
        "\nOFF\r\n",
    ],
)
def test_off_is_read_whatever_its_head(head):
    content = off(U, [range(8)], head).replace(b"40.0 0.0\n", b"40.0 0.0 255 0 0 # red\n")
    assert mesh_formats.format_of(Source("part", content)) == "OFF"
    assert area(read(content)) == pytest.approx(1800.0)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"OFF\n", "without its numbers of vertices and faces"),
        (b"OFF\n3.5 1 0\n", "line 2: its numbers"),
        (b"OFF BINARY\n\0\0", "is a binary OFF file"),
        (b"4OFF\n1 0 0\n1 2 3 4\n", "4-dimensional points"),
        (off(V, F).replace(b" 81 ", b" 81 "), None),
        (off(HEXAGON, [[0, 1, 6], range(6)]), "face 1 names vertex 7, but there are 6"),
        (off(HEXAGON, [[0, 1, 2], [0, 1, 2, -1]]), "face 2 names vertex 0, but there are 6"),
        (off(HEXAGON, [[0, 1, 2]])[:-4], "line 9: a face of 4 numbers is meant here, but 2 stand"),
        (off(HEXAGON, [[0, 1, 2]])[:-8], "announces 1 rows of face, but 0 whole ones"),
        (off(HEXAGON, [[0, 1, 2]]).replace(b"0.5", b"0,5", 1), "line 4: '0,5"),
        (b"OFF\n4000000000000 9 0\n1 2 3\n", "announces 4000000000000 rows of vertex"),
    ],
)
def test_what_is_wrong_in_an_off_file_is_named(content, message):
    if message is None:
        assert len(read(content).F) == len(F)
    else:
        assert message in refused(content)


def test_bytes_behind_a_binary_stl_are_passed_over_with_a_remark():
    whole = written(V, F, "stl")
    for name in ("part.stl", "standard input"):
        found = read(whole + b"made by a scanner, 2024", name)
        assert len(found.F) == len(F)
        assert found.remarks == ["23 bytes after the 128 facets of its header passed over"]
    found = mesh.decode(Source("part.stl", whole + whole[-100:]))
    assert (
        "100 bytes after the 128 facets of its header passed over, enough for 2 more"
        in (found.remarks[0])
    )


def test_a_binary_stl_of_no_facets_holds_none_and_one_that_says_so_wrongly_is_refused():
    assert len(read(bytes(84), "part.stl").F) == 0
    whole = written(V, F, "stl")
    assert "of 0 facets it would have 84 bytes, but has 6484" in refused(
        whole[:80] + bytes(4) + whole[84:], "part.stl"
    )


def test_a_binary_stl_may_begin_with_the_word_solid():
    whole = written(V, F, "stl")
    for name in ("part.stl", "standard input"):
        found = read(b"solid as a rock".ljust(80) + whole[80:], name)
        assert len(found.F) == len(F)
    assert len(read(b"solid as a rock".ljust(80) + whole[80:] + b"\0\0", "part").F) == len(F)


def test_a_text_stl_may_be_filled_up_with_zeros():
    assert len(read(written(V, F, "stl_ascii") + bytes(100)).F) == len(F)


@pytest.mark.parametrize("kind", ["obj", "off", "ply_ascii", "stl_ascii"])
def test_a_text_may_begin_with_a_byte_order_mark_and_end_lines_in_any_way(kind):
    content = written(V, F, kind)
    assert len(read(b"\xef\xbb\xbf" + content).F) == len(F)
    found = read(content.replace(b"\n", b"\r\n"))
    assert len(found.F) == len(F)
    assert area(found) == pytest.approx(area(read(content)))


def archive(name):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as file:
        file.writestr("[Content_Types].xml", "<Types/>")
        file.writestr(name, "<model/>")
    return content.getvalue()


FOREIGN = [
    ("part.3mf", archive("3D/3dmodel.model"), "a 3MF file"),
    ("part.glb", b"glTF" + struct.pack("<II", 2, 12), "a GLB file (binary glTF)"),
    ("part.step", b"ISO-10303-21;\nHEADER;\n", "a STEP file"),
    ("part.dae", b'<?xml version="1.0"?>\n<COLLADA version="1.4.1">', "a DAE file (COLLADA)"),
    ("part.igs", b"made by hand".ljust(72) + b"S      1\n", "an IGES file"),
]


@pytest.mark.parametrize(("name", "content", "what"), FOREIGN)
def test_formats_that_are_not_read_are_named_with_what_to_do(name, content, what):
    for called in (name, "standard input", "part.stl"):
        said = refused(content, called)
        assert f"is {what}, which is not read; open it in " in said
        assert said.endswith("export the part as STL, OBJ, PLY or OFF")


def test_faces_of_two_corners_are_left_out_and_counted():
    found = read(off(HEXAGON, [[0, 1], range(6), [2, 3]]))
    assert found.remarks == ["2 faces of fewer than three corners left out"]
    assert len(found.F) == 4


def test_a_polygon_that_crosses_itself_is_told_by_its_number():
    found = read(off(U, [[0, 1, 2], [0, 2, 1, 7]]))
    assert found.remarks == [
        "1 polygon crosses its own outline, the first is face 2: what lies in it is a guess"
    ]


@pytest.mark.slow
def test_more_faces_than_memory_serves_are_refused():
    head = bytes(80) + struct.pack("<I", 10_000_000)
    # A file of that length, of which nothing is looked at.
    content = head + bytes(50 * 10_000_000)
    assert "holds 10,000,000 triangles, more than" in refused(content, "part.stl")


def test_area_and_volume_are_those_of_the_solid():
    V, F = box()
    of = mesh.description(Source("a.obj", obj(V, F)))
    assert (of["area"], of["volume"]) == (pytest.approx(2200.0), pytest.approx(6000.0))
    # A cavity is wound against what it is in; a second solid counts whichever way it is wound.
    small = 0.5 * V
    hollow = np.concatenate([V, small, V + [100.0, 0.0, 0.0]])
    faces = np.concatenate([F, F[:, ::-1] + 8, F[:, ::-1] + 16])
    of = mesh.description(Source("a.obj", obj(hollow, faces)))
    assert of["volume"] == pytest.approx(6000.0 - 750.0 + 6000.0)
    assert of["area"] == pytest.approx(2200.0 * 2.25)
    assert mesh.description(Source("a.obj", obj(V, F[1:])))["volume"] is None


numbers = st.lists(st.lists(st.integers(0, 9), min_size=3, max_size=9), min_size=1, max_size=6)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(numbers, st.sampled_from(FORMS))
def test_ply_obj_and_off_hold_the_same_triangles(faces, form):
    places = np.random.default_rng(1).integers(-9, 9, (10, 3))
    ours = read(off(places, faces))
    for content in (obj(places, faces), ply(places, faces, form)):
        other = read(content)
        np.testing.assert_array_equal(other.F, ours.F)
        assert other.remarks == ours.remarks


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(st.sampled_from(FORMS), st.integers(0, 10**6), st.integers(0, 255), st.booleans())
def test_a_damaged_byte_is_read_or_refused_and_nothing_else(form, at, value, shorten):
    content = bytearray(ply(U, [range(8), [0, 1, 5], [0, 1, 4, 5]], form))
    content[at % len(content)] = value
    if shorten:
        del content[at % len(content) :]
    try:
        found = read(bytes(content), "part.ply")
    except InputError as error:
        assert len(str(error).splitlines()) == 1
    else:
        assert found.F.shape[1] == 3


@pytest.mark.parametrize("place", ["1e165", "1e200", "9e299"])
def test_a_corner_beyond_all_places_overflows_nothing_on_its_way_to_being_named(place):
    text = f"v 0 0 0\nv 0 10 0\nv 10 {place} 0\nv 10 0 0\nf 1 2 3 4\n"
    with pytest.raises(InputError, match=r"coordinates reach \S+e\+\d+ mm"):
        mesh.decode(Source("a.obj", text.encode()))

"""Meshes as people have them: read alike from every format, mended where safe, else refused."""

import subprocess
import sys
import textwrap

import igl
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.records import mesh
from dmpcli.records.file_io import Source
from dmpcli.surfaces.mesh import Mesh
from tests.records.meshes import box, grid, obj, written

KINDS = {
    "stl": "stl",
    "stl_ascii": "stl",
    "obj": "obj",
    "ply": "ply",
    "ply_ascii": "ply",
    "off": "off",
}
V, F = grid()


def read(content, name="part.stl", unit="mm"):
    return mesh.decode(Source(name, content), unit)


def mended(V, F):
    """What our reader makes of a mesh; OBJ keeps every digit and every index."""
    return read(obj(V, F), "part.obj")


def area(V, F):
    return float(igl.doublearea(np.asarray(V, dtype=float), np.asarray(F)).sum() / 2.0)


def assert_sound(found, like=None, rtol=1e-9):
    """Every promise of a mesh file, judged by libigl and trimesh."""
    V, F = found.V, found.F
    assert np.isfinite(V).all()
    assert F.min() == 0
    assert np.array_equal(np.unique(F), np.arange(len(V)))
    assert igl.doublearea(V, F).min() > 0
    assert len(np.unique(np.sort(F, axis=1), axis=0)) == len(F)
    assert igl.is_edge_manifold(F)[0]
    assert igl.is_vertex_manifold(F).all()
    assert trimesh.Trimesh(V, F, process=False).is_winding_consistent
    if like is not None:
        assert area(V, F) == pytest.approx(area(*like), rel=rtol)


@pytest.mark.parametrize("kind", KINDS)
def test_every_format_gives_the_same_surface(kind):
    found = read(written(V, F, kind), f"part.{KINDS[kind]}")
    assert_sound(found, (V, F), rtol=1e-6)
    assert (len(found.V), len(found.F)) == (len(V), len(F))
    distance, _, _ = igl.point_mesh_squared_distance(found.V, V, F)
    assert distance.max() < 1e-10
    up = np.cross(
        found.V[found.F[:, 1]] - found.V[found.F[:, 0]],
        found.V[found.F[:, 2]] - found.V[found.F[:, 0]],
    )
    assert (up[:, 2] > 0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_the_content_decides_the_format_not_the_name(kind):
    assert len(read(written(V, F, kind), "standard input").F) == len(F)


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1.0), ("cm", 10.0), ("m", 1e3), ("in", 25.4)])
def test_units_are_brought_to_mm(unit, factor):
    found = read(obj(V / factor, F), "part.obj", unit)
    np.testing.assert_allclose(np.ptp(found.V, axis=0), np.ptp(V, axis=0), rtol=1e-12)
    assert found.remarks == []


def test_a_size_that_no_part_has_is_said():
    assert "0.114 mm across as mm: check its unit" in read(obj(V / 1e3, F), "a.obj").remarks[-1]
    assert "check its unit" in read(obj(V, F), "a.obj", "m").remarks[-1]
    with pytest.raises(
        InputError, match=r"a\.obj: its coordinates reach 4e\+07 mm; check the unit"
    ):
        read(obj(1e3 * V, F), "a.obj", "m")
    with pytest.raises(InputError, match="unit inch: must be one of mm, cm, m, in"):
        read(obj(V, F), "a.obj", "inch")


def test_a_clean_mesh_passes_unchanged_and_without_remark():
    found = mended(V, F)
    np.testing.assert_array_equal(found.V, V)
    np.testing.assert_array_equal(found.F, F)
    assert found.remarks == []
    assert mesh.summary(found).startswith("128 faces, 1 piece, chordal error estimated at 0.")


# The table of defects: each mended, and said.


def test_an_stl_soup_is_merged():
    found = read(written(V, F, "stl"))
    assert len(found.V) == len(V)
    assert found.remarks == [], "no STL is anything else"


def test_duplicate_vertices_of_an_indexed_file_are_merged_and_said():
    twice = F.copy()
    twice[:64] += len(V)
    found = mended(np.concatenate([V, V]), twice)
    assert_sound(found, (V, F))
    assert len(found.V) == len(V)
    assert "duplicate vertices merged" in found.remarks[-1]


@pytest.mark.parametrize("flipped", [[5], range(0, 128, 2), range(1, 128)])
def test_windings_are_made_to_agree_with_most(flipped):
    wrong = F.copy()
    wrong[list(flipped)] = wrong[list(flipped), ::-1]
    found = mended(V, wrong)
    assert_sound(found, (V, F))
    turned = min(len(flipped), len(F) - len(flipped))
    side = 1.0 if 2 * len(flipped) <= len(F) else -1.0
    corners = found.V[found.F]
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert len(flipped) == 64 or (side * up > 0).all(), "as most of them were"
    assert found.remarks == [
        f"{turned} face{'s' if turned > 1 else ''} turned over to agree with the others"
    ]


def test_each_component_keeps_its_own_side():
    other = len(V) + F[:, ::-1]
    other[7] = other[7, ::-1]
    found = mended(np.concatenate([V, V + [0, 0, 50.0]]), np.concatenate([F, other]))
    z = np.cross(
        found.V[found.F[:, 1]] - found.V[found.F[:, 0]],
        found.V[found.F[:, 2]] - found.V[found.F[:, 0]],
    )[:, 2]
    assert (z[: len(F)] > 0).all()
    assert (z[len(F) :] < 0).all()
    assert "2 pieces" in mesh.summary(found)


def test_duplicate_faces_are_left_out_whatever_their_winding():
    found = mended(V, np.concatenate([F, F[[3]], F[[9]][:, ::-1], F[[9]][:, [1, 2, 0]]]))
    assert_sound(found, (V, F))
    assert found.remarks == ["3 duplicate faces left out"]
    np.testing.assert_array_equal(found.F, F)


def test_a_sheet_with_both_sides_is_one_sheet():
    found = mended(V, np.concatenate([F, F[:, ::-1]]))
    assert_sound(found, (V, F))
    assert found.remarks == ["128 duplicate faces left out"]


def test_faces_without_area_are_left_out():
    found = mended(V, np.concatenate([F, [[4, 4, 5], [7, 7, 7]]]))
    assert_sound(found, (V, F))
    assert found.remarks == ["2 faces without area left out"]


def test_a_sliver_in_the_seam_is_left_out_and_the_seam_closed():
    # Square with a vertex in the middle of its diagonal that only one side knows of, and a sliver.
    corners = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0], [5, 5, 0]], dtype=float)
    faces = np.array([[0, 1, 4], [1, 2, 4], [0, 4, 2], [0, 2, 3]])
    found = mended(corners, faces)
    assert_sound(found, (corners, faces))
    assert found.remarks == ["1 face without area left out", "1 T-junction stitched"]
    assert len(igl.boundary_facets(found.F)[0]) == 4


def test_t_junctions_are_stitched():
    # A long edge that meets two short ones from the other side, twice.
    left = np.array([[0, 0, 0], [0, 30, 0], [-20, 15, 3]], dtype=float)
    right = np.array([[0, 10, 0], [0, 20, 0], [20, 0, 2], [20, 30, 2]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 5, 3], [3, 5, 4], [4, 5, 6], [4, 6, 1]])
    found = mended(np.concatenate([left, right]), faces)
    assert_sound(found, (np.concatenate([left, right]), faces))
    assert found.remarks == ["2 T-junctions stitched"]
    assert igl.facet_components(found.F)[0] == 1


def test_cracks_within_the_rounding_of_a_float_are_welded():
    soup = V[F].reshape(-1, 3)
    noise = np.random.default_rng(0).uniform(-1, 1, soup.shape) * 4e-6
    found = mended(soup + noise, np.arange(len(soup)).reshape(-1, 3))
    assert_sound(found, (V, F), rtol=1e-5)
    assert len(found.V) == len(V)
    assert found.remarks == ["303 vertices merged that lay within 4e-05 mm of another"]


def test_a_gap_wider_than_the_tolerance_stays_open():
    apart = np.concatenate([V, V + [80.001, 0.0, 0.0]])
    found = mended(apart, np.concatenate([F, F + len(V)]))
    assert igl.facet_components(found.F)[0] == 2


def test_unreferenced_vertices_are_left_out_even_if_they_are_nan():
    stray = np.concatenate([[[np.nan] * 3, [np.inf, 0, 0]], V, [[1e12, 0, 0]]])
    found = mended(stray, F + 2)
    np.testing.assert_array_equal(found.V, V)
    assert found.remarks == ["3 vertices of no face left out"]


@pytest.mark.parametrize("closed", [False, True])
def test_bow_ties_are_parted(closed):
    if closed:
        first, faces = box()
        second = -first + 2 * first[7]
        pinch = (np.concatenate([first, second]), np.concatenate([faces, faces[:, ::-1] + 8]))
    else:
        corners = np.array([[0, 0, 0], [9, 3, 0], [9, -3, 0], [-9, 3, 0], [-9, -3, 0]], dtype=float)
        pinch = (corners, np.array([[0, 2, 1], [0, 3, 4]]))
    found = mended(*pinch)
    assert_sound(found, pinch)
    assert found.remarks[-1] == "1 bow-tie parted: sheets that touch in one point"


def test_a_closed_mesh_and_an_open_border_are_both_fine():
    assert mended(*box()).remarks == []
    hole = np.delete(F, [60, 61, 62], axis=0)
    assert_sound(mended(V, hole), (V, hole))


# Edges of three faces and more are borders of each, and each sheet keeps its own side.


def wall():
    """A fin on the middle of the grid: nine edges of which eight belong to three faces."""
    ridge = np.flatnonzero(np.abs(V[:, 0]) < 1e-9)
    top = V[ridge] + [0.0, 0.0, 10.0]
    n = len(V)
    fin = [[ridge[i], ridge[i + 1], n + i] for i in range(8)]
    fin += [[ridge[i + 1], n + i + 1, n + i] for i in range(8)]
    return np.concatenate([V, top]), np.concatenate([F, fin])


@pytest.mark.parametrize("flipped", [[], [5], [130], [5, 130, 140]])
def test_sheets_that_meet_in_an_edge_are_parted_and_oriented_each_for_itself(flipped):
    both, faces = wall()
    faces = np.array(faces)
    faces[flipped] = faces[flipped, ::-1]
    found = mended(both, faces)
    assert_sound(found, (both, faces))
    assert igl.facet_components(found.F)[0] == 3
    assert found.remarks[0].startswith("8 edges of three faces or more, the first at (0, ")
    assert len(found.remarks) == 1 + bool(flipped)
    up = np.cross(
        found.V[found.F[:, 1]] - found.V[found.F[:, 0]],
        found.V[found.F[:, 2]] - found.V[found.F[:, 0]],
    )
    assert (up[:128, 2] > 0).all()


def test_solids_that_share_an_edge_are_read_whole():
    first, faces = box()
    both = np.concatenate([first, first + [30.0, 0.0, 10.0]])
    found = mended(both, np.concatenate([faces, faces + 8]))
    assert_sound(found, (both, np.concatenate([faces, faces + 8])))
    assert igl.facet_components(found.F)[0] == 2
    assert len(found.F) == 28, "the four faces at the edge are cut in two"
    assert found.remarks[0] == "2 duplicate vertices merged"
    assert found.remarks[1].startswith("1 edge of three faces or more, the first at (15, 0, 5) mm")
    of = mesh.description(Source("a.obj", obj(both, np.concatenate([faces, faces + 8]))))
    assert (of["pieces"], of["volume"]) == (2, pytest.approx(12_000.0))


def test_a_moebius_strip_is_cut_and_what_lies_beside_it_is_whole():
    V, F = moebius()
    boxed, faces = box()
    found = mended(np.concatenate([V, boxed + 200.0]), np.concatenate([F, faces + len(V)]))
    told = [remark for remark in found.remarks if "one-sided" in remark]
    assert len(told) == 1
    assert "cut along 1 edge, the first at" in told[0]
    surface = Mesh(found.V, found.F)
    assert len(found.F) == len(F) + len(faces)
    neighbours = surface.topology.neighbours
    assert (neighbours > -2).all()
    for face, edge in zip(*np.nonzero(neighbours >= 0), strict=True):
        a, b = found.F[face, edge], found.F[face, (edge + 1) % 3]
        other = found.F[neighbours[face, edge]]
        assert (b, a) in zip(other, np.roll(other, -1), strict=True)
    assert len(surface.slits) >= 1
    assert sorted(surface.outward) == [0.0, 1.0]


# What is not safe to mend is refused by name.


def moebius(n=24):
    angle = np.arange(n) * 2 * np.pi / n
    rows = []
    for side in (-5.0, 5.0):
        r = 40.0 + side * np.cos(angle / 2)
        rows.append(np.stack([r * np.cos(angle), r * np.sin(angle), side * np.sin(angle / 2)], 1))
    a = np.arange(n)
    b = (a + 1) % n
    swap = b == 0
    low, high = np.where(swap, b + n, b), np.where(swap, b, b + n)
    faces = np.concatenate([np.stack([a, low, high], 1), np.stack([a, high, a + n], 1)])
    return np.concatenate(rows), faces


def changed(array, where, value):
    array = np.array(array)
    array[where] = value
    return array


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            obj(changed(V, (12, 1), np.nan), F),
            "has a vertex at (-30, nan, ",
        ),
        (obj(changed(V, (12, 2), np.inf), F), "which is no place (1 such vertex)"),
        (obj(V, changed(F, (17, 1), 81)), "face 18 names vertex 82, but there are 81"),
        (obj(V, changed(F, (17, 1), 10**9)), "face 18 names vertex 1000000001"),
        (obj(V, changed(F, (17, 1), -1)), "line 99: a face needs three vertices or more, from 1"),
        (obj(V, F[:0]), "holds no faces"),
        (obj(np.zeros_like(V), F), "no face has any area"),
        (obj(V, F)[:-4], "line 209: a face needs three vertices or more"),
        (obj(V, F) + b"v 1 2\n", "line 210: a vertex needs three numbers"),
        (obj(V, F) + b"v 1 2 x\n", "line 210: a vertex needs three numbers"),
    ],
)
def test_what_is_not_safe_to_mend_is_refused_by_name(content, message):
    with pytest.raises(InputError) as error:
        read(content, "part.obj")
    assert str(error.value).startswith("part.obj: ")
    assert message in str(error.value)
    assert error.value.exit_code == 2
    assert len(str(error.value).splitlines()) <= 2


def test_nan_in_a_binary_stl_is_refused():
    content = bytearray(written(V, F, "stl"))
    content[84 + 50 * 3 + 12 : 84 + 50 * 3 + 16] = np.float32(np.nan).tobytes()
    with pytest.raises(InputError, match=r"part\.stl: face 4 has a vertex at \(nan, "):
        read(bytes(content))


def test_an_index_out_of_range_in_ply_is_refused():
    content = written(V, F, "ply_ascii").replace(b"3 0 9 10\n", b"3 0 9 81\n")
    with pytest.raises(InputError, match=r"part\.ply: face 1 names vertex 82, but there are 81"):
        read(content, "part.ply")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("part", [0.3, 0.7, 0.999])
def test_truncated_files_are_refused(kind, part):
    content = written(V, F, kind)
    # An OBJ does not say how many lines it has: only a broken one shows.
    end = int(part * len(content)) if kind != "obj" else content.rindex(b"f ") + 4
    if kind in ("ply_ascii", "off"):
        end -= 4
    with pytest.raises(InputError) as error:
        read(content[:end], f"part.{KINDS[kind]}")
    assert str(error.value).startswith(f"part.{KINDS[kind]}: ")


@pytest.mark.parametrize(
    ("content", "name", "message"),
    [
        (b"solid part\nendsolid part\n", "p.stl", "holds no faces"),
        (b"hello", "p.stl", "as a binary STL of 0 facets it would have 84 bytes, but has 5"),
        (
            b"hello",
            "p.txt",
            "is neither a mesh (STL, OBJ, PLY or OFF) nor a plane, cylinder or sphere",
        ),
        (b"ply\n", "p.ply", "cannot be read as PLY"),
        (b"\x89PNG\0\0", "p.png", "is neither a mesh"),
    ],
)
def test_what_is_no_mesh_is_refused(content, name, message):
    with pytest.raises(InputError) as error:
        read(content, name)
    assert message in str(error.value)


def test_a_text_stl_names_the_line_of_a_bad_number():
    content = written(V, F, "stl_ascii").split(b"\n")
    at = next(i for i, line in enumerate(content) if b"vertex" in line)
    content[at] = b"vertex 1.0 two 3.0"
    with pytest.raises(InputError, match=rf"line {at + 1}: a vertex needs three numbers"):
        read(b"\n".join(content))


def test_obj_polygons_negative_indices_and_textures_are_read():
    text = b"""# a square and a triangle
v 0 0 0 0.5 0.5 0.5
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
usemtl red
f 1/1 2/1/1 3//1 \\
 4
v 2 0 0
f -4 -1 3
"""
    found = read(text, "standard input")
    assert_sound(found)
    assert len(found.F) == 3
    assert area(found.V, found.F) == pytest.approx(1.5)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.permutations(range(20)), st.integers(0, 1000))
def test_the_order_of_vertices_and_faces_does_not_change_the_surface(order, seed):
    rng = np.random.default_rng(seed)
    small, faces = grid(4)
    number = rng.permutation(len(small))
    shuffled = np.empty_like(small)
    shuffled[number] = small
    found = mended(shuffled, number[faces][np.resize(order, len(faces)) % len(faces)])
    assert_sound(found)


@pytest.mark.thorough
@settings(max_examples=300, deadline=None)
@given(st.lists(st.tuples(*[st.integers(0, 26)] * 3), min_size=1, max_size=14))
def test_triangles_thrown_on_a_lattice_become_sound_or_are_refused(faces):
    corners = np.stack(np.meshgrid([0, 1, 2], [0, 1, 2], [0, 1, 2]), axis=-1).reshape(-1, 3)
    try:
        found = mended(10.0 * corners, np.array(faces))
    except InputError as error:
        assert "\n" not in str(error)
        return
    assert_sound(found)
    # Faces were left out or cut in pieces where they lay: none is anywhere else.
    parts, _, _ = igl.point_mesh_squared_distance(
        found.V[found.F].mean(axis=1), 10.0 * corners, np.array(faces)
    )
    assert parts.max() < 1e-9


@pytest.mark.thorough
def test_no_file_whatever_it_holds_ends_the_process():
    """Damaged files of every format, in a process of their own: a crash would be a signal."""
    script = """
    import sys
    import warnings

    import igl
    import numpy as np

    from dmpcli.errors import InputError
    from dmpcli.records import mesh
    from dmpcli.records.file_io import Source
    from tests.records.meshes import grid, written

    warnings.simplefilter("error")
    rng = np.random.default_rng(3)
    V, F = grid(5)
    outcomes = {"read": 0, "refused": 0}
    for kind in ("stl", "stl_ascii", "obj", "ply", "ply_ascii", "off", "noise"):
        whole = written(V, F, kind) if kind != "noise" else bytes(300)
        for _ in range(250):
            content = np.frombuffer(whole, dtype=np.uint8).copy()
            for _ in range(rng.integers(1, 4)):
                at = rng.integers(len(content))
                if rng.random() < 0.5:
                    content[at] = rng.integers(256)
                else:
                    content[at : at + 4] = rng.integers(256, size=len(content[at : at + 4]))
            if kind == "noise":
                content = rng.integers(256, size=rng.integers(1, 400)).astype(np.uint8)
            name = ("a.stl", "a.obj", "a.ply")[rng.integers(3)]
            try:
                found = mesh.decode(Source(name, content.tobytes()))
            except InputError:
                outcomes["refused"] += 1
                continue
            outcomes["read"] += 1
            tree = igl.AABB()
            tree.init(found.V, found.F)
            squares = tree.squared_distance(found.V, found.F, rng.standard_normal((20, 3)))[0]
            assert np.isfinite(squares).all()
            mesh.summary(found)
    print(outcomes["read"], outcomes["refused"])
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr.decode()
    read_whole, refused = map(int, done.stdout.split())
    assert read_whole > 100
    assert refused > 300

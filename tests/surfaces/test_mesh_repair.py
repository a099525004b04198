"""Meshes with one fault each, put there on purpose; trimesh judges what comes out."""

import numpy as np
import pytest
import trimesh

from dmpcli.errors import InputError
from dmpcli.surfaces.mesh_repair import borders, components, mended

BALL = trimesh.creation.icosphere(subdivisions=2, radius=40.0)


def ball():
    return np.array(BALL.vertices), np.array(BALL.faces, dtype=np.int64)


def grid(n=4, size=10.0):
    """A square plate of n x n squares, two triangles each, wound to look up."""
    V = np.array([[i * size, j * size, 0.0] for i in range(n + 1) for j in range(n + 1)])
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (at[i : i + n, j : j + n].ravel() for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return V, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def as_trimesh(found):
    return trimesh.Trimesh(found.V, found.F, process=False)


def same_surface(found, V, F):
    """Area and outward volume are those of the part as it was meant."""
    meant = trimesh.Trimesh(V, F, process=False)
    assert as_trimesh(found).area == pytest.approx(meant.area, rel=1e-9)
    assert as_trimesh(found).volume == pytest.approx(meant.volume, rel=1e-9)


def test_a_sound_mesh_is_left_as_it_is():
    V, F = ball()
    found = mended(V, F)
    assert found.remarks == []
    assert np.array_equal(found.V, V)
    assert np.array_equal(found.F, F)


def test_three_corners_for_each_face_become_one_mesh_without_a_word():
    V, F = ball()
    found = mended(V[F].reshape(-1, 3), np.arange(3 * len(F)).reshape(-1, 3))
    assert found.remarks == []
    assert len(found.V) == len(V)
    assert as_trimesh(found).is_watertight
    same_surface(found, V, F)


def test_vertices_of_no_face_are_left_out_and_counted():
    V, F = ball()
    V = np.concatenate([[[900.0, 0, 0]], V[:50], [[0.0, 700, 0], [1, 1, 1]], V[50:]])
    shifted = np.where(F < 50, F + 1, F + 3)
    found = mended(V, shifted)
    assert found.remarks == ["3 vertices of no face left out"]
    same_surface(found, *ball())


def test_vertices_at_one_point_are_merged_and_counted():
    V, F = ball()
    F[:6, 0], V = len(V) + np.arange(6), np.concatenate([V, V[F[:6, 0]]])
    found = mended(V, F)
    assert found.remarks == ["6 duplicate vertices merged"]
    assert as_trimesh(found).is_watertight
    same_surface(found, *ball())


def test_a_crack_within_the_tolerance_is_closed_and_a_wider_one_is_not():
    V, F = grid()
    for gap, rims in ((2e-5, 1), (2e-3, 2)):
        other = V + [0.0, 40.0 + gap, 0.0]
        found = mended(np.concatenate([V, other]), np.concatenate([F, F + len(V)]))
        assert components(found.F) == rims
        assert borders(found.F) == ((24, 1) if rims == 1 else (32, 2))
        assert len(found.V) == (45 if rims == 1 else 50)
        said = ["5 vertices merged that lay within 8e-05 mm of another"] if rims == 1 else []
        assert found.remarks == said


def test_faces_without_area_and_faces_that_are_there_twice_are_left_out():
    V, F = ball()
    flat = np.array([[F[0, 0], F[0, 0], F[0, 1]], [F[9, 0], F[9, 1], F[9, 1]]])
    twins = np.stack([F[3], F[5][[1, 2, 0]], F[7][::-1]])
    found = mended(V, np.concatenate([F, flat, twins]))
    assert found.remarks == ["2 faces without area left out", "3 duplicate faces left out"]
    assert np.array_equal(found.F, F)
    thin = np.concatenate([V, [(V[F[0, 0]] + V[F[0, 1]]) / 2.0]])
    needle = np.array([[F[0, 0], F[0, 1], len(V)]])
    assert "1 face without area left out" in mended(thin, np.concatenate([F, needle])).remarks


def test_a_t_junction_is_stitched_at_the_vertices_on_the_edge_in_their_order():
    V, F = grid(4)
    strip = np.array([[0.0, 40.0, 0.0], [40.0, 40.0, 0.0], [0.0, 60.0, 0.0], [40.0, 60.0, 0.0]])
    wide = np.array([[0, 1, 3], [0, 3, 2]]) + len(V)
    found = mended(np.concatenate([V, strip]), np.concatenate([F, wide]))
    assert "3 T-junctions stitched" in found.remarks
    assert components(found.F) == 1
    assert borders(found.F) == (4 + 4 + 4 + 3, 1)
    assert as_trimesh(found).area == pytest.approx(40.0 * 60.0)
    assert (as_trimesh(found).face_normals[:, 2] > 0.999).all()


def test_t_junctions_of_several_edges_are_counted_together():
    V, F = grid(4)
    wide = np.array([[0, 1, 3], [0, 3, 2]])
    far = np.array([[0.0, 40.0, 0.0], [40.0, 40.0, 0.0], [0.0, 60.0, 0.0], [40.0, 60.0, 0.0]])
    near = far * [1.0, -1.0, 1.0] + [0.0, 40.0, 0.0]
    parts = [V, far, near]
    faces = [F, wide + len(V), wide[:, ::-1] + len(V) + 4]
    found = mended(np.concatenate(parts), np.concatenate(faces))
    assert "6 T-junctions stitched" in found.remarks
    assert borders(found.F) == (8 + 2 * 3, 1)
    assert as_trimesh(found).area == pytest.approx(40.0 * 80.0)


@pytest.mark.parametrize(("share", "outward"), [(0.3, 1.0), (0.7, -1.0)])
def test_faces_that_look_the_other_way_are_turned_as_most_of_the_part_looks(share, outward):
    V, F = ball()
    over = np.random.default_rng(1).permutation(len(F)) < share * len(F)
    F = np.where(over[:, None], F[:, ::-1], F)
    # Another part beside it keeps its own way.
    V2, F2 = grid()
    found = mended(np.concatenate([V, V2 + 500.0]), np.concatenate([F, F2 + len(V)]))
    meant = trimesh.Trimesh(*ball(), process=False).volume
    mesh = trimesh.Trimesh(found.V, found.F[: len(F)], process=False)
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(outward * meant)
    number = int(min(over.sum(), len(F) - over.sum()))
    assert found.remarks == [f"{number} faces turned over to agree with the others"]
    assert np.array_equal(found.F[len(F) :] - len(V), F2)


def moebius(n=40):
    """A strip that is wound half a turn about its middle line."""
    a = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    rows = []
    for w in (-5.0, 5.0):
        r = 40.0 + w * np.cos(a / 2)
        rows.append(np.column_stack([r * np.cos(a), r * np.sin(a), w * np.sin(a / 2)]))
    F = []
    for i in range(n):
        j = (i + 1) % n
        low, high = (j, n + j) if j else (n, 0)
        F += [[i, low, high], [i, high, n + i]]
    return np.concatenate(rows), np.array(F)


def test_a_one_sided_strip_is_cut_once_across_and_said_where():
    V, F = moebius()
    found = mended(V, F)
    assert len(found.V) == len(V) + 2
    assert as_trimesh(found).is_winding_consistent
    assert components(found.F) == 1
    assert borders(found.F) == (2 * 40 + 2, 1)
    assert "one-sided, like a Möbius strip, and cut along 1 edge" in found.remarks[-1]


def test_sheets_that_meet_in_a_point_are_parted():
    V, F = grid(1)
    found = mended(np.concatenate([V, V + [10.0, 10.0, 0.0]]), np.concatenate([F, F + len(V)]))
    assert found.remarks[-1] == "1 bow-tie parted: sheets that touch in one point"
    assert components(found.F) == 2
    assert borders(found.F) == (8, 2)
    assert len(found.V) == 8


def test_three_sheets_on_one_edge_are_borders_of_each():
    V = np.array([[0.0, 0, 0], [0, 0, 10], [10, 0, 0], [-10, 5, 0], [-10, -5, 0]])
    F = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    found = mended(V, F)
    assert "1 edge of three faces or more, the first at (0, 0, 5) mm" in found.remarks[-1]
    assert components(found.F) == 3
    assert borders(found.F) == (9, 3)


def test_two_boxes_that_touch_along_an_edge_stay_two_and_are_open_along_it():
    box = trimesh.creation.box((10.0, 10.0, 10.0))
    V, F = np.array(box.vertices), np.array(box.faces)
    found = mended(np.concatenate([V, V + [10.0, 10.0, 0.0]]), np.concatenate([F, F + 8]))
    assert components(found.F) == 2
    # Either half of the edge is a border of both faces there, which have a middle of their own.
    assert borders(found.F) == (8, 2)
    assert len(found.V) == 16 + 4
    assert as_trimesh(found).volume == pytest.approx(2000.0)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("index", r"^face 4 names vertex 163, but there are 162"),
        ("negative", r"^face 4 names vertex 0, but"),
        ("nan", r"^face \d+ has a vertex at \(nan, .* no place \(1 such vertex\)"),
        ("huge", r"reach 4e\+07 mm; check the unit"),
        ("none", "holds no faces"),
        ("flat", "no face has any area"),
    ],
)
def test_what_cannot_be_mended_is_refused_by_place(fault, words):
    V, F = ball()
    match fault:
        case "index":
            F[3, 1] = len(V)
        case "negative":
            F[3, 1] = -1
        case "nan":
            V[11, 0] = np.nan
        case "huge":
            V *= 1e6
        case "none":
            F = F[:0]
        case "flat":
            V[:, 1:] = 0.0
    with pytest.raises(InputError, match=words):
        mended(V, F)


@pytest.mark.parametrize("size", [0.01, 0.3, 1.0, 40.0])
@pytest.mark.parametrize("turned", [False, True])
def test_a_vertex_on_a_border_edge_is_stitched_whatever_the_size_of_the_mesh(size, turned):
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, -1, 0], [0.4, 0, 0], [0.2, 1, 0], [0.7, 1, 0]])
    F = np.array([[0, 2, 1], [0, 3, 4], [3, 1, 5], [3, 5, 4]])
    V = size * (-V[:, [1, 0, 2]] if turned else V)
    found = mended(V, F)
    assert len(found.F) == 5
    assert any("1 T-junction stitched" in remark for remark in found.remarks)
    assert len(found.V) == 6

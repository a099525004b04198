"""Neighbours, borders and pieces of meshes, and what meshes say of themselves, beside trimesh."""

import itertools

import numpy as np
import pytest
import trimesh

from dmpcli.surfaces.topology import Topology, places
from dmpcli.surfaces.triangle_mesh import TriangleMesh

BALL = trimesh.creation.icosphere(subdivisions=2, radius=20.0)


def open_part():
    """A ball without a cap, and a tetrahedron beside it."""
    cap = BALL.triangles_center[:, 2] < 12.0
    part = BALL.submesh([cap], append=True)
    beside = trimesh.creation.icosphere(subdivisions=0, radius=5.0)
    beside.apply_translation([60.0, 0.0, 0.0])
    made = trimesh.util.concatenate([part, beside])
    return np.array(made.vertices), np.array(made.faces)


def by_hand(F):
    """Faces by undirected edge."""
    of = {}
    for i, face in enumerate(F.tolist()):
        for k in range(3):
            of.setdefault(frozenset((face[k], face[(k + 1) % 3])), []).append(i)
    return of


def test_neighbours_uses_and_borders_are_those_of_the_edges_one_by_one():
    V, F = open_part()
    F = np.concatenate([F, [[F[0, 0], F[0, 1], len(V)]]])
    V = np.concatenate([V, [[0.0, 0.0, 90.0]]])
    topology, of = Topology(F, len(V)), by_hand(F)
    at_border = set()
    for i, k in itertools.product(range(len(F)), range(3)):
        edge = frozenset((int(F[i, k]), int(F[i, (k + 1) % 3])))
        sharing = of[edge]
        assert topology.uses[i, k] == len(sharing)
        assert topology.border[i, k] == (len(sharing) == 1)
        across = {1: -1, 2: sum(sharing) - i}.get(len(sharing), -2)
        assert topology.neighbours[i, k] == across
        at_border |= edge if len(sharing) == 1 else set()
    assert set(np.flatnonzero(topology.border_vertices)) == at_border


def test_pieces_are_numbered_and_closed_where_trimesh_says_so():
    V, F = open_part()
    topology = Topology(F, len(V))
    pieces = trimesh.Trimesh(V, F, process=False).split(only_watertight=False, repair=False)
    assert len(np.unique(topology.components)) == len(pieces) == 2
    assert topology.closed(V).tolist() == [False, True]
    sizes = sorted(np.bincount(topology.components).tolist())
    assert sizes == sorted(len(piece.faces) for piece in pieces)
    crowded = np.concatenate([F, [[*F[-1, :2], len(V)]]])
    more = np.concatenate([V, [[70.0, 0.0, 30.0]]])
    assert not Topology(crowded, len(more)).closed(more)[1]


def test_a_cut_whose_borders_lie_on_one_another_is_closed_and_a_gap_is_not():
    box = trimesh.creation.box((10.0, 10.0, 10.0))
    V, F = np.array(box.vertices), np.array(box.faces)
    ends = F[0, :2]
    # Both faces at an edge get vertices of their own in its middle: a cut along it.
    other = next(i for i in range(1, 12) if set(ends) <= set(F[i]))
    F, V = F.copy(), np.concatenate([V, [V[ends].mean(axis=0)] * 2])
    halves = []
    for number, i in enumerate((0, other)):
        a = next(k for k in range(3) if {F[i, k], F[i, (k + 1) % 3]} == set(ends))
        x, y, z = F[i, a], F[i, (a + 1) % 3], F[i, (a + 2) % 3]
        F[i] = [x, 8 + number, z]
        halves.append([8 + number, y, z])
    cut = np.concatenate([F, halves])
    assert Topology(cut, 10).border.sum() == 4
    assert Topology(cut, 10).closed(V).tolist() == [True]
    moved = V.copy()
    moved[9] += [0.0, 0.0, 1e-3]
    assert Topology(cut, 10).closed(moved).tolist() == [False]


def test_places_are_one_where_vertices_lie_on_one_another():
    V = np.array([[0.0, 0, 0], [5, 0, 0], [5, 1e-12, 0], [9, 0, 0], [0, 0, 1e-13]])
    found = places(V, np.array([[0, 1], [2, 3], [4, 1]]))
    assert found[0, 0] == found[2, 0]
    assert found[0, 1] == found[1, 0] == found[2, 1]
    assert len(np.unique(found)) == 3


@pytest.mark.parametrize("twins", [0, 1, 5])
@pytest.mark.parametrize("square", [False, True])
def test_places_are_those_of_all_distances_whether_any_lie_together_or_not(twins, square):
    rng = np.random.default_rng(twins)
    V = rng.uniform(-50.0, 50.0, (60, 3))
    if square:  # many lie in one plane, and none together
        V = np.stack(np.meshgrid(*[np.arange(4.0)] * 3), -1).reshape(-1, 3)
    again = rng.choice(len(V), twins, replace=False)
    V = np.concatenate([V, V[again] + rng.uniform(-1e-9, 1e-9, (twins, 3))])
    ends = rng.permutation(2 * len(V)).reshape(-1, 2) % len(V)
    found = places(V, ends).reshape(-1)
    apart = np.linalg.norm(V[ends.reshape(-1)][:, None] - V[ends.reshape(-1)], axis=-1)
    np.testing.assert_array_equal(found[:, None] == found, apart < 1e-8)


def test_sizes_angles_and_sides_of_a_mesh_are_trimeshs():
    V, F = open_part()
    mesh, theirs = TriangleMesh(V, F), trimesh.Trimesh(V, F, process=False)
    assert mesh.face_normals == pytest.approx(theirs.face_normals, abs=1e-9)
    plane = mesh.planes_at(np.arange(len(F)))
    planes = np.einsum("mj,mkj->mk", plane[:, :3], V[F]) - plane[:, 3:]
    assert np.abs(planes).max() < 1e-9
    between = dict(
        zip(
            map(frozenset, theirs.face_adjacency_edges.tolist()),
            np.degrees(theirs.face_adjacency_angles),
            strict=True,
        )
    )
    for i, k in itertools.product(range(0, len(F), 7), range(3)):
        edge = frozenset((int(F[i, k]), int(F[i, (k + 1) % 3])))
        assert mesh.shape.dihedrals[i, k] == pytest.approx(between.get(edge, 0.0), abs=1e-5)
    assert mesh.outward.tolist() == [0.0, 1.0]
    assert TriangleMesh(V, F[:, ::-1]).outward.tolist() == [0.0, -1.0]
    assert mesh.shape.noisy_share == 0.0


def test_closest_points_and_their_faces_are_trimeshs_for_any_shape_of_points():
    V, F = open_part()
    mesh = TriangleMesh(V, F)
    points = np.random.default_rng(3).uniform(-30, 70, (4, 6, 3))
    found = mesh.closest(points)
    position, distance, _ = trimesh.proximity.closest_point_naive(
        trimesh.Trimesh(V, F, process=False), points.reshape(-1, 3)
    )
    assert found.position.reshape(-1, 3) == pytest.approx(position, abs=1e-9)
    assert found.distance.reshape(-1) == pytest.approx(distance, abs=1e-9)
    assert found.position.shape == found.normal.shape == (4, 6, 3)
    assert np.linalg.norm(found.normal, axis=-1) == pytest.approx(np.ones((4, 6)))
    a, b, c = np.moveaxis(V[F[found.face]], -2, 0)
    n = np.cross(b - a, c - a)
    off = np.sum((found.position - a) * n, axis=-1) / np.linalg.norm(n, axis=-1)
    assert np.abs(off).max() < 1e-9


def test_a_strokes_course_may_lie_off_a_face_by_five_times_the_chordal_error_about_it():
    V, F = np.array(BALL.vertices), np.array(BALL.faces)
    mesh = TriangleMesh(V, F)
    assert (mesh.shape.reach >= 5.0 * mesh.shape.heights - 1e-12).all()
    heights = mesh.shape.heights
    touching = [
        max(heights[j] for j in range(len(F)) if set(F[i]) & set(F[j])) for i in (0, 77, 200)
    ]
    assert mesh.shape.reach[[0, 77, 200]] == pytest.approx(5.0 * np.array(touching))

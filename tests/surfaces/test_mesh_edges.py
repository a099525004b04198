"""Edges, neighbours and fans of triangles beside one-by-one counting, and points that coincide."""

import itertools

import numpy as np
import pytest
import trimesh

from dmpcli.surfaces import coincident
from dmpcli.surfaces.coincident import distinct
from dmpcli.surfaces.integer_sort import sorted_with_order
from dmpcli.surfaces.mesh_edges import Edges
from dmpcli.surfaces.topology import Adjacency


def some_faces(seed):
    """Few vertices, so that edges are shared by one, two and many, wound either way."""
    rng = np.random.default_rng(seed)
    F = rng.integers(0, rng.integers(4, 12), (rng.integers(1, 40), 3))
    F = F[[len(set(face)) == 3 for face in F.tolist()]]
    return F[np.sort(np.unique(np.sort(F, axis=1), axis=0, return_index=True)[1])]


def by_hand(F):
    of = {}
    for i, k in itertools.product(range(len(F)), range(3)):
        edge = tuple(sorted((int(F[i, (k + 1) % 3]), int(F[i, (k + 2) % 3]))))
        of.setdefault(edge, []).append(k * len(F) + i)
    return dict(sorted(of.items()))


@pytest.mark.parametrize("seed", range(40))
def test_edges_are_those_that_are_found_one_by_one_and_in_the_order_of_their_ends(seed):
    F = some_faces(seed)
    edges, of = Edges.of(F), by_hand(F)
    halves = [sorted(found) for found in of.values()]
    assert edges.border.tolist() == [found[0] for found in halves if len(found) == 1]
    assert edges.one.tolist() == [found[0] for found in halves if len(found) == 2]
    assert edges.other.tolist() == [found[1] for found in halves if len(found) == 2]
    assert edges.crowded.tolist() == [h for found in halves if len(found) > 2 for h in found]
    for h, ends in enumerate(edges.half.tolist()):
        assert ends == [F[h % len(F), (h // len(F) + k) % 3] for k in (1, 2)]


@pytest.mark.parametrize("seed", range(40))
def test_fans_are_as_many_as_walking_about_each_vertex_counts(seed):
    F = some_faces(seed)
    left = {(v, i) for i, face in enumerate(F.tolist()) for v in face}
    shared = [[h % len(F) for h in of] for of in by_hand(F).values() if len(of) == 2]
    fans = 0
    while left:
        fans += 1
        reached = [left.pop()]
        while reached:
            v, i = reached.pop()
            for one, two in shared:
                other = (v, one + two - i)
                if i in (one, two) and other in left:
                    left.remove(other)
                    reached.append(other)
    assert Edges.of(F).fans == fans


def test_pieces_are_numbered_as_vertices_that_hang_together_are():
    ball = trimesh.creation.icosphere(subdivisions=1)
    one, two = ball.faces, ball.faces + len(ball.vertices)
    F = np.concatenate([two[:30], one, two[30:]])
    found = Adjacency.of(Edges.of(F).neighbours, F).components
    assert found.tolist() == [1] * 30 + [0] * len(one) + [1] * (len(two) - 30)
    assert not Adjacency.of(Edges.of(one).neighbours, one).components.any()


@pytest.mark.parametrize("most", [1, 50, 2**40, 2**62])
def test_numbers_are_sorted_and_equal_ones_stay_in_their_order(most):
    keys = np.random.default_rng(0).integers(0, most, 500)
    keys[100:200] = keys[0]
    got, order = sorted_with_order(keys)
    assert got.tolist() == sorted(keys.tolist())
    assert order.tolist() == sorted(range(500), key=lambda i: (keys[i], i))
    assert len(sorted_with_order(keys[:0])[0]) == 0


@pytest.mark.parametrize("alike", [False, True])
def test_points_at_one_place_are_one_in_the_order_of_z_y_x_whatever_number_they_get(
    alike, monkeypatch
):
    rng = np.random.default_rng(1)
    V = rng.integers(-2, 3, (400, 3)) * 0.1
    V[rng.random(V.shape) < 0.1] = -0.0
    if alike:  # as if all had one number
        monkeypatch.setattr(coincident, "_mixed", lambda V, bits: np.zeros(len(V), dtype=np.int64))
    first, number = distinct(V)
    places = sorted({tuple(v[::-1] + 0.0) for v in V})
    assert [tuple(v[::-1] + 0.0) for v in V[first]] == places
    assert number.tolist() == [places.index(tuple(v[::-1] + 0.0)) for v in V]
    assert first.tolist() == [number.tolist().index(k) for k in range(len(places))]

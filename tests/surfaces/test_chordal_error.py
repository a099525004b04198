"""The estimate of a mesh's chordal error, beside its true distance to the surface it is made of."""

import numpy as np
import pytest
import trimesh

from dmpcli.surfaces.chordal_error import chordal_error
from tests.records.meshes import box, grid


def deviation(V, F, distance):
    """Largest true distance over samples of every face."""
    weights = np.array([[1, 1, 1], [1, 1, 0], [1, 0, 1], [0, 1, 1]], dtype=float)
    weights /= weights.sum(axis=1, keepdims=True)
    return np.abs(distance(np.einsum("ki,fij->fkj", weights, V[F]))).max()


@pytest.mark.parametrize("n", [31, 61, 121])
@pytest.mark.parametrize("radius", [60.0, 150.0])
def test_on_round_surfaces_it_is_the_true_distance_within_a_fifth(n, radius):
    half = 0.5 * radius
    cylinder = grid(n, half, lambda x, y: np.sqrt(radius**2 - x**2))
    sphere = grid(n, half, lambda x, y: np.sqrt(radius**2 - x**2 - y**2))
    true = deviation(*cylinder, lambda p: np.hypot(p[..., 0], p[..., 2]) - radius)
    assert chordal_error(*cylinder).largest == pytest.approx(true, rel=0.2)
    true = deviation(*sphere, lambda p: np.linalg.norm(p, axis=-1) - radius)
    assert chordal_error(*sphere).largest == pytest.approx(true, rel=0.2)


def test_on_a_closed_sphere_of_even_triangles_it_is_the_true_distance():
    made = trimesh.creation.icosphere(4, 100.0)
    V, F = np.array(made.vertices, dtype=float), np.array(made.faces)
    true = deviation(V, F, lambda p: np.linalg.norm(p, axis=-1) - 100.0)
    assert chordal_error(V, F).largest == pytest.approx(true, rel=0.05)


def test_it_falls_with_the_square_of_the_facets_size():
    coarse, fine = (chordal_error(*grid(n, 90.0)) for n in (41, 81))
    assert coarse.median / fine.median == pytest.approx(4.0, rel=0.05)
    assert coarse.median <= coarse.largest


def test_what_is_meant_to_be_flat_or_sharp_has_none():
    assert chordal_error(*box()).largest == 0.0
    assert chordal_error(*grid(9, 40.0, lambda x, y: 0.3 * x)).largest < 1e-12
    ridge = grid(9, 40.0, lambda x, y: -np.abs(x))
    assert chordal_error(*ridge).largest < 1e-12

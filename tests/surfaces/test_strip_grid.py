"""Nodes of strips: differences of fourth order, and which nodes cells need."""

import numpy as np
import pytest

from dmpcli.surfaces import compiled_stepping, strip_grid
from dmpcli.surfaces.strip_grid import Grid
from tests.surfaces.test_mesh import folded


@pytest.mark.parametrize("nodes", [5, 6, 9])
@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4])
def test_slopes_of_polynomials_of_fourth_degree_are_exact_at_every_node(nodes, degree):
    x = np.arange(float(nodes))
    values = np.stack([x**degree, -2.0 * (x - 3.0) ** degree], axis=-1)
    slope = degree * x ** max(degree - 1, 0)
    aside = -2.0 * degree * (x - 3.0) ** max(degree - 1, 0)
    found = strip_grid._slopes(np.stack([values, 7.0 * values]))
    np.testing.assert_allclose(found[0], np.stack([slope, aside], axis=-1), atol=1e-9)
    np.testing.assert_allclose(found[1], 7.0 * found[0], atol=1e-8)


def test_corners_are_those_of_the_cells():
    cells = np.zeros((2, 4, 3), dtype=bool)
    cells[0, 1, 2] = cells[1, 3, 0] = True
    found = strip_grid.corners(cells)
    assert found.shape == (2, 5, 4)
    assert np.argwhere(found).tolist() == [
        [0, 1, 2], [0, 1, 3], [0, 2, 2], [0, 2, 3], [1, 3, 0], [1, 3, 1], [1, 4, 0], [1, 4, 1]
    ]  # fmt: skip


def test_a_cell_needs_the_cross_lines_that_its_slopes_come_from_and_no_others():
    cells = np.zeros((2, 8, 4), dtype=bool)
    cells[0, 4, 3] = True  # the second to the left of the centre line, which is node 2
    cells[1, 0, 0] = True  # the second to its right, at the end
    left, right = (n.reshape(2, 9) for n in strip_grid._needs(cells, Grid(3, 5, 2, 2)))
    assert left[0].tolist() == [0, 0, 2, 2, 2, 2, 2, 2, 0]
    assert right[1].tolist() == [2, 2, 2, 2, 2, 0, 0, 0, 0]
    assert not left[1].any()
    assert not right[0].any()


def test_lines_that_begin_off_the_mesh_look_to_the_last_one_on_it():
    away = np.array([[3.0, 0, 0, 0, 2, 0], [0, 5.0, 0, 1, 1, 1]])
    found = strip_grid._last_on(away, 2).reshape(2, 6)
    assert found[0].tolist() == [1, 1, 2, 3, 3, 5]
    assert (found[1] - 6).tolist() == [0, 2, 2, 2, 2, 2]


def test_a_mesh_without_kernels_is_walked_without_them(monkeypatch):
    """They need what may not be installed."""

    def start(*_):
        raise AssertionError

    monkeypatch.setattr(compiled_stepping, "start", start)
    mesh = folded(0.0)
    begin, end = np.array([[[-20.0, 1.0, 0.0]], [[20.0, 1.0, 0.0]]])
    lift = mesh.charts(begin, end).lift(np.array([[[0.0, 0, 0], [10.0, 5.0, 0], [40.0, 0, 0]]]))
    np.testing.assert_allclose(lift.position[0, 1], [-10.0, 6.0, 0.0], atol=1e-9)

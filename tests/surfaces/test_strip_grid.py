"""Nodes of strips: differences of fourth order, and which nodes cells need."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.surfaces import compiled_stepping, strip_grid
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.strip_grid import CentreLines, Grid
from dmpcli.surfaces.surface import Status
from tests.surfaces import cases, fields
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


def test_what_was_walked_to_find_the_goal_is_the_centre_line_bit_by_bit():
    """Beside the border too, and on strokes that swing beyond their goals and starts."""
    mesh = Mesh(*fields.square(cases.FIELDS["bumpy"], 5_000, reach=100.0))
    rng = np.random.default_rng(3)
    ends = np.pad(rng.uniform(-98.0, 98.0, (60, 2, 2)), ((0, 0), (0, 0), (0, 1)))
    charts = mesh.charts(ends[:, 0], ends[:, 1])
    rows = np.flatnonzero((charts.status == Status.DRAWN) & ~charts.creased)
    assert len(rows) > 40
    centre = charts.centre.rows(rows)
    assert centre.course is not None
    assert centre.course.begin_as(centre.direction, centre.step)
    anew = replace(centre, course=None)
    for behind, ahead in ((0, 3), (2, 0), (3, 40)):
        counts = np.full(len(rows), behind), np.full(len(rows), ahead)
        found, expected = (
            vars(CentreLines.walked(mesh, one, *counts)._lines) for one in (centre, anew)
        )
        for name, values in expected.items():
            assert values.tobytes() == found[name].tobytes(), name
    assert expected["away"].any()


def test_a_course_of_another_heading_is_not_taken_for_the_centre_line():
    mesh = folded(0.0)
    charts = mesh.charts(np.array([[-20.0, 1.0, 0.0]]), np.array([[20.0, 1.0, 0.0]]))
    turned = replace(charts.centre, direction=np.array([[0.0, 1.0, 0.0]]))
    found = CentreLines.walked(mesh, turned, np.array([0]), np.array([4]))
    step = float(charts.centre.step[0, 0])
    np.testing.assert_allclose(found.position[0, -1], [-20.0, 1.0 + 4 * step, 0.0], atol=1e-9)

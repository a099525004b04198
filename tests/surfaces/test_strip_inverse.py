"""Strips inverted on their own nodes: what the chart drew is found, foot by foot."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from dmpcli import extras
from dmpcli.surfaces import strip_inverse, strip_pieces
from dmpcli.surfaces.inverse_chart import _by_steps, invert, on_strips
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.strip_grid import Grid
from dmpcli.surfaces.strip_settling import Course
from tests.extras_here import needs
from tests.surfaces import cases, zoo
from tests.surfaces.judge import Judge, traced

S = np.linspace(0.0, 1.0, 120)


@pytest.fixture(scope="module")
def bumpy():
    return cases.mesh("bumpy", 8_000)


@pytest.fixture(scope="module")
def ball():
    made = trimesh.creation.icosphere(subdivisions=3, radius=100.0)
    return Mesh(made.vertices, made.faces)


def laid(surface, headings=3, half=54.0, top=5.0):
    angle = 2.0 * np.arange(headings) + 0.3
    way = half * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    above = np.array([0.0, 0.0, top])
    ends = surface.closest(above - way), surface.closest(above + way)
    return surface.charts(ends[0].position, ends[1].position)


def wave(charts, wide=25.0, height=0.0):
    u = charts.lengths[:, None] * S
    v = np.broadcast_to(wide * np.sin(4 * np.pi * S), u.shape)
    return np.stack([u, v, np.full(u.shape, height)], axis=-1)


@pytest.mark.slow
@pytest.mark.parametrize("height", [0.0, 0.3, -0.3])
def test_what_a_chart_drew_is_found_on_its_own_nodes(bumpy, height):
    charts = laid(bumpy)
    wanted = wave(charts, height=height)
    drawn = charts.lift(wanted)
    found = strip_inverse.found(charts, drawn.position)
    assert found.rows.tolist() == [0, 1, 2]
    np.testing.assert_allclose(found.coordinates, wanted, atol=2e-6)
    again = charts.lift(found.coordinates)
    assert np.abs(again.position - drawn.position).max() < 1e-6
    assert found.miss.max() <= 1e-6


@pytest.mark.slow
def test_it_agrees_with_the_search_that_lifts_what_it_tries(bumpy):
    charts = laid(bumpy)
    drawn = charts.lift(wave(charts, wide=18.0))
    quick, slow = invert(charts, drawn.position), _by_steps(charts, drawn.position)
    assert quick.complete.all()
    assert slow.complete.all()
    np.testing.assert_allclose(quick.coordinates, slow.coordinates, atol=5e-6)
    np.testing.assert_allclose(quick.axes, slow.axes, atol=1e-6)


@pytest.mark.slow
def test_a_stroke_is_found_alike_alone_and_among_others(bumpy):
    charts = laid(bumpy)
    position = charts.lift(wave(charts)).position
    together = strip_inverse.found(charts, position)
    for row in (0, 2):
        alone = strip_inverse.found(charts.rows(np.array([row])), position[row : row + 1])
        np.testing.assert_array_equal(alone.coordinates[0], together.coordinates[row])
        np.testing.assert_array_equal(alone.axes[0], together.axes[row])


def test_positions_far_off_the_mesh_are_left_to_the_search(bumpy):
    charts = laid(bumpy, headings=1)
    wanted = wave(charts, height=6.0)
    drawn = charts.lift(wanted)
    assert len(strip_inverse.found(charts, drawn.position).rows) == 0
    np.testing.assert_allclose(invert(charts, drawn.position).coordinates, wanted, atol=2e-6)


@pytest.mark.thorough
def test_feet_on_edges_are_led_to_as_near_as_the_smooth_course_lies_to_the_facets(ball):
    charts = laid(ball, headings=2, half=40.0, top=95.0)
    drawn = charts.lift(wave(charts, wide=12.0)).position
    # On a ball of facets every edge is convex: put each point on the nearest edge of its facet.
    hits = ball.closest(drawn)
    corners = ball.V[ball.F[hits.face]]
    way = np.roll(corners, -1, axis=-2) - corners
    gap = hits.position[..., None, :] - corners
    share = np.clip((gap * way).sum(-1) / (way * way).sum(-1), 0.05, 0.95)
    foot = corners + share[..., None] * way
    near = np.linalg.norm(foot - hits.position[..., None, :], axis=-1).argmin(axis=-1)
    on_edges = np.take_along_axis(foot, near[..., None, None], axis=2)[:, :, 0]
    found = invert(charts, on_edges)
    assert found.complete.all()
    again = charts.lift(found.coordinates)
    assert np.linalg.norm(again.position - on_edges, axis=-1).max() < 0.03
    # Points of facets are led to all the way.
    exact = strip_inverse.found(charts, drawn)
    assert exact.rows.tolist() == [0, 1]
    assert exact.miss.max() <= 1e-6


def test_a_strip_has_the_nodes_of_all_eight_cells_around_that_of_a_sample(monkeypatch):
    walked = []
    monkeypatch.setattr(strip_pieces, "walk_nodes", lambda *given: walked.append(given[4]))
    mesh = SimpleNamespace(compiled=False)
    charts = SimpleNamespace(mesh=mesh, centre=SimpleNamespace(step=np.ones((1, 1))))
    at = np.array([[[0.5, 1.5]]])  # in the cell 3 along and 4 across
    strip_pieces.Strip(charts, Grid(3, 4, 3, 4), np.ones((1, 1)), at)
    wanted = np.zeros((1, 7, 7), dtype=bool)
    wanted[0, 2:5, 3:6] = True
    np.testing.assert_array_equal(walked[0], wanted)


@needs(extras.FAST)
@pytest.mark.thorough
@pytest.mark.parametrize("height", [0.0, 0.3, -0.3])
@pytest.mark.parametrize("wide", [0.0, 4.0, 25.0])
def test_kernels_find_what_the_chart_drew(bumpy, ball, height, wide):
    coarse = cases.mesh("bumpy", 1_500)
    for mesh, half, top in ((bumpy, 54.0, 5.0), (ball, 40.0, 100.0), (coarse, 54.0, 5.0)):
        charts = laid(mesh.with_kernels, half=half, top=top)
        wanted = wave(charts, wide=wide, height=height)
        drawn = charts.lift(wanted)
        found = strip_inverse.found(charts, drawn.position)
        pure = strip_inverse.found(laid(mesh, half=half, top=top), drawn.position)
        assert found.rows.tolist() == pure.rows.tolist()
        if mesh is not coarse:  # over its edges several coordinates lead to one foot
            np.testing.assert_allclose(found.coordinates, wanted[found.rows], atol=2e-6)
        np.testing.assert_allclose(found.coordinates, pure.coordinates, atol=2e-8)
        np.testing.assert_allclose(found.axes, pure.axes, atol=1e-7)
        assert found.miss.max(initial=0.0) <= 1e-6


@needs(extras.FAST)
@pytest.mark.thorough
def test_kernels_find_a_stroke_alike_alone_and_among_others(bumpy):
    charts = laid(bumpy.with_kernels)
    position = charts.lift(wave(charts)).position
    together = strip_inverse.found(charts, position)
    for row in (0, 2):
        alone = strip_inverse.found(charts.rows(np.array([row])), position[row : row + 1])
        np.testing.assert_array_equal(alone.coordinates[0], together.coordinates[row])
        np.testing.assert_array_equal(alone.axes[0], together.axes[row])


@needs(extras.FAST)
@pytest.mark.thorough
@pytest.mark.parametrize("name", ["drilled", "ribbed", "cone", "filleted"])
def test_kernels_tell_alike_what_has_no_place_on_parts_with_edges(name):
    mesh = zoo.mesh(name)
    pairs = traced(Judge(mesh), 12, np.random.default_rng(4))
    charts = mesh.charts(pairs.start, pairs.goal)
    drawn = charts.lift(wave(charts, wide=3.0))
    position = np.where(np.isfinite(drawn.position), drawn.position, 0.0)
    pure = strip_inverse.found(charts, position)
    kernels = mesh.with_kernels.charts(pairs.start, pairs.goal)
    found = strip_inverse.found(kernels, position)
    assert 0 < len(pure.rows) < 12
    np.testing.assert_array_equal(found.rows, pure.rows)
    np.testing.assert_allclose(found.coordinates, pure.coordinates, atol=2e-8)
    strips = on_strips(kernels, position)
    assert set(np.flatnonzero(strips.complete)) <= set(found.rows.tolist())
    np.testing.assert_array_equal(
        strips.complete, invert(charts, position).complete & strips.complete
    )


@needs(extras.FAST)
@pytest.mark.thorough
@pytest.mark.parametrize("name", ["bumpy", "ribbed", "united"])
@pytest.mark.parametrize("other", [None, 3, 0], ids=["one course", "one strays", "none"])
def test_a_course_in_common_tells_nothing_else_than_each_stroke_does(name, other):
    if name == "bumpy":
        pure = laid(cases.mesh("bumpy", 8_000), headings=12)
        kernels = laid(cases.mesh("bumpy", 8_000).with_kernels, headings=12)
    else:
        mesh = zoo.mesh(name)
        pairs = traced(Judge(mesh), 12, np.random.default_rng(9))
        pure, kernels = (m.charts(pairs.start, pairs.goal) for m in (mesh, mesh.with_kernels))
    wanted = wave(pure, wide=3.0)
    if other is not None:
        wanted[other, :, 1] *= 1.5
    drawn = pure.lift(wanted).position
    position = np.where(np.isfinite(drawn), drawn, 0.0)
    course = Course()
    found, each = (
        strip_inverse.found(kernels, position, course),
        strip_inverse.found(kernels, position),
    )
    np.testing.assert_array_equal(found.rows, each.rows)
    np.testing.assert_allclose(found.coordinates, each.coordinates, atol=1e-9)
    np.testing.assert_allclose(found.axes, each.axes, atol=1e-9)
    np.testing.assert_array_equal(found.rows, strip_inverse.found(pure, position).rows)
    assert course.told
    if name == "bumpy":
        assert (course.place is None) == (other == 0)
    # Strokes that are measured later take what was told.
    again = strip_inverse.found(kernels, position, course)
    np.testing.assert_array_equal(again.rows, each.rows)
    np.testing.assert_allclose(again.coordinates, each.coordinates, atol=1e-9)


@needs(extras.FAST)
@pytest.mark.thorough
def test_kernels_find_the_closest_points_of_paths(bumpy):
    rng = np.random.default_rng(2)
    charts = laid(bumpy)
    path = charts.lift(wave(charts, height=2.0)).position
    for paths in (path, path + 3.0 * rng.normal(size=path.shape), 4.0 * path):
        foot, normal, _ = bumpy.with_kernels.closest_along(paths)
        there = bumpy.closest(paths)
        apart = np.linalg.norm(paths - foot, axis=-1)
        np.testing.assert_allclose(apart, there.distance, atol=1e-9)
        np.testing.assert_allclose(foot, there.position, atol=1e-6)
        np.testing.assert_allclose(normal, there.normal, atol=1e-6)

"""What cannot be drawn is named: borders, holes, folds of the chart, thin walls, other parts."""

import numpy as np
import pytest

from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.sphere import Sphere
from dmpcli.surfaces.surface import Status
from tests.surfaces import cases, fields

RADIUS = 60.0
HALF = np.array([85.0, 75.0])  # of the patch, unrolled
HOLE = np.array([12.0, 8.0])


def roll(s):
    """Points of the cylinder from unrolled coordinates."""
    a = s[..., 0] / RADIUS
    return np.stack([RADIUS * np.sin(a), s[..., 1], RADIUS * np.cos(a) - RADIUS], axis=-1)


def patch_with_hole(cells):
    """A mesh of the patch without the cells whose middle is within 14 mm of `HOLE`."""
    V, F = fields.grid(
        lambda x, y: roll(np.stack([x, y], -1)),
        cells + 1,
        cells + 1,
        (-HALF[0], HALF[0]),
        (-HALF[1], HALF[1]),
    )
    keep = ~in_hole(cell_middles(cells), cells)
    return Mesh(V, F[np.tile(keep, 2)])


def cell_middles(cells):
    i, j = np.divmod(np.arange(cells * cells), cells)
    return (np.stack([i, j], axis=1) + 0.5) / cells * 2 * HALF - HALF


def in_hole(s, cells):
    """Whether unrolled points are in a cell that is left out."""
    middle = (np.floor((s + HALF) / (2 * HALF) * cells) + 0.5) / cells * 2 * HALF - HALF
    return np.linalg.norm(middle - HOLE, axis=-1) < 14.0


def off_patch(s, cells):
    return in_hole(s, cells) | (np.abs(s) > HALF).any(axis=-1)


def unrolled_strokes(count, cells, samples=300, seed=5):
    """Chart coordinates, and strokes on the unrolled sheet, of pairs that start and end on it."""
    rng = np.random.default_rng(seed)
    start = rng.uniform(-HALF, HALF, (8 * count, 2))
    heading, L = rng.uniform(0, 2 * np.pi, 8 * count), rng.uniform(50, 110, 8 * count)
    u = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    goal = start + L[:, None] * u
    good = np.flatnonzero(~off_patch(start, cells) & ~off_patch(goal, cells))[:count]
    start, goal, u, L = start[good], goal[good], u[good], L[good]
    coordinates = fields.strokes(L, samples, periods=1)
    v = np.stack([-u[:, 1], u[:, 0]], axis=-1)
    sheet = start[:, None] + coordinates[..., :1] * u[:, None] + coordinates[..., 1:2] * v[:, None]
    return start, goal, L, coordinates, sheet


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("cells", [40, 120])
def test_strokes_off_a_patch_with_a_hole_are_told_from_those_on_it(cells):
    mesh = patch_with_hole(cells)
    start, goal, L, coordinates, sheet = unrolled_strokes(300, cells)
    charts = mesh.charts(roll(start), roll(goal))
    scaled = coordinates.copy()
    scaled[..., 0] *= (charts.lengths / L)[:, None]
    lift = charts.lift(scaled)
    # How far off the true curve the mesh puts a point decides which strokes are too near to call.
    reach = 3 * cases.largest_error("cylinder", mesh) + 0.02
    ways = reach * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    off = np.stack([off_patch(sheet + way, cells) for way in ways])
    leaves, stays = off.all(axis=0).any(axis=1), ~off.any(axis=(0, 2))
    assert leaves.sum() > 60
    assert stays.sum() > 60
    assert leaves.sum() + stays.sum() > 285
    refused = lift.status != Status.DRAWN
    assert refused[leaves].all(), np.flatnonzero(leaves & ~refused)
    assert not refused[stays].any(), (np.flatnonzero(stays & refused), lift.status[stays & refused])
    # Sample by sample, where the walk there is not over the hole.
    right = lift.status == Status.BORDER
    sure = off.all(axis=0) | ~off.any(axis=0)
    agree = lift.outside[right][sure[right]] == off.all(axis=0)[right][sure[right]]
    assert agree.mean() > 0.995
    on = stays[:, None] & ~lift.outside
    away = np.linalg.norm(lift.position - roll(sheet), axis=-1)[on]
    # Cross lines that were carried over the hole are known less well than those on the mesh.
    assert np.quantile(away, 0.95) <= 1.5 * mesh.shape.heights.max()
    assert away.max() <= 0.15


def plate(thickness):
    """A closed box of 200 x 160 mm; its top is z = 0."""
    x, y, z = 100.0, 80.0, thickness
    V = np.array([[i * x, j * y, k] for k in (-z, 0.0) for j in (-1, 1) for i in (-1, 1)])
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    F = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    return V, F


@pytest.mark.slow
def test_the_far_side_of_a_thin_wall_is_not_drawn_on():
    mesh = Mesh(*plate(0.8))
    top, under = np.array([[-40.0, 5.0, 0.0]]), np.array([[40.0, 5.0, -0.8]])
    up = np.array([0.0, 0.0, 1.0])
    assert mesh.charts(top, under * [1, 1, 0], up).status[0] == Status.DRAWN
    assert mesh.charts(top, under, up).status[0] == Status.OTHER_SIDE
    lift = mesh.charts(top, under * [1, 1, 0], up).lift(fields.strokes([80.0], 100))
    np.testing.assert_allclose(lift.position[..., 2], 0.0, atol=1e-9)
    np.testing.assert_allclose(lift.normal[0], np.tile(up, (100, 1)), atol=1e-9)


@pytest.mark.parametrize("wound", [1, -1])
def test_a_solid_is_drawn_on_from_outside_however_it_is_wound(wound):
    V, F = plate(0.8)
    mesh = Mesh(V, F[:, ::wound])
    start = np.array([[-40.0, 5.0, -0.1], [-40.0, 5.0, -0.7]])
    goal = start * [-1, 1, 1]
    down = np.array([0.0, 0.0, -1.0])
    np.testing.assert_array_equal(
        mesh.charts(start, goal, -down).status, [Status.DRAWN, Status.FACES_AWAY]
    )
    np.testing.assert_array_equal(
        mesh.charts(start, goal, down).status, [Status.FACES_AWAY, Status.DRAWN]
    )
    lift = mesh.charts(start, goal).lift(fields.strokes([80.0, 80.0], 50))
    assert not lift.status.any()
    np.testing.assert_allclose(lift.normal[:, 0], [-down, down], atol=1e-9)


def test_parts_that_do_not_touch_are_named():
    V, F = fields.grid(lambda x, y: np.stack([x, y, 0 * x], -1), 5, 5, (-50, 50), (-50, 50))
    mesh = Mesh(np.concatenate([V, V + [120.0, 0, 0]]), np.concatenate([F, F + len(V)]))
    start, goal = np.array([[0.0, 0, 0]] * 2), np.array([[130.0, 0, 0], [30.0, 0, 0]])
    status = mesh.charts(start, goal).status
    np.testing.assert_array_equal(status, [Status.OTHER_COMPONENT, Status.DRAWN])
    # A stroke that swings over the gap onto the other part leaves its own.
    wide = np.array([[[0.0, 0.0, 0.0], [15.0, -100.0, 0.0], [30.0, 0.0, 0.0]]])
    lift = mesh.charts(start[1:], np.array([[0.0, 30.0, 0.0]])).lift(wide)
    assert lift.status[0] == Status.BORDER
    np.testing.assert_array_equal(lift.outside[0], [False, True, False])
    assert mesh.charts(start[:1], start[:1]).status[0] == Status.COINCIDENT


def test_a_chart_that_folds_is_named():
    # Cross lines from a great circle meet a quarter of a great circle away: 39 mm at R 25.
    n = 80

    def point(t, p):
        return 25.0 * np.stack([np.sin(t) * np.sin(p), np.cos(t), np.sin(t) * np.cos(p)], -1)

    mesh = Mesh(*fields.grid(point, n, 2 * n, (0.05, np.pi - 0.05), (-2.9, 2.9)))
    ball = Sphere(np.zeros(3), 25.0)
    start, goal = point(np.array([1.2]), np.array([-0.4])), point(np.array([1.9]), np.array([0.4]))
    for swing, status in ((20.0, Status.DRAWN), (45.0, Status.FOLDED)):
        stroke = fields.strokes([1.0], 200, 1, 2 * swing)
        found = []
        for surface in (mesh, ball):
            charts = surface.charts(start, goal)
            found.append(charts.lift(stroke * [charts.lengths[0], 1.0, 1.0]).status[0])
        assert found == [status, status]


def test_a_bar_is_drawn_round_as_the_exact_cylinder():
    def bar(a, y):
        return np.stack([RADIUS * np.sin(a), y, RADIUS * np.cos(a)], axis=-1)

    mesh = Mesh(*fields.grid(bar, 181, 60, (-2.8, 2.8), (-100, 100)))
    exact = Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), RADIUS)
    start, goal = bar(np.array([-1.0]), np.array([-20.0])), bar(np.array([1.3]), np.array([15.0]))
    charts, true = mesh.charts(start, goal), exact.charts(start, goal)
    np.testing.assert_allclose(charts.lengths, true.lengths, atol=0.05)
    stroke = fields.strokes(true.lengths, 300)
    off = charts.lift(stroke).position - true.lift(stroke).position
    assert np.linalg.norm(off, axis=-1).max() < 0.1


def test_a_stroke_may_begin_on_the_border_but_not_swing_back_over_it():
    field = cases.FIELDS["saddle"]
    mesh = Mesh(*fields.square(field, 5_000))
    start = field.point(np.array([-100.0, -100.0]), np.array([10.0, 20.0]))
    goal = field.point(np.array([-20.0, -30.0]), np.array([0.0, 30.0]))
    charts = mesh.charts(start, goal)
    stroke = np.zeros((2, 60, 3))
    stroke[..., 0] = charts.lengths[:, None] * np.linspace(0, 1, 60)
    assert not charts.lift(stroke).status.any()
    lift = charts.lift(stroke - [5.0, 0.0, 0.0])
    assert (lift.status == Status.BORDER).all()
    np.testing.assert_array_equal(lift.outside, stroke[..., 0] < 5.0 - 1e-6)


def test_no_pairs_are_no_trouble():
    mesh = cases.mesh("saddle", 200)
    none = np.empty((0, 3))
    assert mesh.charts(none, none).lift(np.empty((0, 20, 3))).position.shape == (0, 20, 3)


@pytest.mark.slow
def test_a_step_in_the_surface_is_named():
    V, F = fields.grid(
        lambda x, y: np.stack([x, y, np.where(x > 0.5, -1.5, 0.0)], -1),
        201,
        21,
        (-100, 100),
        (-60, 60),
    )
    mesh = Mesh(V, F)
    start, goal = np.array([[-50.0, 0.0, 0.0]]), np.array([[50.0, 0.0, -1.5]])
    charts = mesh.charts(start, goal)
    lift = charts.lift(fields.strokes(charts.lengths, 200))
    # Drawn down one wall of the step and on, or refused: never floating over it.
    assert lift.unfolded[0] or lift.status[0] != Status.DRAWN
    if lift.status[0] == Status.DRAWN:
        assert mesh.closest(lift.position).distance.max() < 1e-6
        np.testing.assert_allclose(charts.lengths, 99.0 + np.hypot(1.0, 1.5), atol=1e-6)

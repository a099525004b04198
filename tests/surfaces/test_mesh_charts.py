"""Charts of meshes against the true strips of the surfaces they stand for."""

import numpy as np
import pytest
import trimesh

from dmpcli.spatial import rotations
from dmpcli.surfaces import mesh_charts
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.surface import Status
from tests.surfaces import cases, fields
from tests.surfaces.test_mesh import folded


def deviation(name, faces, headings=12, periods=2):
    mesh, case = cases.mesh(name, faces), cases.case(name, headings, 300, periods)
    charts, lift = cases.drawn(mesh, case)
    assert (lift.status == Status.DRAWN).all()
    assert not lift.unfolded.any()
    return mesh, case, charts, lift, np.linalg.norm(lift.position - case.position, axis=-1)


@pytest.mark.sweep(kept=3)
@pytest.mark.slow
@pytest.mark.parametrize("periods", [1, 2])
@pytest.mark.parametrize("name", cases.SURFACES)
def test_strokes_follow_the_true_strip_as_well_as_the_mesh_allows(name, periods):
    mesh, case, _, lift, off = deviation(name, 20_000, periods=periods)
    assert off.max() <= (0.11 if name == "bumpy" else 1.5 * cases.largest_error(name, mesh))
    assert mesh.closest(lift.position).distance.max() <= 1e-6
    end = np.linalg.norm(lift.position[:, -1] - mesh.closest(case.goal).position, axis=1)
    assert end.max() <= 1e-4
    start = np.linalg.norm(lift.position[:, 0] - mesh.closest(case.start).position, axis=1)
    assert start.max() <= 1e-9
    assert cases.turns(lift.axes).max() <= 1.5 * cases.turns(case.axes).max() + 0.3
    skew = np.einsum("btij,btij->bt", lift.axes, case.axes)
    assert np.degrees(np.arccos((skew.min() - 1) / 2)) < 2.0


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("name", cases.SURFACES)
def test_deviation_shrinks_with_the_square_of_the_edge_length(name):
    coarse, fine = (deviation(name, faces)[-1].max() for faces in (4_000, 36_000))
    assert fine < coarse / 5.5  # 9 for pure second order


@pytest.mark.slow
@pytest.mark.parametrize("name", cases.SURFACES)
def test_w_stands_off_the_mesh_along_the_normal(name):
    mesh, case = cases.mesh(name, 5_000), cases.case(name, 6, 100)
    charts = mesh.charts(case.start, case.goal)
    raised = case.coordinates + [0.0, 0.0, 3.0]
    lift = charts.lift(raised)
    foot = lift.position - 3.0 * lift.normal
    assert mesh.closest(foot).distance.max() <= 1e-6
    np.testing.assert_allclose(np.linalg.norm(lift.normal, axis=-1), 1.0)
    C = lift.axes
    np.testing.assert_allclose(
        np.swapaxes(C, -1, -2) @ C, np.broadcast_to(np.eye(3), C.shape), atol=1e-12
    )


@pytest.mark.slow
def test_a_rigid_motion_moves_everything_alike():
    mesh, case = cases.mesh("bumpy", 5_000), cases.case("bumpy", 16, 200)
    _, lift = cases.drawn(mesh, case)
    R, shift = rotations.exp(np.array([0.4, -0.9, 1.3])), np.array([-551.7, -37.6, 280.0])
    moved = Mesh(mesh.V @ R.T + shift, mesh.F)
    charts = moved.charts(case.start @ R.T + shift, case.goal @ R.T + shift, side=R[:, 2])
    coordinates = case.coordinates.copy()
    coordinates[..., 0] *= (charts.lengths / cases.LENGTH)[:, None]
    again = charts.lift(coordinates)
    np.testing.assert_allclose(again.position, lift.position @ R.T + shift, atol=1e-6)
    np.testing.assert_allclose(again.axes, R @ lift.axes, atol=1e-6)


@pytest.mark.slow
def test_the_order_of_vertices_faces_and_pairs_does_not_matter():
    mesh, case = cases.mesh("bumpy", 5_000), cases.case("bumpy", 16, 200)
    _, lift = cases.drawn(mesh, case)
    rng = np.random.default_rng(3)
    places, faces = rng.permutation(len(mesh.V)), rng.permutation(len(mesh.F))
    V = np.empty_like(mesh.V)
    V[places] = mesh.V
    F = np.roll(places[mesh.F][faces], 1, axis=1)
    charts, again = cases.drawn(Mesh(V, F), case)
    np.testing.assert_allclose(again.position, lift.position, atol=1e-6)
    back = Mesh(mesh.V, mesh.F).charts(case.start[::-1], case.goal[::-1])
    np.testing.assert_allclose(back.lengths[::-1], charts.lengths, atol=1e-9)


@pytest.mark.slow
def test_a_pair_alone_is_drawn_as_among_others():
    mesh, case = cases.mesh("saddle", 2_000), cases.case("saddle", 5, 100)
    scale = np.array([1.0, 0.5, 0.7, 0.35, 0.9])[:, None]
    goal = mesh.closest(case.start + scale * (case.goal - case.start)).position
    charts = mesh.charts(case.start, goal)
    coordinates = case.coordinates * scale[..., None]
    together = charts.lift(coordinates).position
    for i in range(5):
        one = mesh.charts(case.start[i : i + 1], goal[i : i + 1]).lift(coordinates[i : i + 1])
        np.testing.assert_allclose(one.position[0], together[i], atol=1e-9)


def test_a_planar_mesh_is_the_plane():
    R, at = rotations.exp(np.array([0.3, 0.2, 0.4])), np.array([-550.0, 20.0, -17.0])
    V, F = fields.grid(lambda x, y: np.stack([x, y, 0 * x], -1), 30, 41, (-100, 100), (-100, 100))
    mesh, plane = Mesh(V @ R.T + at, F), Plane(at, R[:, 2])
    heading = np.linspace(0, 6, 15)[:, None]
    half = 54.5 * np.concatenate([np.cos(heading), np.sin(heading), 0 * heading], axis=1)
    start, goal = at - half @ R.T, at + half @ R.T
    coordinates = fields.strokes(np.full(15, 109.0), 200) + [0.0, 0.0, 1.5]
    flat = plane.charts(start, goal).lift(coordinates)
    lift = mesh.charts(start, goal).lift(coordinates)
    np.testing.assert_allclose(lift.position, flat.position, atol=1e-6)
    np.testing.assert_allclose(lift.axes, flat.axes, atol=1e-9)
    closed = R @ rotations.exp(np.array([0.1, -0.2, 0.0]))
    goal = start + 4.0 * R[:, 0] - 2.0 * R[:, 1]
    a, b = (s.charts(start, goal, None, closed) for s in (plane, mesh))
    np.testing.assert_allclose(b.goals, a.goals, atol=1e-6)
    around = fields.strokes(np.full(15, 30.0), 100)
    np.testing.assert_allclose(b.lift(around).position, a.lift(around).position, atol=1e-6)


@pytest.mark.sweep(kept=3)
@pytest.mark.slow
@pytest.mark.parametrize("degrees", [20.0, 30.0, 60.0, 90.0])
@pytest.mark.parametrize("cells", [1, 12])
def test_folds_are_drawn_as_on_the_flat_sheet(degrees, cells):
    # Less than `CREASE` is smoothed over, as the facets of a coarse curve; more is exact.
    a = np.radians(degrees)
    mesh = folded(degrees, half=90.0, cells=2 * cells)
    heading = np.linspace(-1.0, 1.0, 7)
    half = 54.5 * np.stack([np.cos(heading), np.sin(heading)], axis=-1)

    def over(xy):
        x, y = xy[..., 0], xy[..., 1]
        return np.stack(
            [np.where(x < 0, x, x * np.cos(a)), y, np.where(x < 0, 0, -x * np.sin(a))], -1
        )

    coordinates = fields.strokes(np.full(7, 109.0), 300)
    start, goal = -half + [1.3, 0.0], half + [1.3, 0.0]
    u = (goal - start) / 109.0
    v = np.stack([-u[:, 1], u[:, 0]], axis=-1)
    sheet = start[:, None] + coordinates[..., :1] * u[:, None] + coordinates[..., 1:2] * v[:, None]
    charts = mesh.charts(over(start), over(goal))
    lift = charts.lift(coordinates)
    assert (lift.status == Status.DRAWN).all()
    off = np.linalg.norm(lift.position - over(sheet), axis=-1).max()
    if degrees < 25.0:
        assert off < mesh.shape.heights.max()
        return
    assert lift.unfolded.all()
    assert off < 1e-6
    np.testing.assert_allclose(charts.lengths, 109.0, atol=1e-6)


TOLERANCE = 0.05


def fillet(radius, rows=(-120.0, 120.0)):
    """Sheet of two planes and a quarter of a cylinder in facets as long as between the rows.

    Also the map from the unrolled sheet to the true surface.
    """
    facets = int(np.ceil(np.pi / 2 / (2 * np.arccos(1 - TOLERANCE / radius))))
    arc = np.linspace(0, np.pi / 2, facets + 1)
    around = np.stack([radius * np.sin(arc), radius * np.cos(arc) - radius], axis=1)
    profile = np.concatenate([[[-120.0, 0.0]], around, [[radius, -radius - 120.0]]])

    def swept(i, j):
        k, y = np.rint(i).astype(int), np.array(rows)[np.rint(j).astype(int)]
        return np.stack([profile[k, 0], y, profile[k, 1]], axis=-1)

    def rolled(xy):
        s = xy[..., 0]
        angle = np.clip(s / radius, 0, np.pi / 2)
        past = np.maximum(s - radius * np.pi / 2, 0.0)
        x = np.minimum(s, 0) + radius * np.sin(angle)
        return np.stack([x, xy[..., 1], radius * np.cos(angle) - radius - past], axis=-1)

    last = len(profile) - 1
    return fields.grid(swept, last + 1, len(rows), (0, last), (0, len(rows) - 1)), rolled


def over_the_fillet(radius):
    """Start, goal and coordinates of strokes about its middle, and the unrolled strokes."""
    heading = np.linspace(-1.2, 1.2, 9)
    u = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    v = np.stack([-u[:, 1], u[:, 0]], axis=-1)
    coordinates = fields.strokes(np.full(9, 109.0), 300)
    start = np.array([radius * np.pi / 4, 2.0]) - 54.5 * u
    sheet = start[:, None] + coordinates[..., :1] * u[:, None] + coordinates[..., 1:2] * v[:, None]
    return start, start + 109.0 * u, coordinates, sheet


@pytest.mark.slow
@pytest.mark.parametrize("radius", [5.0, 20.0, 60.0])
def test_fillets_of_long_slivers_stay_within_their_chordal_tolerance(radius):
    (V, F), rolled = fillet(radius)
    start, goal, coordinates, sheet = over_the_fillet(radius)
    charts = Mesh(V, F).charts(rolled(start), rolled(goal))
    coordinates[..., 0] *= (charts.lengths / 109.0)[:, None]
    lift = charts.lift(coordinates)
    assert (lift.status == Status.DRAWN).all()
    off = np.linalg.norm(lift.position - rolled(sheet), axis=-1).max()
    assert off <= TOLERANCE, off
    assert np.linalg.norm(lift.position[:, -1] - charts.target, axis=1).max() <= 0.01


@pytest.mark.slow
def test_slivers_beside_a_hole_are_drawn_as_without_it():
    # Lines straight across the facets stop at the hole; the strip is carried over it.
    (V, F), rolled = fillet(60.0, (-120.0, 10.0, 16.0, 120.0))
    start, goal, coordinates, _ = over_the_fillet(60.0)
    whole = Mesh(V, F).charts(rolled(start), rolled(goal)).lift(coordinates)
    middle = rolled(np.array([[6.2, 13.0]]))
    kept = np.linalg.norm(V[F].mean(axis=1) - middle, axis=1) > 6.0
    assert 1 < np.sum(~kept) < 9
    lift = Mesh(V, F[kept]).charts(rolled(start), rolled(goal)).lift(coordinates)
    drawn = lift.status == Status.DRAWN
    assert drawn.sum() >= 6
    assert set(lift.status[~drawn]) <= {Status.BORDER, Status.NO_GEODESIC}
    assert np.abs(lift.position[drawn] - whole.position[drawn]).max() < 2 * TOLERANCE


def test_slivers_of_a_surface_curved_both_ways_are_not_unfolded():
    def ball(a, b):
        x, y, z = np.cos(b) * np.sin(a), np.sin(b), np.cos(b) * np.cos(a)
        return 150.0 * np.stack([x, y, z - 1.0], axis=-1)

    mesh = Mesh(*fields.grid(ball, 200, 20, (-0.6, 0.6), (-0.6, 0.6)))
    assert not mesh.shape.developable.slivers.any()
    assert mesh.shape.developable.stretched.mean() > 0.9


def noisy(mesh, sigma):
    rng = np.random.default_rng(1)
    return Mesh(mesh.V + sigma * rng.normal(size=mesh.V.shape), mesh.F)


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("name", cases.SURFACES)
@pytest.mark.parametrize("sigma", [0.05, 0.1])
def test_strokes_over_a_noisy_scan_keep_their_place_and_turn_gently(name, sigma):
    smooth, case = cases.mesh(name, 35_000), cases.case(name, 12, 300)
    assert not smooth.shape.noise.any()
    mesh = noisy(smooth, sigma)  # edges of 1.5 mm: facets meet at up to 50°
    rough = mesh.shape.noise > 0.0
    assert rough.mean() > 0.6
    assert np.median(mesh.shape.noise[rough]) == pytest.approx(sigma, rel=0.2)
    _, lift = cases.drawn(mesh, case)
    assert (lift.status == Status.DRAWN).all()
    assert not lift.unfolded.any()
    off, n = lift.position - case.position, case.axes[..., 2]
    beside = np.linalg.norm(off - np.sum(off * n, axis=-1, keepdims=True) * n, axis=-1)
    assert beside.max() < (2.5 if name != "bumpy" else 3.5) * sigma
    assert np.linalg.norm(off, axis=-1).max() < 4.5 * sigma
    assert cases.turns(lift.axes).max() < cases.turns(case.axes).max() + 3.0


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("degrees", [10.0, 25.0, 60.0])
def test_folds_of_a_noisy_scan_are_drawn_well_or_refused(degrees):
    sigma, a = 0.1, np.radians(degrees)
    mesh = noisy(folded(degrees, half=90.0, cells=120), sigma)
    heading = np.linspace(-1.0, 1.0, 7)
    u = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    v = np.stack([-u[:, 1], u[:, 0]], axis=-1)
    start = -54.5 * u + [1.3, 0.0]

    def over(xy):
        x, y = xy[..., 0], xy[..., 1]
        return np.stack(
            [np.where(x < 0, x, x * np.cos(a)), y, np.where(x < 0, 0, -x * np.sin(a))], -1
        )

    coordinates = fields.strokes(np.full(7, 109.0), 300)
    sheet = start[:, None] + coordinates[..., :1] * u[:, None] + coordinates[..., 1:2] * v[:, None]
    charts = mesh.charts(over(start), over(start + 109.0 * u))
    lift = charts.lift(coordinates)
    off = np.linalg.norm(lift.position - over(sheet), axis=-1).max(axis=1)
    drawn = lift.status == Status.DRAWN
    assert drawn.all() == (degrees <= 25.0)
    assert (off[drawn] < 6.0 * sigma).all()
    assert not drawn.any() or degrees <= 30.0
    assert set(lift.status[~drawn]) <= {Status.NOISY, Status.NO_GEODESIC, Status.LOST}


def course(step, back, turn=0.0):
    """A stroke of one chart that comes back by `back` mm in the middle, in steps of `step` mm."""
    count = round(10.0 / step)
    there = np.arange(count + 1) * step
    again = there[-1] - np.arange(1, round(back / step) + 1) * step
    x = np.concatenate([there, again, again[-1:] + there[1:]] if len(again) else [there])
    foot = np.stack([x, 0 * x, 0 * x], axis=-1)[None]
    u = np.arange(len(x)) * step
    coordinates = np.stack([u, 0 * u, 0 * u], axis=-1)[None]
    axes = np.tile(np.eye(3), (1, len(x), 1, 1))
    axes[0, count + 1 :: 2] = rotations.exp(np.radians(turn) * np.array([0.0, 1.0, 0.0]))
    return mesh_charts._folded(foot, axes, coordinates).tolist()


@pytest.mark.parametrize("step", [0.05, 0.5, 1.0])
def test_what_comes_back_along_its_line_by_more_than_a_third_of_a_millimetre_folds(step):
    """However fine its steps are."""
    assert course(step, 2.0) == [True]
    assert course(step, 0.0) == [False]


def test_what_comes_back_by_little_or_between_facets_that_lean_does_not_fold():
    assert course(0.05, 0.25) == [False]
    assert course(0.05, 0.4) == [True]
    # The chord over an edge is in neither facet.
    assert course(0.5, 2.0, 9.0) == [True]
    assert course(0.5, 2.0, 11.0) == [False]


def test_points_that_lean_out_over_a_border_by_little_of_their_height_are_over_the_mesh():
    mesh = folded(0.0)
    charts = mesh.charts(np.array([[-20.0, 0.0, 0.0]]), np.array([[20.0, 0.0, 0.0]]))
    beside = np.array([[[61.3, 5, 0.0], [61.2, 5, 0.0], [64.5, 5, 20.0], [66.0, 5, 20.0]]])
    assert charts.over(beside).tolist() == [[False, True, True, False]]
    assert charts.over(beside * [-1.0, 1.0, -1.0]).tolist() == [[False, True, True, False]]
    assert charts.over(beside - [30.0, 0, 0]).all()


def test_a_goal_on_the_far_side_of_a_thin_plate_is_not_led_to_over_its_rim():
    made = trimesh.creation.box((60.0, 40.0, 0.5)).subdivide()
    mesh = Mesh(np.array(made.vertices), np.array(made.faces))
    start = np.array([[25.0, 3.0, 0.25], [25.0, 3.0, 0.25]])
    goal = np.array([[22.0, -6.0, -0.25], [22.0, -6.0, 0.25]])
    charts = mesh.charts(start, goal)
    assert charts.status.tolist() == [Status.OTHER_SIDE, Status.DRAWN]
    thick = trimesh.creation.box((60.0, 40.0, 8.0)).subdivide()
    block = Mesh(np.array(thick.vertices), np.array(thick.faces))
    z = np.array([0.0, 0.0, 3.75])
    assert block.charts(start[:1] + z, goal[:1] - z).status.tolist() == [Status.DRAWN]

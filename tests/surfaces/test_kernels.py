"""Kernels beside numpy: the same strokes but for rounding, and the same refusals."""

import gc
import itertools
import weakref

import numpy as np
import pytest

from dmpcli import extras
from dmpcli.spatial import rotations
from dmpcli.surfaces import frame_smoothing
from dmpcli.surfaces.mesh import Mesh
from tests.extras_here import needs
from tests.surfaces import cases, fields, test_local_shape, zoo
from tests.surfaces.judge import Judge, traced
from tests.surfaces.test_borders import patch_with_hole, roll, unrolled_strokes
from tests.surfaces.test_slits import plate_with_fin

pytestmark = [needs(extras.FAST), pytest.mark.thorough]

# Of positions, mm, and axes, rad: what rounding comes to.
ALIKE = 1e-11


def both(mesh, start, goal, strokes, side=None):
    """Lift strokes, made of the lengths, with and without kernels."""
    found = []
    for one in (mesh, mesh.with_kernels):
        charts = one.charts(start, goal, side)
        found.append((charts, charts.lift(strokes(charts.lengths))))
    return found


def check_alike(found):
    """Hold both lifts against each other; return the statuses."""
    (charts, pure), (other, compiled) = found
    np.testing.assert_array_equal(compiled.status, pure.status)
    np.testing.assert_array_equal(compiled.unfolded, pure.unfolded)
    good = pure.status == 0
    np.testing.assert_array_equal(compiled.outside[good], pure.outside[good])
    np.testing.assert_allclose(other.lengths, charts.lengths, atol=ALIKE)
    np.testing.assert_allclose(compiled.position[good], pure.position[good], atol=ALIKE)
    np.testing.assert_allclose(compiled.axes[good], pure.axes[good], atol=ALIKE)
    return pure.status


def waves(lengths):
    return fields.strokes(lengths, 200, 1)


def low(lengths):
    return fields.strokes(lengths, 100, 1, 5.0)


@pytest.mark.parametrize("name", ["sphere", "saddle", "bumpy"])
def test_strokes_on_smooth_meshes_are_the_same_but_for_rounding(name):
    case = cases.case(name, 8, 100, 1)
    status = check_alike(both(cases.mesh(name, 5000), case.start, case.goal, waves))
    assert not status.any()


def test_strokes_that_leave_a_patch_or_cross_its_hole_are_told_alike():
    start, goal, _, coordinates, _ = unrolled_strokes(60, 20)
    mesh = patch_with_hole(20)
    found = [m.charts(roll(start), roll(goal)) for m in (mesh, mesh.with_kernels)]
    lifts = [(charts, charts.lift(coordinates)) for charts in found]
    status = check_alike(lifts)
    assert 10 < np.count_nonzero(status) < 50
    left = status == 5
    np.testing.assert_array_equal(lifts[1][1].outside[left], lifts[0][1].outside[left])


def test_strokes_over_the_foot_of_a_wall_are_told_alike():
    mesh, _, R = plate_with_fin(2, 6, (0.4, -0.9, 1.3))
    rng = np.random.default_rng(3)
    ends = np.concatenate([rng.uniform(-30.0, 30.0, (2, 40, 2)), np.zeros((2, 40, 1))], axis=2)
    status = check_alike(both(mesh, *(ends @ R.T), low, side=R[:, 2]))
    assert 0 < np.count_nonzero(status) < 40


@pytest.mark.parametrize("name", ["drilled", "ribbed", "ring", "heat_sink", "cone", "filleted"])
def test_strokes_over_the_edges_of_parts_are_the_same_and_refused_alike(name):
    mesh = zoo.mesh(name)
    pairs = traced(Judge(mesh), 20, np.random.default_rng(4))
    check_alike(both(mesh, pairs.start, pairs.goal, low))


def test_strokes_do_not_depend_on_those_beside_them_nor_on_what_was_drawn_before():
    case = cases.case("bumpy", 12, 60, 1)
    mesh = cases.mesh("bumpy", 5000)

    def lifted(rows, on):
        charts = on.charts(case.start[rows], case.goal[rows])
        return charts.lift(waves(charts.lengths))

    fresh = Mesh(mesh.V, mesh.F).with_kernels
    whole = lifted(np.arange(12), fresh)
    for rows in (np.array([7]), np.array([11, 2, 7])):
        for on in (fresh, Mesh(mesh.V, mesh.F).with_kernels):
            some = lifted(rows, on)
            assert some.position.tobytes() == whole.position[rows].tobytes()
            assert some.axes.tobytes() == whole.axes[rows].tobytes()


def test_closest_points_are_those_of_the_library_from_everywhere():
    from dmpcli.surfaces.kernels import tree

    rng = np.random.default_rng(0)
    for mesh in (cases.mesh("bumpy", 5000), zoo.mesh("drilled"), plate_with_fin(2, 6)[0]):
        spread = np.ptp(mesh.V, axis=0)
        points = mesh.V.min(axis=0) + rng.uniform(-0.3, 1.3, (500, 3)) * spread
        near = mesh.corners.mean(axis=1)[rng.integers(0, len(mesh.F), 500)]
        points = np.concatenate([points, near + rng.normal(0.0, 0.05, (500, 3))])
        foot, _ = mesh.search(points)
        found, face, _ = tree.search(mesh.facets, points)
        off = [np.linalg.norm(points - one, axis=1) for one in (foot, found)]
        np.testing.assert_allclose(off[1], off[0], atol=1e-12)
        corners = mesh.corners[face]
        assert ((corners.min(axis=1) - 1e-9 <= found) & (found <= corners.max(axis=1) + 1e-9)).all()


def test_samples_followed_from_facet_to_facet_stand_on_the_closest_point():
    from dmpcli.surfaces.kernels import samples, tree

    rng = np.random.default_rng(1)
    for mesh in (cases.mesh("bumpy", 5000), zoo.mesh("ribbed"), zoo.mesh("united")):
        middle = mesh.corners.mean(axis=1)
        nodes, offs = tree.stack()
        for face in rng.integers(0, len(mesh.F), 60):
            way = rng.normal(size=3)
            for k in range(8):
                point = middle[face] + 0.4 * k * way + rng.normal(0.0, 0.1, 3)
                row = int(mesh.for_kernels.rows[face])
                foot, _ = samples.followed(mesh.facets, tuple(point), row, nodes, offs)
                best, _ = mesh.search(point[None])
                assert np.linalg.norm(point - foot) <= np.linalg.norm(point - best[0]) + 1e-12


def test_frames_are_smoothed_as_without_kernels():
    case = cases.case("bumpy", 4, 300, 2)
    still = case.position.copy()
    still[1, 40:60] = still[1, 40:41]  # a pause
    pure, compiled = (
        frame_smoothing.smoothed(case.axes, still, compiled=means) for means in (False, True)
    )
    np.testing.assert_allclose(compiled, pure, atol=ALIKE)
    np.testing.assert_allclose(compiled[:, [0, -1]], case.axes[:, [0, -1]], atol=1e-12)


@pytest.mark.parametrize("frames", [1, 200])
def test_euler_angles_are_those_without_kernels_through_turns_and_singularities(frames):
    s = np.linspace(0.0, 1.0, 200)
    path = np.stack([3.0 + np.sin(6 * s), 1.2 * np.sin(5 * s), 9 * s], axis=-1)
    rng = np.random.default_rng(2)
    C = rotations.from_euler(rng.uniform(-3, 3, (20, 1, 3)) + np.zeros((frames, 3)))
    C[0], M = np.eye(3), rotations.from_euler(path)
    C[1] = rotations.from_euler(np.array([0.0, np.pi / 2, 0.0])) @ M[0].T  # singular at first
    for beside in (M[None], np.tile(M, (20, 1, 1, 1))):
        compiled = rotations.euler_of_paths(C, beside)
        pure = rotations.to_euler_continuous(C @ beside)
        np.testing.assert_allclose(compiled, pure, atol=1e-9)
        np.testing.assert_allclose(rotations.from_euler(compiled), C @ beside, atol=1e-9)


def test_a_kernels_arctangent_is_exact_to_rounding():
    from dmpcli.spatial.kernels import arctan2

    angle = np.linspace(-np.pi + 1e-6, np.pi, 4001)
    size = 10.0 ** np.linspace(-12, 12, 4001)
    for y, x in zip(size * np.sin(angle), size * np.cos(angle), strict=True):
        assert abs(arctan2(y, x) - np.arctan2(y, x)) <= 1e-15
    assert arctan2(0.0, 0.0) == 0.0
    assert arctan2(-1e-17, -1.0) == pytest.approx(np.pi)


def test_vertices_that_lie_on_one_another_are_marked_and_of_a_smooth_mesh_none():
    from dmpcli.surfaces.kernels.tree import FLAGS, SPLIT

    for mesh in (plate_with_fin(2, 6)[0], cases.mesh("saddle", 200)):
        apart = np.linalg.norm(mesh.V[:, None] - mesh.V, axis=2) + 9.0 * np.eye(len(mesh.V))
        twice = apart.min(axis=1) < 1e-9
        assert twice.any() == (len(mesh.slits) > 0)
        known = mesh.with_kernels
        split = known.facets.numbers[known.for_kernels.rows, FLAGS] & SPLIT > 0
        np.testing.assert_array_equal(split, twice[mesh.F].any(axis=1))


def region(far):
    """A sheet of 20,000 facets, one box on it, and strokes about one place or over all of it."""
    mesh = Mesh(*fields.square(cases.FIELDS["bumpy"], 20_000, reach=150.0))
    rng = np.random.default_rng(7)
    start = np.pad(rng.uniform(-40.0, 0.0, (6, 2)), ((0, 0), (0, 1)))
    goal = start + [[60.0, 10.0, 0.0]]
    goal[-1] += far
    return mesh, start, goal


@pytest.mark.parametrize("far", [0.0, [70.0, 60.0, 0.0]], ids=["as expected", "far beyond"])
def test_what_kernels_find_does_not_hang_on_how_much_of_the_shape_they_know(far):
    """Bit by bit; where a stroke leaves what was expected, the shape there is found too."""
    mesh, start, goal = region(np.zeros(3))
    mesh.expect(start, goal, 20.0)
    some = mesh.with_kernels
    _, start, goal = region(far)
    charts = some.charts(start, goal)
    found = charts.lift(waves(charts.lengths))
    left = some.for_kernels.unknown
    assert 0 < left < len(mesh.F)
    whole = Mesh(mesh.V, mesh.F).with_kernels
    assert whole.facets is whole.for_kernels.facets
    assert whole.for_kernels.unknown == 0
    others = whole.charts(start, goal)
    expected = others.lift(waves(others.lengths))
    assert not expected.status.any()
    for name in ("position", "axes", "status", "outside"):
        assert getattr(found, name).tobytes() == getattr(expected, name).tobytes(), name
    # Asked for all, it knows all, the same.
    from dmpcli.surfaces.kernels.tree import CLEARANCE

    np.testing.assert_array_equal(
        some.facets.reals[:, :CLEARANCE], whole.facets.reals[:, :CLEARANCE]
    )
    np.testing.assert_array_equal(some.facets.numbers, whole.facets.numbers)
    assert some.for_kernels.unknown == 0


def test_a_mesh_with_kernels_is_let_go_of_when_nobody_holds_it():
    mesh = region(np.zeros(3))[0]
    assert mesh.with_kernels.with_kernels is mesh.with_kernels
    gone = weakref.ref(mesh.with_kernels)
    assert len(mesh.with_kernels.facets.reals) == len(mesh.F)
    gc.disable()
    try:
        del mesh
        assert gone() is None
    finally:
        gc.enable()


def test_boxes_of_the_search_tree_hold_their_facets_and_little_more():
    mesh = region(np.zeros(3))[0].with_kernels
    facets = mesh.facets
    leaves = len(facets.first) - 1
    assert facets.boxes.dtype == np.float32
    corners = mesh.corners[mesh.tree_order.order]
    held = [corners[a:b].reshape(-1, 3) for a, b in itertools.pairwise(facets.first)]
    inner = {leaf + leaves - 1: at for leaf, at in enumerate(held)}
    for node in range(leaves - 2, -1, -1):
        inner[node] = np.concatenate([inner[2 * node + 1], inner[2 * node + 2]])
    low = np.array([inner[node].min(axis=0) for node in range(len(facets.boxes))])
    high = np.array([inner[node].max(axis=0) for node in range(len(facets.boxes))])
    assert (facets.boxes[:, :3].astype(float) <= low).all()
    assert (facets.boxes[:, 3:].astype(float) >= high).all()
    np.testing.assert_allclose(facets.boxes, np.hstack([low, high]), rtol=3e-7, atol=1e-30)


SHAPES = ("face_normals", "dihedrals", "vertex_normals", "corner_normals", "noise", "heights")
PARTS = {**test_local_shape.MESHES, "plate with a fin": lambda: plate_with_fin(2, 6)[0]}


@pytest.mark.parametrize("name", PARTS)
def test_the_shape_that_kernels_find_is_the_one_without_them(name):
    """With creases, tips, slivers, borders, edges of three faces, and noise on a half of it."""
    mesh = PARTS[name]()
    plain, compiled = mesh.shape, mesh.with_kernels.shape
    assert type(plain) is not type(compiled)
    for what in (*SHAPES, "reach"):
        found, wanted = getattr(compiled, what), getattr(plain, what)
        np.testing.assert_allclose(found, wanted, rtol=1e-13, atol=1e-15, err_msg=what)
    assert ("rough" in name) == bool(compiled.noise.any())


@pytest.mark.parametrize("tilt", [10.0, 40.0])
def test_tips_of_cones_and_facets_that_normals_lean_off_are_so_with_kernels_too(tilt):
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(12)])
    V = np.vstack([rim, [[0.0, 0.0, np.tan(np.radians(tilt))]]])
    mesh = Mesh(V, np.column_stack([np.arange(12), (np.arange(12) + 1) % 12, np.full(12, 12)]))
    plain, compiled = mesh.shape.corner_normals, mesh.with_kernels.shape.corner_normals
    np.testing.assert_allclose(compiled, plain, rtol=1e-13, atol=1e-15)
    # At the tip the facets' own: an axis leans off them by the cone's angle.
    lean = np.degrees(np.arccos(compiled[:, 2, 2]))
    np.testing.assert_allclose(lean, np.degrees(np.arccos(mesh.face_normals[:, 2])), atol=15.0)

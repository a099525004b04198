"""Sheets that touch: each is drawn on for itself, and no stroke crosses their edge."""

import numpy as np
import pytest

from dmpcli.spatial import rotations
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.mesh_repair import mended
from dmpcli.surfaces.surface import Status
from tests.records.meshes import box, grid


def plate_with_fin(first, last, turn=(0.0, 0.0, 0.0)):
    """A plate of 80 mm with a wall on x = 0 from vertex `first` to `last` of its middle line."""
    V, F = grid(9, 40.0, height=lambda x, y: 0 * x)
    foot = np.flatnonzero(np.abs(V[:, 0]) < 1e-9)[first : last + 1]
    n, top = len(foot) - 1, len(V) + np.arange(len(foot))
    fin = [[foot[i], foot[i + 1], top[i]] for i in range(n)]
    fin += [[foot[i + 1], top[i + 1], top[i]] for i in range(n)]
    R = rotations.exp(np.array(turn))
    found = mended(np.concatenate([V, V[foot] + [0, 0, 10.0]]) @ R.T, np.concatenate([F, fin]))
    return Mesh(found.V, found.F), found, R


def straight(mesh, start, goal, side):
    charts = mesh.charts(start, goal, side=side)
    coordinates = np.zeros((len(start), 300, 3))
    coordinates[..., 0] = charts.lengths[:, None] * np.linspace(0.0, 1.0, 300)
    return charts.lift(coordinates)


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, -0.9, 1.3)])
@pytest.mark.parametrize(("first", "last"), [(2, 3), (2, 6), (0, 4)])
def test_only_strokes_that_cross_the_foot_of_a_wall_are_refused(first, last, turn):
    mesh, found, R = plate_with_fin(first, last, turn)
    assert f"{last - first} edge{'s' if last - first > 1 else ''} of three" in found.remarks[0]
    ends = -40.0 + 10.0 * np.array([first, last])
    rng = np.random.default_rng(4)
    start, goal = np.zeros((2, 200, 3))
    start[:, :2], goal[:, :2] = rng.uniform(-38, 38, (2, 200, 2))
    share = start[:, 0] / np.where(start[:, 0] == goal[:, 0], 1.0, start[:, 0] - goal[:, 0])
    y = start[:, 1] + share * (goal[:, 1] - start[:, 1])
    across = start[:, 0] * goal[:, 0] < 0.0
    clear = (np.abs(y[:, None] - ends) > 0.5).all(axis=1) | ~across
    crosses = across & (ends[0] < y) & (y < ends[1])
    assert (crosses & clear).sum() > 5
    lift = straight(mesh, start @ R.T, goal @ R.T, R[:, 2])
    drawn = lift.status == Status.DRAWN
    assert drawn[clear & ~crosses].all()
    assert (lift.status[clear & crosses] == Status.BORDER).all()


@pytest.mark.parametrize("samples", [100, 101])
def test_a_stroke_with_a_sample_on_the_edge_is_refused_as_well(samples):
    mesh, _, _ = plate_with_fin(2, 6)
    charts = mesh.charts(np.array([[-20.0, 0, 0]]), np.array([[20.0, 0, 0]]), side=np.eye(3)[2])
    coordinates = np.zeros((1, samples, 3))
    coordinates[..., 0] = np.linspace(0.0, 40.0, samples)
    assert charts.lift(coordinates).status.tolist() == [Status.BORDER]


def test_a_wall_from_rim_to_rim_parts_the_plate():
    mesh, found, _ = plate_with_fin(0, 8)
    assert int(mesh.components.max()) + 1 == 3
    start, goal = np.array([[-20.0, 3, 0], [-30, -9, 0]]), np.array([[20.0, 4, 0], [-5, 30, 0]])
    lift = straight(mesh, start, goal, np.array([0.0, 0, 1]))
    assert lift.status.tolist() == [Status.OTHER_COMPONENT, Status.DRAWN]
    assert len(found.F) == 128 + 16, "no face was cut"


def two_boxes():
    """Two boxes of 30 x 20 x 10 mm that share the edge x = 15, z = 5; one is inside out."""
    V, F = box()
    return np.concatenate([V, V + [30.0, 0.0, 10.0]]), np.concatenate([F, F[:, ::-1] + len(V)])


@pytest.mark.slow
def test_solids_that_share_an_edge_are_each_closed_and_drawn_on():
    found = mended(*two_boxes())
    mesh = Mesh(found.V, found.F)
    assert sorted(mesh.outward.tolist()) == [-1.0, 1.0], "each as it was wound"
    assert len(mesh.slits) == 2, "the halves of one edge"
    start = np.array([[-10.0, 5, 5], [-10, 5, 5], [20, -5, 15], [20, -5, 15.0]])
    goal = np.array([[10.0, -5, 5], [20, -5, 15], [40, 5, 15], [15, 5, 10.0]])
    lift = straight(mesh, start, goal, np.array([-0.3, 0.0, 1.0]))
    assert lift.status[:3].tolist() == [Status.DRAWN, Status.OTHER_COMPONENT, Status.DRAWN]
    # Round the edges that nothing touches, from the top to the end.
    charts = mesh.charts(np.array([[-10.0, 0, 5]]), np.array([[-15.0, 3, 0]]))
    assert charts.status.tolist() == [Status.DRAWN]
    # Round the shared one, from the top to the other end: 12 mm that cross it.
    around = mesh.charts(np.array([[10.0, 0, 5]]), np.array([[15.0, 3, 0]]))
    assert around.status.tolist() != [Status.DRAWN]


def test_a_mesh_without_such_edges_has_none():
    V, F = grid()
    assert len(Mesh(V, F).slits) == 0
    assert len(Mesh(*box()).slits) == 0
    bow = np.array([[0, 0, 0], [9, 3, 0], [9, -3, 0], [-9, 3, 0], [-9, -3, 0]], dtype=float)
    found = mended(bow, np.array([[0, 2, 1], [0, 3, 4]]))
    assert len(Mesh(found.V, found.F).slits) == 0

"""The search over all headings, against exact distances and a fan of lines that are not ours."""

import igl
import numpy as np
import pytest

from dmpcli.surfaces import geodesic_search
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.surface import Status
from tests.records.meshes import box
from tests.surfaces import fields, zoo
from tests.surfaces.judge import Judge, traced
from tests.surfaces.test_borders import plate


def between(mesh, count, seed):
    """Random vertices of a mesh as origins and goals, and exact distances."""
    pairs = np.random.default_rng(seed).permutation(len(mesh.V))[: 2 * count].reshape(2, -1)
    none = np.empty(0, dtype=np.int64)
    exact = [
        igl.exact_geodesic(mesh.V, mesh.F, np.array([a]), none, np.array([b]), none)[0]
        for a, b in pairs.T
    ]
    return mesh.V[pairs[0]], mesh.V[pairs[1]], np.array(exact)


def test_on_convex_solids_it_finds_the_shortest_way():
    # There the shortest way passes no corner, so that it is a straight line.
    ball, bumps = fields.grid(
        lambda a, b: 30.0 * np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)], -1),
        14, 20, (0.3, 2.8), (0.0, 2.0),
    )  # fmt: skip
    rng = np.random.default_rng(0)
    mesh = Mesh(*box((60.0, 40.0, 25.0)))
    face = rng.integers(len(mesh.F), size=(2, 40))
    ends = np.einsum("pni,pnij->pnj", rng.dirichlet([1, 1, 1], (2, 40)), mesh.corners[face])
    _, length, found = geodesic_search.find(mesh, *ends)
    assert found.all()
    # The box with the ends as vertices of their own.
    for a, b, size, fa, fb in zip(*ends, length, *face, strict=True):
        if fa == fb:
            assert size == pytest.approx(np.linalg.norm(b - a), abs=1e-4)
            continue
        V = np.concatenate([mesh.V, [a, b]])
        F = [f for k, f in enumerate(mesh.F.tolist()) if k not in (fa, fb)]
        for k, f in ((len(mesh.V), mesh.F[fa]), (len(mesh.V) + 1, mesh.F[fb])):
            F += [[f[i], f[(i + 1) % 3], k] for i in range(3)]
        none, k = np.empty(0, dtype=np.int64), len(mesh.V)
        exact = igl.exact_geodesic(V, np.array(F), np.array([k]), none, np.array([k + 1]), none)
        assert size == pytest.approx(float(exact[0]), abs=1e-4)
    mesh = Mesh(ball, bumps)
    start, goal, exact = between(mesh, 20, 1)
    _, length, found = geodesic_search.find(mesh, start, goal)
    assert found.mean() > 0.9  # the patch has borders, at which shortest ways may bend
    np.testing.assert_allclose(length[found], exact[found], rtol=1e-4, atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["heat_sink", "funnel", "united", "half_round"])
def test_what_was_traced_is_found_again_and_no_longer(name):
    judge = Judge(zoo.mesh(name))
    pairs = traced(judge, 40, np.random.default_rng(5), (5.0, 60.0))
    direction, length, found = geodesic_search.find(judge.mesh, pairs.start, pairs.goal)
    assert found.all()
    assert (length <= pairs.length + 1e-4).all()
    for row in zip(pairs.face, pairs.start, direction, length, pairs.goal, strict=True):
        *line, goal = row
        assert np.linalg.norm(judge.line(*line)[-1] - goal) <= 1e-4


def test_what_is_not_found_no_line_of_a_fine_fan_comes_near():
    # A sheet with a slot right across but for a bridge at one end, where every way bends.
    V, F = fields.grid(lambda x, y: np.stack([x, y, 0.0 * x], -1), 21, 21, (-50, 50), (-50, 50))
    middle = V[F].mean(axis=1)
    used, F = np.unique(
        F[~((np.abs(middle[:, 0]) < 5.0) & (middle[:, 1] > -35.0))], return_inverse=True
    )
    mesh = Mesh(V[used], F.reshape(-1, 3))
    start, goal = np.array([[-20.0, 31.0, 0.0]]), np.array([[22.0, 30.0, 0.0]])
    assert not geodesic_search.find(mesh, start, goal)[2].any()
    charts = mesh.charts(start, goal)
    straight = fields.strokes(charts.lengths, 100, height=0.0)
    assert charts.lift(straight).status[0] == Status.BORDER  # as if the slot were filled
    judge = Judge(mesh)
    face = mesh.search(start)[1][0]
    for angle in np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False):
        line = judge.line(face, start[0], np.array([np.cos(angle), np.sin(angle), 0.0]), 250.0)
        assert np.linalg.norm(line - goal, axis=1).min() > 3.0


@pytest.mark.slow
def test_the_way_round_a_plate_is_as_long_as_on_paper():
    mesh = Mesh(*plate(0.8))
    top, under = np.array([[-40.0, 5.0, 0.0]]), np.array([[40.0, 5.0, -0.8]])
    _, length, found = geodesic_search.find(mesh, top, under)
    assert found[0]
    # Over the long side at y = 80, unfolded: 80 along, 75 + 0.8 + 75 across.
    assert length[0] == pytest.approx(np.hypot(80.0, 150.8), abs=1e-4)
    # It is not what was asked for: the other side of the plate is much nearer.
    up = np.array([0.0, 0.0, 1.0])
    assert mesh.charts(top, under, up).status[0] == Status.OTHER_SIDE


def test_a_thick_plate_is_gone_round():
    mesh = Mesh(*plate(8.0))
    top, under = np.array([[85.0, 5.0, 0.0]]), np.array([[85.0, 9.0, -8.0]])
    charts = mesh.charts(top, under, np.array([0.0, 0.0, 1.0]))
    assert charts.status[0] == Status.DRAWN
    assert charts.lengths[0] == pytest.approx(np.hypot(38.0, 4.0), abs=1e-6)

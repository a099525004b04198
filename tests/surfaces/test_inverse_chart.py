"""Charts inverted: what `lift` drew is found again, on, over and under every kind of surface."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.surfaces import inverse_chart
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.inverse_chart import invert
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere
from dmpcli.surfaces.surface import Status
from dmpcli.surfaces.tangential import Sought
from tests.surfaces import cases, fields

S = np.linspace(0.0, 1.0, 200)
HEIGHT = 8.0 * np.sin(9.0 * S)


@pytest.fixture(scope="module")
def meshes():
    return {name: cases.mesh(name, 8_000) for name in ("saddle", "bumpy")}


def laid(surface, headings=2):
    """Charts of pairs about the middle, 109 mm apart or so."""
    angle = np.arange(headings) * 2.0 + 0.3
    half = 54.0 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    top = np.array([0.0, 0.0, 5.0])
    start, goal = surface.closest(top - half), surface.closest(top + half)
    return surface.charts(start.position, goal.position)


def swung(charts, beyond=0.0, height=HEIGHT, wide=25.0):
    """Coordinates of waves that swing beyond both ends."""
    u = charts.lengths[:, None] * S - beyond * np.sin(2 * np.pi * S)
    v = np.broadcast_to(wide * np.sin(4 * np.pi * S), u.shape)
    return np.stack([u, v, np.broadcast_to(height, u.shape)], axis=-1)


def assert_found(charts, wanted, exactly=2e-6, like=2e-6):
    drawn = charts.lift(wanted)
    assert not drawn.status.any()
    found = invert(charts, drawn.position)
    assert found.complete.all()
    assert not found.status.any()
    again = charts.lift(found.coordinates)
    assert np.abs(again.position - drawn.position).max() < exactly
    miss = np.linalg.norm(again.position - drawn.position, axis=2)
    np.testing.assert_allclose(found.miss, miss, atol=1e-12)
    np.testing.assert_array_equal(found.axes, again.axes)
    np.testing.assert_allclose(found.coordinates, wanted, atol=like)


EXACT = {
    "plane": Plane(np.array([1.0, 2.0, 3.0]), np.array([0.6, 0.0, 0.8])),
    "cylinder": cases.EXACT["cylinder"],
    "sphere": cases.EXACT["sphere"],
}


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("height", [0.0, HEIGHT, -30.0, 30.0])
def test_what_an_exact_chart_drew_is_found_again(name, height):
    charts = laid(EXACT[name])
    assert_found(charts, swung(charts, 20.0, height))


@pytest.mark.sweep(kept=3)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["saddle", "bumpy"])
@pytest.mark.parametrize("height", [0.0, 0.3, HEIGHT, -HEIGHT])
def test_what_a_mesh_s_chart_drew_is_found_again(meshes, name, height):
    charts = laid(meshes[name])
    assert_found(charts, swung(charts, 10.0, height))


@pytest.mark.parametrize("name", [*EXACT, "saddle", "bumpy"])
def test_closed_strokes_are_found_again(meshes, name):
    surface = EXACT.get(name) or meshes[name]
    at = surface.closest(np.array([[5.0, -4.0, 3.0]])).position
    charts = surface.charts(at, at, closed=np.eye(3))
    loop = np.stack([30 * np.sin(2 * np.pi * S), 20 - 20 * np.cos(2 * np.pi * S), HEIGHT], axis=-1)
    assert_found(charts, loop[None], like=1e-5)


@settings(max_examples=20)
@given(seed=st.integers(0, 10_000))
def test_single_samples_anywhere_are_found_again_on_a_cylinder(seed):
    rng = np.random.default_rng(seed)
    charts = laid(EXACT["cylinder"], 1)
    # Less than half a turn away, outside and inside.
    wanted = rng.uniform([-20.0, -60.0, -50.0], [120.0, 60.0, 50.0], size=(1, 3))
    assert_found(charts, wanted[None])


def test_the_inside_of_a_pipe_counts_w_towards_its_axis():
    pipe = Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), 30.0)
    start, goal = np.array([[0.0, -50.0, -30.0]]), np.array([[10.0, 50.0, -28.3]])
    charts = pipe.charts(start, goal)  # the tool is over the pipe's floor
    wanted = swung(charts, height=10.0 + HEIGHT)
    assert_found(charts, wanted)
    away = pipe.closest(charts.lift(wanted).position)
    np.testing.assert_allclose(away.distance[0], 10.0 + HEIGHT, atol=1e-9)


@pytest.mark.parametrize("turns", [1.5, -3.0])
def test_turns_about_a_part_are_counted_along_the_stroke(turns):
    pole = EXACT["cylinder"]
    start, goal = np.array([[60.0, -50.0, -60.0]]), np.array([[60.0, 50.0, -60.0]])
    charts = pole.charts(start, goal, side=np.array([1.0, 0.0, 0.0]))
    spiral = np.stack([100.0 * S, turns * 2 * np.pi * 60.0 * S, HEIGHT], axis=-1)
    assert_found(charts, spiral[None], 1e-5, 1e-5)


def test_turns_along_the_stroke_s_own_way_are_counted_too():
    pole = EXACT["cylinder"]
    start, goal = np.array([[60.0, 0.0, -60.0]]), np.array([[0.0, 0.0, 0.0]])
    charts = pole.charts(start, goal, side=np.array([1.0, 0.0, 0.0]))
    twice = np.stack([4 * np.pi * 60.0 * S, 20.0 * np.sin(9 * S), 0.0 * S], axis=-1)
    assert_found(charts, twice[None])


def test_a_sphere_is_reached_nearly_to_the_pole_and_around():
    charts = EXACT["sphere"].charts(
        np.array([[150.0, 0.0, -150.0]]), np.array([[0.0, 150.0, -150.0]]), np.array([1.0, 0, 0])
    )
    assert_found(charts, swung(charts, wide=150.0 * np.radians(80.0)))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cylinder", "bumpy"])
def test_a_stroke_does_not_depend_on_those_beside_it(meshes, name):
    charts = laid(EXACT.get(name) or meshes[name], 3)
    position = charts.lift(swung(charts, 10.0)).position
    position[1] += [0.0, 0.0, 2.0]
    together = invert(charts, position)
    for i in range(3):
        row = np.array([i])
        alone = invert(charts.rows(row), position[row])
        np.testing.assert_array_equal(alone.coordinates[0], together.coordinates[i])


@pytest.mark.slow
def test_samples_beyond_the_border_are_told_and_spoil_no_other(meshes):
    charts = laid(meshes["bumpy"])
    wanted = swung(charts)
    position = charts.lift(wanted).position
    position[0, 90:100] += [200.0, 200.0, 0.0]
    found = invert(charts, position)
    lost = np.zeros(position.shape[:2], dtype=bool)
    lost[0, 90:100] = True
    np.testing.assert_array_equal(found.reached, ~lost)
    np.testing.assert_array_equal(found.status, [Status.BORDER, Status.DRAWN])
    assert np.isnan(found.coordinates[lost]).all()
    np.testing.assert_allclose(found.coordinates[~lost], wanted[~lost], atol=0.03)


def test_a_pair_without_a_chart_is_told_by_its_status():
    ball = EXACT["sphere"]
    start = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    goal = np.array([[0.0, 0.0, -300.0], [50.0, 0.0, 0.0]])
    charts = ball.charts(start, goal)
    found = invert(charts, np.broadcast_to(start[:, None] + [3.0, 4.0, 0.0], (2, 5, 3)))
    np.testing.assert_array_equal(found.status, [Status.OPPOSITE, Status.DRAWN])
    assert not found.reached[0].any()
    assert found.reached[1].all()


def test_beyond_the_centre_of_curvature_feet_are_not_told_apart():
    pipe = Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), 30.0)
    charts = pipe.charts(np.array([[0.0, -50.0, -30.0]]), np.array([[0.0, 50.0, -30.0]]))
    axis = np.stack([0.0 * S, 100.0 * S - 50.0, 0.0 * S], axis=-1)
    assert not invert(charts, axis[None]).reached.any()


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["saddle", "bumpy"])
def test_feet_are_those_of_the_true_surface_up_to_the_mesh(name):
    """The oracle walks geodesics of the field by Runge and Kutta, and knows no mesh."""
    case, field = cases.case(name, headings=2, samples=100), cases.FIELDS[name]
    mesh = cases.mesh(name, 50_000)
    charts = mesh.charts(case.start, case.goal)
    w = 8.0 * np.sin(np.linspace(0.0, 9.0, 100))[:, None]
    found = invert(charts, case.position + w * case.axes[..., 2])
    assert found.complete.all()
    scale = (charts.lengths / cases.LENGTH)[:, None]
    error = np.hypot(
        found.coordinates[..., 0] - scale * case.coordinates[..., 0],
        found.coordinates[..., 1] - case.coordinates[..., 1],
    )
    off = cases.largest_error(name, mesh)
    assert error.max() < 10.0 * off
    assert np.abs(found.coordinates[..., 2] - w[:, 0]).max() < 2.0 * off
    assert fields.smallest_radius(field) > 25.0


def test_a_sphere_off_its_centre_is_exact():
    ball = Sphere(np.array([10.0, 20.0, 30.0]), 40.0)
    charts = ball.charts(np.array([[50.0, 20.0, 30.0]]), np.array([[10.0, 60.0, 30.0]]))
    [[(u, v, w)]] = invert(charts, np.array([[[10.0 + 45 * np.sqrt(0.5)] * 1 + [
        20.0 + 45 * np.sqrt(0.5), 30.0]]])).coordinates  # fmt: skip
    assert u == pytest.approx(40.0 * np.pi / 4, abs=1e-6)
    assert v == pytest.approx(0.0, abs=1e-6)
    assert w == pytest.approx(5.0, abs=1e-6)


def test_neighbours_are_of_other_turns_beyond_five_times_their_way_and_ten_millimetres():
    coordinates, position = np.zeros((4, 3, 3)), np.zeros((4, 3, 3))
    coordinates[0, 1:, 0] = 10.0
    coordinates[1, 2:, 1] = 10.01
    coordinates[2, 1:, 0], position[2, 1:, 2] = 19.9, 2.0
    coordinates[3, 1:, 2] = 50.0
    assert inverse_chart._jumps(coordinates, position).tolist() == [False, True, False, False]


def test_what_is_not_good_is_put_between_good_neighbours_each_stroke_by_itself():
    at = np.arange(24.0).reshape(3, 4, 2) ** 2
    good = np.array([[1, 0, 0, 1], [0, 0, 0, 0], [0, 1, 1, 0]], dtype=bool)
    found = inverse_chart._between(at, good)
    np.testing.assert_allclose(found[0], np.linspace(at[0, 0], at[0, 3], 4))
    assert not found[1].any()
    np.testing.assert_array_equal(found[2], at[2, [1, 1, 2, 2]])
    np.testing.assert_array_equal(inverse_chart._between(at, np.ones((3, 4), dtype=bool)), at)


def test_what_is_reached_is_told_by_truth_values():
    """So that `~` turns it over."""
    start = np.zeros((2, 3))
    charts = EXACT["sphere"].charts(start, np.array([[0.0, 0.0, -300.0], [50.0, 0.0, 0.0]]))
    found = invert(charts, np.zeros((2, 5, 3)))
    assert found.reached.dtype == bool
    assert (~found.reached).sum() == 5
    assert found.complete.tolist() == [False, True]


@pytest.mark.parametrize("whole", [True, False])
def test_a_piece_is_carried_on_to_another_turn_as_a_whole_or_left(monkeypatch, whole):
    class One:
        def rows(self, _):
            return self

    def solved(_charts, _position, at, free):
        good = free.copy()
        good[0, 7] = whole
        return Sought(at, np.zeros((1, 10)), np.ones((1, 10)), good)

    monkeypatch.setattr(inverse_chart, "solved", solved)
    s = np.arange(10.0)
    at = np.stack([s + 100.0 * (s >= 5.0), 0.0 * s], axis=-1)[None]
    found = Sought(at.copy(), np.zeros((1, 10)), np.ones((1, 10)), np.ones((1, 10), dtype=bool))
    carried = inverse_chart._counted_on(One(), s[None, :, None] * [1.0, 0.0, 0.0], found)
    # From where the sample before the piece lies.
    wanted = np.where(s >= 5.0, s - 1.0, s) if whole else at[0, :, 0]
    np.testing.assert_array_equal(carried.at[0, :, 0], wanted)

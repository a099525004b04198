from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.admittance.normal_estimation import NormalEstimator, carried, turned
from dmpcli.spatial.rotations import exp, smallest_between

PERIOD = 0.02
UP = np.array([0.0, 0.0, 1.0])


def angle(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


def slid(normal, mu, path, seed=0, noise=0.05, push=5.0, knocks=0):
    """An estimator that has slid along a path, shape (n, 2) in mm, of a surface through 0."""
    rng = np.random.default_rng(seed)
    height = -(path @ normal[:2]) / normal[2]
    position = np.column_stack([path, height])
    velocity = np.gradient(position, PERIOD, axis=0)
    estimator, found = NormalEstimator(PERIOD), []
    for i, v in enumerate(velocity):
        speed = np.linalg.norm(v)
        rub = mu * v / speed if speed > 0 else 0.0
        force = push * (normal - rub) + noise * rng.standard_normal(3)
        if knocks and i % knocks == 0:
            force = force + [6.0, -4.0, 0.0]
        estimator.feel(force, v + 0.3 * rng.standard_normal(3), UP)
        found.append(estimator.normal)
    return estimator, np.array(found)


T = np.arange(0.0, 10.0, PERIOD)
WAVE = np.column_stack([-10.0 * T, 25.0 * np.sin(2 * np.pi * T / 10.0)])
LINE = np.column_stack([-15.0 * T, 0.0 * T])


@pytest.mark.sweep(kept=4)
@pytest.mark.slow
@pytest.mark.parametrize("path", [WAVE, LINE], ids=["wave", "line"])
@pytest.mark.parametrize("tilt", [0.0, 3.0, 5.0])
@pytest.mark.parametrize("about", [0.0, 90.0, 200.0])
def test_tilt_and_friction_of_a_plane_are_found(path, tilt, about):
    axis = np.array([np.cos(np.radians(about)), np.sin(np.radians(about)), 0.0])
    normal = exp(np.radians(tilt) * axis) @ UP
    estimator, found = slid(normal, 0.2, path)
    off = [angle(one, normal) for one in found[50:]]
    assert np.mean(off) < 0.5
    assert max(off) < 1.2
    assert estimator.friction == pytest.approx(0.2, abs=0.03)
    assert np.degrees(estimator.angle) == pytest.approx(tilt, abs=1.0)


@pytest.mark.parametrize("mu", [0.0, 0.4])
def test_friction_that_is_other_than_usual_is_found(mu):
    estimator, found = slid(UP, mu, WAVE)
    assert estimator.friction == pytest.approx(mu, abs=0.03)
    # Taken as a tilt, that friction would lean the normal by 22°.
    assert max(angle(one, UP) for one in found[50:]) < 1.2


def test_knocks_count_less():
    estimator, found = slid(UP, 0.2, WAVE, knocks=25)
    assert max(angle(one, UP) for one in found[100:]) < 3.0
    assert estimator.friction == pytest.approx(0.2, abs=0.05)


def test_a_tool_that_stands_or_is_lifted_tells_nothing():
    estimator = NormalEstimator(PERIOD)
    assert not estimator.feel(np.array([0.0, 0.0, 5.0]), np.array([1.0, 0.0, 0.0]), UP)
    assert not estimator.feel(np.array([1.0, 0.0, -0.1]), np.array([20.0, 0.0, 0.0]), UP)
    np.testing.assert_allclose(estimator.normal, UP)
    with pytest.raises(ValueError, match="nothing is known"):
        NormalEstimator(PERIOD).normal  # noqa: B018
    assert estimator.heard == 0


def test_the_tilt_goes_along_with_a_planned_normal_that_turns():
    """Round a cylinder of the plan, 4° off it all the way about the cylinder's axis."""
    estimator, off = NormalEstimator(PERIOD), []
    lean = np.radians(4.0)
    for phi in np.linspace(0.0, 0.8, 400):
        planned = np.array([np.sin(phi), 0.0, np.cos(phi)])
        true = np.array([np.sin(phi + lean), 0.0, np.cos(phi + lean)])
        slide = np.array([np.cos(phi + lean), 0.0, -np.sin(phi + lean)])
        estimator.feel(5.0 * (true - 0.2 * slide), 15.0 * slide, planned)
        off.append(angle(estimator.normal, true))
    assert max(off[50:]) < 0.5


def test_a_lean_is_carried_with_the_planned_normal_round_a_cylinder():
    lean, way = np.radians(5.0), np.linspace(0.0, 1.2, 60)

    def round_(phi):
        return np.array([np.sin(phi), 0.0, np.cos(phi)])

    for axis in (np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])):
        made = tuple(exp(lean * axis) @ UP)
        for before, now in pairwise(way):
            made = carried(made, round_(before), round_(now))
        assert np.linalg.norm(made) == pytest.approx(1.0)
        turn = exp(way[-1] * np.array([0.0, 1.0, 0.0]))
        np.testing.assert_allclose(made, turn @ exp(lean * axis) @ UP, atol=1e-9)
    np.testing.assert_array_equal(carried(UP, UP, round_(0.3)), round_(0.3))


unit = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array).filter(lambda v: v @ v > 0.01)


@settings(max_examples=50)
@given(unit, unit, unit, st.floats(0.01, 0.5), st.floats(0.001, 0.2))
def test_a_normal_that_is_used_stays_within_its_bounds(a, b, c, most, step):
    now, wanted, planned = (v / np.linalg.norm(v) for v in (a, b, c))
    made = turned(now, wanted, planned, most, step)
    assert np.linalg.norm(made) == pytest.approx(1.0)
    assert np.radians(angle(made, now)) <= step + 1e-6
    again = turned(made, wanted, planned, most, step)
    inside = turned(planned, wanted, planned, most, np.pi)
    assert np.radians(angle(inside, planned)) <= most + 1e-6
    assert angle(again, inside) <= angle(made, inside) + 1e-6


def test_planned_normals_that_point_anywhere_have_axes():
    for n in (UP, -UP, np.array([1.0, 0.0, 0.0]), np.array([0.6, -0.8, 0.0])):
        estimator = NormalEstimator(PERIOD)
        R = smallest_between(UP, n) if n[2] > -1 else np.diag([1.0, -1.0, -1.0])
        for _ in range(100):
            estimator.feel(R @ [-1.0, 0.0, 5.0], R @ [20.0, 0.0, 0.0], n)
        assert angle(estimator.normal, n) < 0.5


class Textbook:
    """The filter of the note as matrices: a walk of three unknowns, three equations a cycle.

    By a planned normal along z the tangents are x and y. An equation that is missed by more than
    three deviations counts as one of so much larger variance.
    """

    def __init__(self, friction=0.2):
        self.x = np.array([0.0, 0.0, friction])
        self.P = np.diag([0.1**2, 0.1**2, 0.15**2])
        self.Q = np.diag([0.05**2, 0.05**2, 0.02**2]) * PERIOD

    def feel(self, force, velocity):
        speed = np.hypot(*velocity[:2])
        s, push = velocity[:2] / speed, force[2]
        self.P = self.P + self.Q
        by_force = (0.1 / push) ** 2 + 0.01**2
        by_motion = (0.5 / speed) ** 2 + 0.01**2
        for h, value, variance in (
            ([1.0, 0.0, -s[0]], force[0] / push, by_force),
            ([0.0, 1.0, -s[1]], force[1] / push, by_force),
            ([s[0], s[1], 0.0], -velocity[2] / speed, by_motion),
        ):
            h = np.array(h)
            known, off = h @ self.P @ h, value - h @ self.x
            far = max(abs(off) / (3.0 * np.sqrt(known + variance)), 1.0)
            gain = self.P @ h / (known + far**2 * variance)
            self.x = self.x + gain * off
            self.P = self.P - np.outer(gain, h @ self.P)
        self.x[2] = np.clip(self.x[2], 0.0, 1.0)

    @property
    def normal(self):
        made = np.array([self.x[0], self.x[1], 1.0])
        return made / np.linalg.norm(made)


@pytest.mark.slow
@settings(max_examples=40)
@given(st.integers(0, 10_000), st.sampled_from([0.05, 3.0]))
def test_it_is_the_textbooks_filter_of_the_three_equations(seed, noise):
    rng = np.random.default_rng(seed)
    friction = rng.uniform(0.0, 0.9)
    estimator, oracle = NormalEstimator(PERIOD, friction), Textbook(friction)
    for _ in range(25):
        force = rng.standard_normal(3) * noise + [0.5, -0.3, 5.0]
        velocity = rng.standard_normal(3) * [9.0, 9.0, 1.0]
        if force[2] <= 0.0 or np.hypot(*velocity[:2]) < 2.0:
            assert not estimator.feel(force, velocity, UP)
            continue
        assert estimator.feel(force, velocity, UP)
        oracle.feel(force, velocity)
        np.testing.assert_allclose(estimator.normal, oracle.normal, atol=1e-9)
        assert estimator.friction == pytest.approx(oracle.x[2], abs=1e-9)
        assert estimator.angle == pytest.approx(np.arccos(min(oracle.normal[2], 1.0)), abs=1e-6)
    np.testing.assert_allclose(
        np.array(estimator._P), oracle.P[np.triu_indices(3)], rtol=1e-9, atol=1e-15
    )


def test_nothing_is_known_of_friction_but_its_usual_size():
    assert NormalEstimator(PERIOD).friction == 0.2
    plain, told = NormalEstimator(PERIOD), NormalEstimator(PERIOD, 0.2)
    for one in (plain, told):
        one.feel(np.array([0.0, 0.0, 5.0]), np.array([20.0, 0.0, 0.0]), UP)
    np.testing.assert_array_equal(plain.normal, told.normal)


def test_two_millimetres_in_a_second_tell_something_and_less_does_not():
    estimator = NormalEstimator(PERIOD)
    push = np.array([0.0, 0.0, 5.0])
    assert not estimator.feel(push, np.array([1.96875, 0.0, 0.0]), UP)
    assert estimator.feel(push, np.array([0.0, 2.0, 0.0]), UP)
    assert not estimator.feel(0.0 * push, np.array([0.0, 2.0, 0.0]), UP)
    assert estimator.heard == 1


def test_a_lean_towards_nowhere_is_the_planned_normal_at_the_other_place():
    planned = np.array([0.6, 0.0, 0.8])
    np.testing.assert_array_equal(carried(UP, UP, planned), planned)
    # One that leans along the way keeps its angle, and so does one that leans across it.
    for axis in (np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])):
        made = carried(exp(0.2 * axis) @ UP, UP, planned)
        assert angle(made, planned) == pytest.approx(np.degrees(0.2), abs=1e-9)


def test_a_normal_turns_by_the_whole_step_towards_the_nearest_one_within_the_bound():
    wanted = exp(np.array([0.5, 0.0, 0.0])) @ UP
    made = turned(UP, wanted, UP, 0.3, 0.1)
    np.testing.assert_allclose(made, exp(np.array([0.1, 0.0, 0.0])) @ UP, atol=1e-12)
    made = turned(UP, wanted, UP, 0.3, 0.4)
    np.testing.assert_allclose(made, exp(np.array([0.3, 0.0, 0.0])) @ UP, atol=1e-12)
    np.testing.assert_allclose(turned(UP, wanted, UP, 0.6, 0.6), wanted, atol=1e-12)
    np.testing.assert_array_equal(turned(UP, UP, UP, 0.3, 0.1), UP)

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.admittance.model import (
    AdmittanceLaw,
    Bounds,
    DragState,
    brake,
    check_stable,
    move,
)
from dmpcli.errors import InputError
from dmpcli.spatial.rotations import exp, from_euler, log

PEN_DOWN = from_euler(np.array([np.pi, 0.0, 0.0]))
DRAG = AdmittanceLaw(
    np.array([0.005, 0.005, 0.010, 0.1, 0.1, 0.1]),
    np.array([0.08, 0.08, 0.40, 3.0, 3.0, 3.0]),
    np.zeros(6),
    0.02,
)


def one(M, D, K, T):
    return AdmittanceLaw(np.array([M]), np.array([D]), np.array([K]), T)


def at_rest(rotation=PEN_DOWN, position=(0.0, 0.0, 0.0)):
    return DragState(np.array(position), rotation, np.zeros(6))


def advance(law, force, velocity, displacement):
    """v and x after one step of a tool that moves along base x alone."""
    of_six = (np.repeat(part, 6) for part in (law.mass, law.damping, law.stiffness))
    before = DragState(np.eye(3)[0] * displacement, np.eye(3), np.eye(6)[0] * velocity)
    home = at_rest(np.eye(3))
    after = move(AdmittanceLaw(*of_six, law.period), before, np.eye(6)[0] * force, home)
    return after.velocity[:1], after.position[:1]


def transition(law):
    """The matrix of one step without force, column by column, from the code under test."""
    columns = []
    for v, x in ((1.0, 0.0), (0.0, 1.0)):
        after = advance(law, np.zeros(1), np.array([v]), np.array([x]))
        columns.append([after[0][0], after[1][0]])
    return np.array(columns).T


positive = st.floats(1e-4, 1e3)


@given(positive, positive, positive, st.floats(1e-3, 0.5))
def test_criterion_agrees_with_the_eigenvalues_of_the_step(M, D, K, T):
    law = one(M, D, K, T)
    radius = np.abs(np.linalg.eigvals(transition(law))).max()
    if abs(radius - 1.0) < 1e-9:
        return
    if radius < 1.0:
        check_stable(law, ("z",))
    else:
        with pytest.raises(InputError, match="z: unstable"):
            check_stable(law, ("z",))


@pytest.mark.parametrize(
    ("M", "D", "K", "T", "words"),
    [
        (0.0, 1.0, 0.0, 0.02, "mass = 0"),
        (-1.0, 1.0, 0.0, 0.02, "mass = -1"),
        (np.nan, 1.0, 0.0, 0.02, "mass = nan"),
        (1.0, 0.0, 0.0, 0.02, "damping = 0"),
        (1.0, np.inf, 0.0, 0.02, "damping = inf"),
        (1.0, 1.0, -0.1, 0.02, "stiffness = -0.1"),
        (0.1, 10.0, 0.0, 0.02, "2TD"),
        (1.0, 1.0, 0.0, 0.0, "control period = 0"),
        (1.0, 1.0, 0.0, np.nan, "control period = nan"),
    ],
)
def test_an_unstable_law_is_refused_by_name_and_value(M, D, K, T, words):
    with pytest.raises(InputError, match=words):
        check_stable(one(M, D, K, T), ("rotation y",))


def test_velocity_under_a_constant_force_follows_the_closed_form():
    # With K = 0: v(k) = F/D (1 - (1 - TD/M)^k).
    M, D, T, F = 0.005, 0.08, 0.02, 3.0
    v, x = np.zeros(1), np.zeros(1)
    for k in range(1, 100):
        v, x = advance(one(M, D, 0.0, T), np.array([F]), v, x)
        assert v[0] == pytest.approx(F / D * (1.0 - (1.0 - T * D / M) ** k), rel=1e-12)


def test_a_spring_settles_where_it_balances_the_force():
    v, x = np.zeros(1), np.zeros(1)
    for _ in range(5000):
        v, x = advance(one(0.5, 2.0, 2.0, 0.02), np.array([1.5]), v, x)
    assert x[0] == pytest.approx(0.75, rel=1e-6)


def test_the_force_balance_uses_old_velocity_and_old_position():
    v, x = advance(one(2.0, 3.0, 5.0, 0.1), np.array([7.0]), np.array([1.0]), np.array([0.5]))
    a = (7.0 - 3.0 * 1.0 - 5.0 * 0.5) / 2.0
    assert v[0] == pytest.approx(1.0 + 0.1 * a)
    assert x[0] == pytest.approx(0.5 + 0.1 * (1.0 + 0.1 * a))


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("rotation", [np.eye(3), PEN_DOWN], ids=["upright", "pen down"])
def test_the_tool_turns_the_way_of_the_torque_about_each_base_axis(axis, sign, rotation):
    torque = np.zeros(6)
    torque[3 + axis] = sign
    home = pose = at_rest(rotation)
    for _ in range(25):
        pose = move(DRAG, pose, torque, home)
    turned = log(pose.rotation @ rotation.T)
    assert sign * turned[axis] > 0.05
    np.testing.assert_allclose(np.delete(turned, axis), 0.0, atol=1e-12)
    np.testing.assert_allclose(pose.position, 0.0)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_free_tool_turns_through_full_turns_without_a_singularity(axis):
    torque = np.zeros(6)
    torque[3 + axis] = 6.0
    home = pose = at_rest(PEN_DOWN)
    angle = 0.0
    for _ in range(400):
        before = pose.rotation
        pose = move(DRAG, pose, torque, home)
        angle += log(pose.rotation @ before.T)[axis]
    assert angle > 4.0 * np.pi
    # At rest with its torque the tool turns at torque / damping, whatever its attitude.
    np.testing.assert_allclose(pose.velocity[3 + axis], 2.0, rtol=1e-9)
    np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-12)


@pytest.mark.slow
@given(st.integers(0, 10_000))
def test_the_turning_spring_brings_the_tool_home_from_any_side(seed):
    rng = np.random.default_rng(seed)
    axis = rng.standard_normal(3)
    away = exp(axis / np.linalg.norm(axis) * rng.uniform(0.1, 3.0))
    law = AdmittanceLaw(np.full(6, 0.1), np.full(6, 2.0), np.full(6, 8.0), 0.02)
    home = at_rest(PEN_DOWN)
    pose = at_rest(away @ PEN_DOWN)
    for _ in range(400):
        pose = move(law, pose, np.zeros(6), home)
    np.testing.assert_allclose(log(pose.rotation @ PEN_DOWN.T), 0.0, atol=1e-6)


def test_turning_and_moving_do_not_depend_on_the_choice_of_base_axes():
    rng = np.random.default_rng(1)
    Q = exp(rng.standard_normal(3))
    law = AdmittanceLaw(np.full(6, 0.1), np.full(6, 2.0), np.full(6, 8.0), 0.02)
    home = at_rest(PEN_DOWN)
    pose, turned, turned_home = home, at_rest(Q @ PEN_DOWN), at_rest(Q @ PEN_DOWN)
    for _ in range(50):
        wrench = rng.standard_normal(6)
        pose = move(law, pose, wrench, home)
        there = np.concatenate([Q @ wrench[:3], Q @ wrench[3:]])
        turned = move(law, turned, there, turned_home)
    np.testing.assert_allclose(turned.position, Q @ pose.position, atol=1e-12)
    np.testing.assert_allclose(turned.rotation, Q @ pose.rotation, atol=1e-12)


def test_bounds_hold_for_the_state_so_nothing_winds_up():
    bounds = Bounds(50.0, 500.0, 0.5, 5.0)
    home = pose = at_rest()
    pull = np.array([300.0, 0.0, 0.0, 0.0, 90.0, 0.0])
    for _ in range(100):
        before = pose
        pose = move(DRAG, pose, pull, home, bounds)
        gained = pose.velocity - before.velocity
        assert np.linalg.norm(gained[:3]) <= 500.0 * 0.02 * (1 + 1e-12)
        assert np.linalg.norm(gained[3:]) <= 5.0 * 0.02 * (1 + 1e-12)
    assert pose.velocity[0] == pytest.approx(50.0)
    assert pose.velocity[4] == pytest.approx(0.5)
    # Let go: the damping acts on 50 mm/s, not on a hidden speed of 3750 mm/s.
    pose = move(DRAG, pose, np.zeros(6), home, bounds)
    assert pose.velocity[0] < 50.0


def test_braking_comes_to_rest_in_the_time_that_the_bound_allows():
    bounds = Bounds(100.0, 1000.0, 1.0, 10.0)
    pose = DragState(np.zeros(3), PEN_DOWN, np.array([60.0, 80.0, 0.0, 0.0, 0.0, 1.0]))
    for _ in range(5):
        pose = brake(DRAG, pose, bounds)
    np.testing.assert_allclose(pose.velocity, 0.0, atol=1e-12)


def test_braking_takes_the_whole_bound_and_no_more_in_every_step():
    """100 mm/s at 1000 mm/s² and 1.2 rad/s at 10 rad/s²: 20 mm/s and 0.2 rad/s a period."""
    bounds = Bounds(100.0, 1000.0, 1.0, 10.0)
    pose = DragState(np.zeros(3), PEN_DOWN, np.array([60.0, 80.0, 0.0, 0.0, 0.0, 1.2]))
    speeds, turning = [], []
    for _ in range(7):
        before, pose = pose, brake(DRAG, pose, bounds)
        speeds.append(np.linalg.norm(pose.velocity[:3]))
        turning.append(np.linalg.norm(pose.velocity[3:]))
        np.testing.assert_allclose(pose.position, before.position + 0.02 * pose.velocity[:3])
        turned = log(pose.rotation @ before.rotation.T)
        np.testing.assert_allclose(turned, 0.02 * pose.velocity[3:], atol=1e-12)
    np.testing.assert_allclose(speeds, [80.0, 60.0, 40.0, 20.0, 0.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(turning, [1.0, 0.8, 0.6, 0.4, 0.2, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(pose.position[:2], 0.02 * 200.0 * np.array([0.6, 0.8]))


@given(st.integers(0, 10_000))
def test_a_step_with_bounds_is_the_free_one_shortened_first_in_acceleration_then_in_speed(seed):
    rng = np.random.default_rng(seed)
    law = AdmittanceLaw(*rng.uniform(0.1, 2.0, (3, 6)), 0.02)
    bounds = Bounds(*rng.uniform([5.0, 50.0, 0.2, 2.0], [50.0, 500.0, 2.0, 20.0]))
    home = DragState(rng.standard_normal(3), exp(0.3 * rng.standard_normal(3)), np.zeros(6))
    pose = DragState(
        20.0 * rng.standard_normal(3), exp(rng.standard_normal(3)), 10.0 * rng.standard_normal(6)
    )
    wrench = 200.0 * rng.standard_normal(6)
    off = np.concatenate([pose.position - home.position, log(pose.rotation @ home.rotation.T)])
    a = (wrench - law.damping * pose.velocity - law.stiffness * off) / law.mass
    limits = ((bounds.acceleration, bounds.turning_acceleration), (bounds.speed, bounds.turning))
    halves = (slice(0, 3), slice(3, 6))
    for half, most in zip(halves, limits[0], strict=True):
        a[half] *= min(1.0, most / np.linalg.norm(a[half]))
    v = pose.velocity + 0.02 * a
    for half, most in zip(halves, limits[1], strict=True):
        v[half] *= min(1.0, most / np.linalg.norm(v[half]))
    made = move(law, pose, wrench, home, bounds)
    np.testing.assert_allclose(made.velocity, v, atol=1e-9)
    np.testing.assert_allclose(made.position, pose.position + 0.02 * v[:3], atol=1e-9)
    np.testing.assert_allclose(made.rotation, exp(0.02 * v[3:]) @ pose.rotation, atol=1e-9)


def test_a_law_has_as_many_axes_as_there_are_names():
    with pytest.raises(ValueError, match="zip"):
        check_stable(one(1.0, 1.0, 0.0, 0.02))
    check_stable(one(1.0, 1.0, 0.0, 0.02), ("z",))
    # At the border itself it swings for ever: 2TD + T²K = 4M.
    with pytest.raises(InputError, match="unstable"):
        check_stable(one(1.0, 4.0, 0.0, 0.5), ("z",))
    check_stable(one(1.0, 3.9375, 0.0, 0.5), ("z",))
    with pytest.raises(InputError, match="unstable"):
        check_stable(one(1.0, 2.0, 8.0, 0.5), ("z",))
    check_stable(one(1.0, 2.0, 7.9375, 0.5), ("z",))

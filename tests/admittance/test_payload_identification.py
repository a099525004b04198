import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from dmpcli.admittance.compensation import Compensation, LowPass
from dmpcli.admittance.payload_identification import (
    Identification,
    PayloadEstimate,
    check_orientations,
    condition,
    identify,
)
from dmpcli.errors import RefusedError
from dmpcli.spatial import wrench
from dmpcli.spatial.rotations import exp
from dmpcli.spatial.wrench import Tool

NOISE = np.array([0.02, 0.02, 0.06, 8e-4, 8e-4, 8e-4])
SAMPLES = 100  # one second at 100 Hz
TRUTH = PayloadEstimate(
    weight=6.0,
    centre=np.array([1.0, -2.0, 45.0]),
    inclination=np.radians([2.0, -1.5]),
    zero=np.array([1.2, -0.8, 3.5, 0.02, -0.03, 0.01]),
)


def tilted(n=12, tilt=45.0, turn=45.0):
    """Tilts evenly around the tool, every other one turned the other way; scipy's rotations."""
    around = 2 * np.pi * np.arange(n) / n
    axes = np.stack([np.cos(around), np.sin(around), np.zeros(n)], axis=-1)
    spin = Rotation.from_rotvec(np.outer(turn * (-1.0) ** np.arange(n), [0, 0, 1]), degrees=True)
    down = Rotation.from_euler("x", 180.0, degrees=True)
    return (down * Rotation.from_rotvec(tilt * axes, degrees=True) * spin).as_matrix()


def sensed(R, truth=TRUTH):
    """What a sensor reads, by Newton: weight pulls at the centre of mass; no code of ours."""
    u, v = truth.inclination
    load = truth.weight * np.array([np.cos(u) * np.sin(v), -np.sin(u), -np.cos(u) * np.cos(v)])
    force = np.array([Ri.T @ load for Ri in R])
    return np.hstack([force, np.cross(truth.centre / 1000.0, force)]) + truth.zero


def noisy(R, seed, truth=TRUTH, samples=SAMPLES):
    rng = np.random.default_rng(seed)
    return sensed(R, truth) + NOISE / np.sqrt(samples) * rng.standard_normal((len(R), 6))


def off(found, truth=TRUTH):
    """Errors: weight N, centre mm, inclination as the angle between the two verticals, degrees."""
    down = [wrench.gravity(1.0, p.inclination) for p in (found, truth)]
    angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(*down)), np.dot(*down)))
    return abs(found.weight - truth.weight), np.linalg.norm(found.centre - truth.centre), angle


def assert_within_bounds(found):
    weight, centre, angle = off(found.payload)
    assert weight < 0.05
    assert centre < 1.0
    assert angle < 0.3


def tool_with(payload):
    return Tool(
        np.array([0.0, 0.0, 160.0]),
        np.eye(3),
        np.array([0.0, 0.0, 25.0]),
        np.eye(3),
        payload.weight,
        payload.centre,
        payload.inclination,
        payload.zero,
    )


def test_without_noise_the_truth_comes_back():
    found = identify(tilted(), sensed(tilted()))
    assert max(off(found.payload)) < 1e-8
    np.testing.assert_allclose(found.payload.zero, TRUTH.zero, atol=1e-10)
    np.testing.assert_allclose(found.residual, 0.0, atol=1e-10)
    assert found.used.all()


@pytest.mark.thorough
def test_twelve_poses_keep_the_bounds_with_a_real_sensors_noise_and_none_is_left_out():
    for seed in range(100):
        found = identify(tilted(), noisy(tilted(), seed))
        assert_within_bounds(found)
        assert found.used.all()


@pytest.mark.slow
@given(st.integers(0, 10_000))
def test_any_payload_any_sensor_on_the_flange_and_any_base_come_back(seed):
    rng = np.random.default_rng(seed)
    truth = PayloadEstimate(
        rng.uniform(0.5, 40.0),
        80.0 * rng.standard_normal(3),
        rng.uniform(-1.5, 1.5, 2),
        np.array([50.0, 50.0, 100.0, 2.0, 2.0, 2.0]) * rng.standard_normal(6),
    )
    on_flange = exp(2.0 * rng.standard_normal(3))
    R = exp(rng.standard_normal(3)) @ tilted() @ on_flange
    found = identify(R, sensed(R, truth)).payload
    assert max(off(found, truth)) < 1e-6
    np.testing.assert_allclose(found.zero, truth.zero, atol=1e-8)


def test_a_sensor_turned_on_the_flange_is_a_parameter_and_leaving_it_out_shows():
    on_flange = Rotation.from_euler("z", 30, degrees=True).as_matrix()
    in_flange = Rotation.from_euler("x", 20, degrees=True).as_matrix()
    nowhere = np.zeros(3)
    tool = Tool(nowhere, in_flange, nowhere, on_flange, weight=0.0, centre=nowhere)
    tcp = tilted()
    readings = noisy(tcp @ in_flange.T @ on_flange, 0)  # base ← TCP ← flange ← sensor
    found = identify(tcp @ tool.sensor_in_tcp, readings)
    assert_within_bounds(found)
    assert identify(tcp, readings).rms[0] > 10 * found.rms[0]


@pytest.mark.parametrize("seed", range(5))
def test_an_independent_solver_of_the_whole_nonlinear_model_agrees(seed):
    R = tilted()
    readings = noisy(R, seed)

    def miss(p):
        model = sensed(R, PayloadEstimate(p[0], p[1:4], p[4:6], p[6:]))
        return ((model - readings) / np.array([1, 1, 1, 0.1, 0.1, 0.1])).ravel()

    judged = least_squares(miss, np.array([1.0, *np.zeros(11)]), x_scale="jac").x
    found = identify(R, readings).payload
    # It weighs forces against torques, we take the forces first: within the noise, not the same.
    assert found.weight == pytest.approx(judged[0], abs=2e-3)
    np.testing.assert_allclose(found.centre, judged[1:4], atol=0.05)
    np.testing.assert_allclose(found.inclination, judged[4:6], atol=5e-4)
    np.testing.assert_allclose(found.zero, judged[6:], atol=5e-3)


@pytest.mark.thorough
def test_the_standard_errors_are_those_of_many_repetitions():
    found = [identify(tilted(), noisy(tilted(), seed)) for seed in range(200)]
    for name in ("weight", "centre", "inclination", "zero"):
        values = np.array([np.ravel(getattr(f.payload, name)) for f in found])
        said = np.array([np.ravel(getattr(f.error, name)) for f in found])
        rms = np.sqrt(np.mean(said**2, axis=0))
        np.testing.assert_allclose(rms, values.std(axis=0), rtol=0.25)


@pytest.mark.slow
def test_the_residual_over_a_free_motion_is_below_a_tenth_of_a_newton():
    """A motion of at most 0.2 m/s², the tool's inertia included, after the low-pass of `record`."""
    t = np.arange(0, 1000) / 100.0
    turn = 0.5 * np.sin(0.3 * t)[:, None] * np.array([0.6, -0.8, 0.2])
    R = tilted(1, 0.0, 0.0)[0] @ Rotation.from_rotvec(turn).as_matrix()
    acceleration = 0.2 * np.sin(2.0 * t)[:, None] * np.array([0.6, 0.0, 0.8])
    inertia = np.array([-6.0 / 9.81 * Ri.T @ a for Ri, a in zip(R, acceleration, strict=True)])
    inertia = np.hstack([inertia, np.cross(TRUTH.centre / 1000.0, inertia)])
    for seed in range(10):
        compensate = Compensation(tool_with(identify(tilted(), noisy(tilted(), seed)).payload))
        plain = np.linalg.norm(compensate(sensed(R), R)[:, :3], axis=1)
        assert plain.max() < 0.02, "what the identification leaves, N"
        noise = NOISE * np.random.default_rng(1000 + seed).standard_normal((len(t), 6))
        low_pass = LowPass(10.0, 100.0)
        felt = np.array([low_pass(w) for w in compensate(sensed(R) + inertia + noise, R)])
        rms = np.sqrt(np.mean(np.sum(felt[:, :3] ** 2, axis=1)))
        assert rms < 0.1, "identification, inertia and noise, N"


def visited(n=12):
    """Tilts in two rounds of opposite twist, as the arm visits them, and when, s."""
    R = tilted(n)
    return np.concatenate([R[::2], R[1::2]]), 5.0 * np.arange(n)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_a_zero_that_drifts_evenly_is_found_as_it_is_at_the_end(seed):
    R, t = visited()
    rate = np.array([2e-3] * 3 + [2e-5] * 3) * np.random.default_rng(seed).standard_normal(6)
    readings = noisy(R, seed) + t[:, None] * rate
    found = identify(R, readings, t)
    assert_within_bounds(found)
    np.testing.assert_allclose(found.drift, rate, atol=6e-4)
    np.testing.assert_allclose(found.payload.zero - TRUTH.zero, t[-1] * rate, atol=0.02)
    assert found.used.all()


def test_a_drift_that_is_not_looked_for_passes_for_inclination():
    R, t = visited()
    readings = sensed(R) + t[:, None] * np.array([4e-3, 4e-3, 0, 0, 0, 0])
    assert off(identify(R, readings).payload)[2] > 0.3
    assert off(identify(R, readings, t).payload)[2] < 1e-6


@pytest.mark.parametrize(("count", "t"), [(5, np.arange(5.0)), (8, np.zeros(8))])
def test_no_drift_is_looked_for_in_few_poses_or_without_times(count, t):
    R = tilted(count)
    found = identify(R, sensed(R), t)
    assert found.drift is None
    assert max(off(found.payload)) < 1e-8


def test_no_drift_is_looked_for_where_it_would_spoil_the_conditioning():
    R, t = visited()
    assert identify(R, sensed(R), t, limit=10.0).drift is not None
    assert identify(R, sensed(R), t, limit=1.05 * condition(R)).drift is None


@pytest.mark.parametrize(
    ("n", "tilt", "turn", "number"), [(12, 10.0, 0.0, 16.2), (12, 45.0, 45.0, 2.41)]
)
def test_the_condition_number_is_that_of_the_stacked_system(n, tilt, turn, number):
    R = tilted(n, tilt, turn)
    stacked = np.concatenate([np.hstack([Ri.T, np.eye(3)]) for Ri in R])
    assert condition(R) == pytest.approx(np.linalg.cond(stacked), rel=1e-9)
    assert condition(R) == pytest.approx(number, rel=0.01)


ABOUT_Y = Rotation.from_rotvec(np.outer(np.linspace(0, 2, 8), [0, 1, 0])).as_matrix()


@pytest.mark.parametrize(
    ("R", "words"),
    [
        (np.array([np.eye(3)]), "1 different orientation is not enough"),
        (np.repeat(tilted(2), 5, axis=0), "2 different orientations are not enough"),
        (ABOUT_Y, r"turn about one axis, \(0\.00, 1\.00, 0\.00\) of the base"),
        (tilted(12, 10.0, 0.0), r"condition number 16\.2 is over 10;\ntilt the tool further"),
    ],
)
def test_an_ill_conditioned_set_is_refused_by_name_with_the_remedy(R, words):
    with pytest.raises(RefusedError, match=words):
        check_orientations(R)
    with pytest.raises(RefusedError, match=words):
        identify(R, sensed(R))


def test_three_orientations_about_different_axes_will_do():
    R = Rotation.from_rotvec([[0, 0, 0], [1.2, 0, 0], [0, 1.2, 0]]).as_matrix()
    assert max(off(identify(R, sensed(R)).payload)) < 1e-8


@pytest.mark.parametrize("pose", [0, 5, 11])
@pytest.mark.parametrize(
    "touch", [np.array([0.5, 0, 0, 0, 0, 0]), np.array([0, 0, 0, 0, 0.08, 0.0])]
)
def test_a_pose_that_something_touched_is_left_out(pose, touch):
    readings = noisy(tilted(), 3)
    readings[pose] += touch
    found = identify(tilted(), readings)
    assert np.flatnonzero(~found.used).tolist() == [pose]
    assert_within_bounds(found)
    np.testing.assert_allclose(found.residual[pose], touch, atol=0.05)


def test_a_sensor_that_carries_nothing_is_refused():
    nothing = PayloadEstimate(0.0, np.zeros(3), np.zeros(2), TRUTH.zero)
    with pytest.raises(RefusedError, match="does the sensor carry the tool"):
        identify(tilted(), noisy(tilted(), 1, nothing))


@given(st.floats(0.01, 100), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_weight_and_inclination_undo_gravity(weight, u, v):
    found, angles = wrench.weight_and_inclination(wrench.gravity(weight, np.array([u, v])))
    assert found == pytest.approx(weight)
    np.testing.assert_allclose(angles, [u, v], atol=1e-9)


def test_the_residuals_are_those_that_compensation_leaves():
    R = tilted()
    readings = noisy(R, 4)
    found = identify(R, readings)
    left = Compensation(tool_with(found.payload))(readings, R)
    back = np.swapaxes(R, -1, -2)
    np.testing.assert_allclose(np.matvec(back, left[:, :3]), found.residual[:, :3], atol=1e-12)


def test_residuals_are_told_as_lengths_of_forces_and_torques_of_the_poses_used():
    residual = np.array([[3.0, 4, 0, 0, 0, 1], [0, 0, 5, 0, 7, 0], [90.0] * 6, [6, 8, 0, 0, 3, 4]])
    used = np.array([True, True, False, True])
    found = Identification(TRUTH, TRUTH, residual, np.ones(2), used)
    assert found.rms == pytest.approx([np.sqrt(150 / 3), np.sqrt(75 / 3)])
    assert found.largest.tolist() == [10.0, 7.0]


def stacked(R, age):
    """``[Rᵀ I tau I]`` of all poses, by the note: tau is age from its mean in deviations."""
    tau = (age - age.mean()) / age.std()
    return np.vstack(
        [np.hstack([Ri.T, np.eye(3), x * np.eye(3)]) for Ri, x in zip(R, tau, strict=True)]
    )


def test_a_drift_is_looked_for_where_the_poses_tell_it_from_the_weight_and_else_not():
    """Up to the limit of the condition, which the order of the poses decides."""
    R = exp(np.random.default_rng(3).uniform(0.2, 1.4, (9, 3)))[[2, 0, 1, 3, 4, 5, 8, 6, 7]]
    t = np.array([0.0, 4.0, 9.0, 11.0, 20.0, 22.0, 31.0, 33.0, 40.0])
    number = np.linalg.cond(stacked(R, t - 40.0))
    other = np.linalg.cond(stacked(np.swapaxes(R, 1, 2), t - 40.0))
    assert abs(other / number - 1.0) > 0.01
    assert condition(R) < 0.99 * number
    readings = sensed(R) + np.outer(t - 40.0, [2e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    told = identify(R, readings, t, limit=1.001 * number)
    assert told.condition[0] == pytest.approx(number)
    np.testing.assert_allclose(told.drift, [2e-3, 0, 0, 0, 0, 0], atol=1e-9)
    assert identify(R, readings, t, limit=0.999 * number).drift is None


def test_poses_that_are_read_in_half_a_second_show_their_drift_too():
    t = np.linspace(0.0, 0.5, 12)
    drift = np.array([0.2, -0.1, 0.3, 0.01, 0.0, -0.02])
    found = identify(tilted(), sensed(tilted()) + np.outer(t - 0.5, drift), t)
    np.testing.assert_allclose(found.drift, drift, atol=1e-8)
    np.testing.assert_allclose(found.payload.zero, TRUTH.zero, atol=1e-8)
    assert identify(tilted(), sensed(tilted()), np.full(12, 3.0)).drift is None


@pytest.mark.parametrize(("n", "looked"), [(5, False), (6, True)])
def test_a_drift_is_looked_for_from_six_poses_on(n, looked):
    R = tilted(n)
    found = identify(R, sensed(R), np.arange(float(n)))
    assert (found.drift is not None) is looked


def test_standard_errors_are_those_of_least_squares_with_a_variance_for_each_axis():
    rng = np.random.default_rng(5)
    R, readings = tilted(9), noisy(tilted(9), 5)
    del rng
    found = identify(R, readings)
    A = np.vstack([np.hstack([Ri.T, np.eye(3)]) for Ri in R])
    left = readings[:, :3].ravel() - A @ np.linalg.lstsq(A, readings[:, :3].ravel())[0]
    # Two unknowns to each axis.
    variance = (left.reshape(-1, 3) ** 2).sum(axis=0) / (9 - 2)
    inverse = np.linalg.pinv(A)
    covariance = inverse @ np.diag(np.tile(variance, 9)) @ inverse.T
    np.testing.assert_allclose(found.error.zero[:3], np.sqrt(np.diag(covariance)[3:]))
    along = wrench.gravity(1.0, found.payload.inclination)
    assert found.error.weight == pytest.approx(np.sqrt(along @ covariance[:3, :3] @ along))
    # Its two angles turn the load across itself: by numbers of our own.
    u, v = found.payload.inclination
    step = 1e-6
    for axis, turned in enumerate(((u + step, v), (u, v + step))):
        by = (wrench.gravity(1.0, np.array(turned)) - along) / step
        across = by / np.linalg.norm(by)
        wanted = np.sqrt(across @ covariance[:3, :3] @ across) / np.linalg.norm(by)
        assert found.error.inclination[axis] * found.payload.weight == pytest.approx(
            wanted, rel=1e-4
        )


def test_the_axis_that_all_poses_turn_about_is_named_to_two_digits():
    axis = np.array([-0.2588, 0.9659, 0.0])
    for sign in (1.0, -1.0):
        R = exp(np.linspace(-0.6, 1.0, 8)[:, None] * sign * axis / np.linalg.norm(axis))
        with pytest.raises(RefusedError, match=r"\(-0\.26, 0\.97, 0\.00\) of the base"):
            check_orientations(R)
    hardly = exp(0.03 * np.random.default_rng(0).standard_normal((8, 3)))
    with pytest.raises(RefusedError) as refused:
        check_orientations(hardly)
    assert "axis" not in str(refused.value)


def test_a_condition_number_at_the_limit_is_allowed():
    R = tilted()
    check_orientations(R, condition(R))
    with pytest.raises(RefusedError, match="condition number"):
        check_orientations(R, np.nextafter(condition(R), 0.0))
    # By its own definition: that of the stacked system.
    system = np.vstack([np.hstack([Ri.T, np.eye(3)]) for Ri in R])
    assert condition(R) == pytest.approx(np.linalg.cond(system))


def test_orientations_within_a_fiftieth_of_a_radian_are_one():
    axes = np.eye(3)
    three = exp(np.vstack([np.zeros(3), 0.8 * axes[0], 0.8 * axes[1]]))
    check_orientations(three, 1e6)
    for step, enough in ((0.0199, False), (0.0201, True)):
        two = exp(np.vstack([np.zeros(3), 0.8 * axes[0], (0.8 + step) * axes[0]]))
        with pytest.raises(RefusedError, match="condition" if enough else "2 different"):
            check_orientations(two)


@pytest.mark.parametrize(
    ("part", "size", "goes"),
    [(1, 0.099, False), (1, 0.101, True), (4, 0.0099, False), (4, 0.0101, True)],
)
def test_a_pose_goes_where_the_others_miss_it_by_a_tenth_of_a_newton(part, size, goes):
    """Torques count as forces at a tenth of a metre."""
    readings = sensed(tilted())
    readings[4, part] += size
    assert identify(tilted(), readings).used[4] == (not goes)


def test_no_more_than_a_quarter_of_the_poses_goes_and_four_are_all_needed():
    readings = sensed(tilted())
    readings[[1, 4, 6, 9], [0, 1, 2, 0]] += [0.3, -1.0, 4.0, 12.0]
    assert np.count_nonzero(~identify(tilted(), readings).used) == 3
    few = sensed(tilted(4))
    few[2, 0] += 2.0
    assert identify(tilted(4), few).used.all()
    five = sensed(tilted(5))
    five[2, 0] += 2.0
    assert not identify(tilted(5), five).used[2]

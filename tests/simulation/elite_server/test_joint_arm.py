import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.kinematics.models import model
from dmpcli.simulation.elite_server.joint_arm import JointArm
from dmpcli.simulation.elite_server.lab import parked
from dmpcli.simulation.mock.parameters import PEN, PEN_DOWN
from dmpcli.spatial.pose import Pose

EC66 = model("ec66")
# Start and goal of the paper's stroke, mm.
POINTS = ((-551.030, 131.399, -17.560), (-660.021, 130.034, -17.538))


def arm(lag: float = 0.0) -> JointArm:
    return JointArm(EC66, PEN, parked(EC66, PEN, Pose(np.array(POINTS[0]), PEN_DOWN)), lag)


@pytest.mark.parametrize("point", POINTS)
def test_the_parked_pen_stands_upright_on_the_papers_points(point):
    joints = parked(EC66, PEN, Pose(np.array(point), PEN_DOWN))
    at = JointArm(EC66, PEN, joints).posture
    np.testing.assert_allclose(at.position, point, atol=1e-9)
    np.testing.assert_allclose(at.rotation, Rotation.from_euler("x", np.pi).as_matrix(), atol=1e-12)
    # A pen of 160 mm along the flange's axis, pointing down.
    np.testing.assert_allclose(at.flange_position, np.add(point, (0, 0, 160.0)), atol=1e-9)


def test_the_parked_elbow_is_above_the_table():
    from dmpcli.kinematics import chain

    origins = chain.frames(EC66, arm().joints).position
    assert origins[1:, 2].min() > 90.0


def test_a_leg_is_travelled_evenly_and_ends_exactly():
    a = arm()
    start = a.joints.copy()
    legs = [(start + 0.1, 0.5)]
    a.feed = lambda _: legs.pop(0) if legs else None
    a.advance(0.2)
    np.testing.assert_allclose(a.joints, start + 0.04, atol=1e-12)
    np.testing.assert_allclose(a.speeds, 0.2, atol=1e-12)
    a.advance(10.0)
    np.testing.assert_array_equal(a.joints, start + 0.1)
    np.testing.assert_array_equal(a.speeds, 0.0)


@pytest.mark.parametrize("steps", [1, 7])
def test_the_servo_lags_as_a_first_order_one_however_time_is_cut(steps):
    lag, rate, t = 0.03, 0.4, 0.25
    a = arm(lag)
    start = a.joints.copy()
    a.feed = lambda command: (command + rate, 1.0)
    for _ in range(steps):
        a.advance(t / steps)
    # Ramp response of 1 / (1 + lag s).
    expected = rate * (t - lag * (1.0 - np.exp(-t / lag)))
    np.testing.assert_allclose(a.joints - start, expected, rtol=1e-12)
    np.testing.assert_allclose(a.speeds, rate * (1.0 - np.exp(-t / lag)), rtol=1e-12)


def test_the_tcps_velocity_is_its_motions_derivative():
    a = arm()
    rng = np.random.default_rng(3)
    rate = rng.uniform(-1.0, 1.0, 6)
    a.feed = lambda command: (command + rate, 1.0)
    a.advance(0.1)
    h = 1e-5
    before = a.posture
    a.advance(h)
    middle = a.posture
    a.advance(h)
    after = a.posture
    linear = (after.position - before.position) / (2.0 * h)
    turn = Rotation.from_matrix(after.rotation @ before.rotation.T).as_rotvec() / (2.0 * h)
    np.testing.assert_allclose(middle.velocity[:3], linear, rtol=1e-6, atol=1e-4)
    np.testing.assert_allclose(middle.velocity[3:], turn, rtol=1e-6, atol=1e-7)


def test_standing_still_holds_the_actual_joints_and_forgets_the_feed():
    a = arm(0.05)
    a.feed = lambda command: (command + 1.0, 1.0)
    a.advance(0.3)
    held = a.joints.copy()
    a.stand_still()
    a.advance(1.0)
    np.testing.assert_array_equal(a.joints, held)
    np.testing.assert_array_equal(a.posture.velocity, 0.0)

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.instruments import pose_forms, servo_adapter
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.driver_protocol import DriverInfo, DriverState
from dmpcli.instruments.joint_space import JointSpace
from dmpcli.instruments.protocols import ServoInfo
from dmpcli.kinematics import chain, inverse, models
from dmpcli.simulation.mock import PEN
from dmpcli.spatial.pose import Pose
from tests.instruments.instrument_conformance import check_servo

ARM = models.model("ec66")
HOME = np.radians([30.0, -80.0, 100.0, -110.0, -90.0, 20.0])
REMEDY = "; see tool=N and euler=zyx"


def declared(**changes):
    return DriverInfo(
        **{
            "make": "Brand",
            "space": "joint",
            "pacing": "client",
            "period_range": (0.002, 0.1),
            "lookahead": 0.1,
            "length": "mm",
            "angle": "deg",
            "orientation": "xyz euler",
            "model": "ec66",
            "remedy": REMEDY,
        }
        | changes
    )


def by_scipy(said, rotation):
    """The last numbers of a pose, by scipy alone."""
    turn = Rotation.from_matrix(rotation)
    if said.orientation == "quaternion":
        return turn.as_quat(scalar_first=True)
    degrees = said.angle == "deg"
    if said.orientation == "rotation vector":
        return turn.as_rotvec(degrees)
    if said.orientation == "xyz euler":
        return turn.as_euler("XYZ", degrees)  # capitals: about the body's own axes
    return turn.as_euler("xyz", degrees)  # small: about fixed axes, Rz Ry Rx


FORMS = list(
    itertools.product(
        ("xyz euler", "zyx euler", "rotation vector", "quaternion"), ("rad", "deg"), ("mm", "m")
    )
)


class Brand:
    """A driver whose arm is where it was last sent, one call later.

    It declares what version 0.1 asked for, `pacing` and `buffer_level`, which nothing reads.
    """

    def __init__(self, said=None, tool=None, joints=HOME):
        self.said = said or declared()
        self.tool = tool
        self.joints = np.array(joints)
        self.mode, self.detail = "ready", ""
        self.clock = SimulatedClock()
        self.calls, self.sent = [], []
        self.pose = None
        self.started = False

    @property
    def pose_now(self):
        at = chain.forward(ARM, self.joints)
        position, rotation = at.position, at.rotation
        if self.tool is not None:
            position = position + rotation @ self.tool.tcp_position
            rotation = rotation @ self.tool.tcp_rotation
        return Pose(position, rotation)

    def connect(self):
        return self.said

    def state(self):
        pose = pose_forms.encode(self.said, self.pose_now) if self.pose is None else self.pose
        joints = np.degrees(self.joints) if self.said.angle == "deg" else self.joints
        return DriverState(self.clock.now(), self.mode, joints, pose, self.detail)

    def start(self, period):
        self.calls.append("start")

    def send(self, target):
        self.sent.append(target)
        self.joints = np.radians(target) if self.said.angle == "deg" else target
        return True

    def buffer_level(self):
        return None

    def stop(self):
        self.calls.append("stop")

    def close(self):
        self.calls.append("close")


class Pusher(Brand):
    """One that is driven by poses."""

    def __init__(self, said):
        super().__init__(said)
        self.at = pose_forms.encode(said, self.pose_now)

    def state(self):
        return DriverState(self.clock.now(), self.mode, None, self.at)

    def send(self, target):
        self.sent.append(target)
        self.at = target
        return True


def opened(driver, tool=None):
    servo = servo_adapter.servo(driver, driver.clock, tool)
    servo.open()
    return servo


@pytest.mark.parametrize("queues", [False, True])
def test_the_servo_says_of_its_robot_what_the_driver_declares(queues):
    driver = Brand(declared(queues=queues))
    info = servo_adapter.servo(driver, driver.clock).open()
    assert isinstance(info, ServoInfo)
    said = (info.make, info.period_range, info.lookahead, info.queues, info.period_step)
    assert said == ("Brand", (0.002, 0.1), 0.1, queues, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(("orientation", "angle", "length"), FORMS)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_poses_are_written_as_scipy_writes_them_and_read_back(orientation, angle, length, seed):
    rng = np.random.default_rng(seed)
    said = declared(orientation=orientation, angle=angle, length=length)
    position = rng.uniform(-900.0, 900.0, 3)
    rotation = Rotation.random(rng=rng).as_matrix()
    written = pose_forms.encode(said, Pose(position, rotation))
    np.testing.assert_allclose(written[:3] * (1000.0 if length == "m" else 1.0), position)
    ours, theirs = written[3:], by_scipy(said, rotation)
    if orientation == "quaternion":
        theirs = theirs * np.sign(theirs @ ours)
    np.testing.assert_allclose(ours, theirs, atol=1e-6)
    back = pose_forms.decode(said, written)
    np.testing.assert_allclose(back.position, position, atol=1e-9)
    np.testing.assert_allclose(back.rotation, rotation, atol=1e-9)


@pytest.mark.parametrize(("orientation", "angle", "length"), FORMS)
def test_a_robot_driven_by_poses_obeys_the_servo_protocol(orientation, angle, length):
    said = declared(space="pose", orientation=orientation, angle=angle, length=length, model=None)
    driver = Pusher(said)
    clock = driver.clock
    servo = servo_adapter.servo(driver, clock)
    check_servo(servo, clock, lambda dt: clock.sleep_until(clock.now() + dt))


@pytest.mark.parametrize("angle", ["rad", "deg"])
@pytest.mark.parametrize("tool", [None, PEN])
@pytest.mark.parametrize("turns", [(0.0, 0.0), (np.pi, np.pi / 2)])
def test_a_robot_driven_by_joints_obeys_the_servo_protocol(angle, tool, turns):
    said = declared(angle=angle, base_turn=turns[0], flange_turn=turns[1], tolerance=(1e9, 9.0))
    driver = Brand(said, tool)
    clock = driver.clock
    servo = servo_adapter.servo(driver, clock, tool)
    check_servo(servo, clock, lambda dt: clock.sleep_until(clock.now() + dt))


def test_joint_set_points_bring_the_tools_tip_to_the_pose():
    driver = Brand(tool=PEN)
    servo = opened(driver, PEN)
    servo.start(0.02)
    state = servo.state()
    at = chain.forward(ARM, HOME)
    position, rotation = at.position, at.rotation
    np.testing.assert_allclose(state.position, position + rotation @ PEN.tcp_position)
    np.testing.assert_allclose(state.rotation, rotation @ PEN.tcp_rotation, atol=1e-12)
    np.testing.assert_allclose(state.joints, HOME)
    goal = state.position + [1.0, -2.0, 0.5]
    assert servo.send(goal, state.rotation)
    there = driver.pose_now
    np.testing.assert_allclose(there.position, goal, atol=1e-6)
    np.testing.assert_allclose(there.rotation, state.rotation, atol=1e-9)
    np.testing.assert_allclose(driver.sent[-1], np.degrees(driver.joints))


def test_a_step_that_no_joint_can_turn_in_a_period_is_not_sent():
    driver = Brand()
    servo = opened(driver)
    servo.start(0.002)
    state = servo.state()
    with pytest.raises(RefusedError, match=r"joint \d would have to turn at \d+°/s"):
        servo.send(state.position + [20.0, 0.0, 0.0], state.rotation)
    with pytest.raises(RefusedError, match="out of reach"):
        servo.send(np.array([2000.0, 0.0, 0.0]), state.rotation)
    assert driver.sent == []


def test_a_set_point_that_was_not_taken_is_not_the_reference_of_the_next():
    driver = Brand()
    driver.send = lambda _: False
    servo = opened(driver)
    servo.start(0.02)
    home, rotation = servo.state().position, servo.state().rotation
    # Each step of 10 mm alone would pass; from where the arm really is, the last is too far.
    assert not servo.send(home + [10.0, 0.0, 0.0], rotation)
    assert not servo.send(home + [20.0, 0.0, 0.0], rotation)
    with pytest.raises(RefusedError, match="would have to turn"):
        servo.send(home + [40.0, 0.0, 0.0], rotation)


@pytest.mark.parametrize(
    ("reports", "held", "words"),
    [
        (PEN, None, r"tool is not that of --tool.*see tool=N"),
        (None, PEN, "what it reports is its flange"),
    ],
)
def test_a_controller_that_knows_another_tool_is_refused(reports, held, words):
    with pytest.raises(RefusedError, match=words) as error:
        opened(Brand(tool=reports), held)
    assert str(error.value).count("°") >= 3
    assert "\n" not in str(error.value)


def test_a_controller_with_other_euler_angles_is_refused_by_their_name():
    tilted = HOME + np.radians([0.0, 0.0, 0.0, 10.0, 15.0, 0.0])
    driver = Brand(joints=tilted)
    driver.pose = pose_forms.encode(declared(orientation="zyx euler"), driver.pose_now)
    with pytest.raises(RefusedError, match="its orientation would fit as zyx euler"):
        opened(driver)
    driver.said = declared(orientation="zyx euler")
    opened(driver)


def test_a_controller_with_turned_frames_is_refused_with_the_turns_that_fit():
    driver = Brand()
    position, rotation = driver.pose_now.position, driver.pose_now.rotation
    half, quarter = (Rotation.from_euler("z", a).as_matrix() for a in (np.pi, np.pi / 2))
    driver.pose = pose_forms.encode(driver.said, Pose(half @ position, half @ rotation @ quarter))
    with pytest.raises(RefusedError, match="base_turn=180&flange_turn=90"):
        opened(driver)
    driver.said = declared(base_turn=np.pi, flange_turn=np.pi / 2)
    opened(driver)


class Solver(Brand):
    """One whose controller can be asked for its inverse kinematics."""

    def __init__(self, error=None, meant=None):
        super().__init__()
        self.error = error
        self.meant = meant or self.said
        self.questions = []

    def inverse(self, pose, near):
        self.questions.append(pose)
        goal = pose_forms.decode(self.meant, pose)
        joints = inverse.nearest(ARM, goal, np.radians(near))
        return None if self.error is None else np.degrees(joints + self.error)


def test_the_controllers_inverse_kinematics_is_compared_at_a_few_poses():
    driver = Solver(np.zeros(6))
    opened(driver)
    assert len(driver.questions) == 4
    driver = Solver()
    opened(driver)
    assert len(driver.questions) == 1  # it is not to be asked


@pytest.mark.parametrize(
    "error", [np.radians([0, 0, 1, 0, 0, 0]), np.radians([360, 0, 0, 0, 0, 0])]
)
def test_another_inverse_kinematics_is_refused(error):
    with pytest.raises(RefusedError, match="inverse kinematics and ours differ"):
        opened(Solver(error))


@pytest.mark.parametrize("error", [np.full(6, np.inf), np.full(6, np.nan)])
def test_an_inverse_kinematics_that_is_no_number_is_the_drivers_fault(error):
    with pytest.raises(InstrumentError, match="sends an inverse that is not six numbers"):
        opened(Solver(error))


def test_euler_angles_that_a_pen_pointing_down_cannot_tell_apart_show_in_the_inverse_kinematics():
    other = declared(orientation="zyx euler")
    driver = Solver(np.zeros(6), other)
    driver.pose = pose_forms.encode(other, driver.pose_now)
    alone = Brand()
    alone.pose = driver.pose
    opened(alone)
    with pytest.raises(RefusedError, match="inverse kinematics and ours differ"):
        opened(driver)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"joints": np.full(6, np.nan)}, "not numbers"),
        ({"joints": HOME[:5]}, "5 joint angles"),
        ({"pose": np.full(6, np.inf)}, "not a number"),
        ({"pose": np.zeros(7)}, "a pose of 7 numbers"),
    ],
)
def test_what_makes_no_sense_is_an_instruments_failure(change, words):
    driver = Brand()
    driver.pose = np.zeros(6)
    for name, value in change.items():
        setattr(driver, name, value)
    with pytest.raises(InstrumentError, match=words):
        opened(driver)


def test_an_arm_that_is_stopped_may_tell_no_pose_and_one_that_is_ready_must():
    driver = Brand()
    servo = opened(driver)
    before = servo.state()
    driver.mode, driver.detail = "emergency stop", "pressed"
    driver.state = lambda: DriverState(1.0, driver.mode, None, None, driver.detail)
    stopped = servo.state()
    assert (stopped.mode, stopped.detail) == ("emergency stop", "pressed")
    np.testing.assert_array_equal(stopped.position, before.position)
    with pytest.raises(RefusedError, match="emergency stop: pressed"):
        opened(driver).state()
    driver.mode = "ready"
    with pytest.raises(InstrumentError, match="no pose"):
        servo.state()


def test_a_driver_in_joint_space_needs_a_model():
    with pytest.raises(InputError, match="has no model"):
        opened(Brand(declared(model=None)))


class Player(Brand):
    """One that plays whole plans."""

    def upload(self, targets, period, meanwhile):
        self.plan = targets, period

    def play(self):
        self.calls.append("play")


def test_a_whole_plan_is_handed_over_in_the_drivers_units():
    driver = Player()
    servo = opened(driver)
    state = servo.state()
    position = state.position + np.arange(50)[:, None] * [0.5, 0.0, 0.0]
    rotation = np.broadcast_to(state.rotation, (50, 3, 3))
    servo.upload(position, rotation, 0.02)
    targets, period = driver.plan
    assert period == 0.02
    reached = chain.forward(ARM, np.radians(targets)).position
    np.testing.assert_allclose(reached, position, atol=1e-6)
    servo.play()
    assert driver.calls == ["play"]
    position[30] += [50.0, 0.0, 0.0]
    with pytest.raises(RefusedError, match=r"set-point at 0\.60 s: joint"):
        servo.upload(position, rotation, 0.02)


def test_only_a_driver_that_plays_plans_makes_a_servo_that_does():
    assert not hasattr(opened(Brand()), "upload")


@pytest.mark.parametrize("remedy", ["see tool=N", "; see tool=N", ""])
def test_what_the_driver_advises_is_set_off_from_what_is_wrong(remedy):
    space = JointSpace(ARM, declared(angle="rad", remedy=remedy), None)
    tcp = space.tcp(HOME)
    turn = by_scipy(declared(angle="rad"), tcp.rotation)
    said = np.concatenate([tcp.position + [9.0, 0.0, 0.0], turn])
    with pytest.raises(RefusedError) as refused:
        space.check(HOME, said)
    ending = str(refused.value).split("Euler angles differ")[1]
    assert ending == ("; see tool=N" if remedy else "")

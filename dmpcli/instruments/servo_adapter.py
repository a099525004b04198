"""From a make's driver to the servo that the loops drive: units, orientation forms and spaces.

A driver speaks its controller's units, orientation form and space, and declares which; the loops
speak mm, rad and rotation matrices of the TCP. Nothing is sent that is not a number, out of reach,
or further from the last set-point than a joint can turn in a period.
"""

from collections.abc import Callable

import numpy as np

from dmpcli.arrays import Floats, finite
from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.instruments import pose_forms
from dmpcli.instruments.driver_protocol import (
    DriverInfo,
    DriverState,
    HaltingDriver,
    InverseDriver,
    OutputDriver,
    PlanDriver,
    ServoDriver,
)
from dmpcli.instruments.joint_space import JointSpace
from dmpcli.instruments.protocols import Clock, RobotState, ServoInfo
from dmpcli.kinematics.reachability import Reach
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.wrench import Tool


class PoseServo:
    """A make's driver as a `Servo`.

    Parameters
    ----------
    driver : ServoDriver
    clock : Clock
    tool : Tool, optional
        Flange → TCP of a robot that is driven by its joints; without one the flange is the TCP.
    """

    def __init__(self, driver: ServoDriver, clock: Clock, tool: Tool | None = None) -> None:
        self._driver, self._clock, self._tool = driver, clock, tool
        self._period = 0.0
        self._started = False
        self._sent: Floats | None = None  # joint angles of the last set-point, rad
        self._pose: Pose | None = None

    def open(self) -> ServoInfo:
        """Connect, and check that the controller means what we mean by poses and joint angles.

        Raises
        ------
        InputError
            The driver names no kinematic model, or an unknown one.
        InstrumentError
            The controller cannot be reached, or what it sends makes no sense.
        RefusedError
            It must not be driven, or its poses differ from ours.
        """
        declared = self._declared = self._driver.connect()
        self._space = _joint_space(declared, self._tool)
        said = self._driver.state()
        joints, pose = self._joints_of(said), self._reported(said)
        # Driven by poses, a robot has a TCP of its own, which without a tool file is the one meant.
        known = self._space if declared.space == "joint" or self._tool is None else self._by_model
        if known is not None and joints is not None and pose is not None:
            known.check(joints, pose)
            if isinstance(self._driver, InverseDriver) and self._space is not None:
                self._space.check_inverse(joints, self._theirs)
        return declared

    @property
    def _by_model(self) -> JointSpace | None:
        """The kinematics of the model that the driver names, whatever it is driven by."""
        declared = self._declared
        arm = declared.arm
        return None if arm is None else JointSpace(arm, declared, self._tool)

    @property
    def reach(self) -> Reach | None:
        """The arm and its tool, once open; None for a robot whose kinematics are not known.

        One that is driven by poses is judged only with a tool: what it takes for its TCP is not
        known here otherwise.
        """
        declared = self._declared
        arm = declared.arm
        if arm is None or (declared.space == "pose" and self._tool is None):
            return None
        return Reach(arm, self._tool, declared.base_turn, declared.flange_turn)

    def state(self) -> RobotState:
        """Return the actual pose and mode now.

        Raises
        ------
        InstrumentError
            The controller is silent, or sends what is not a pose.
        RefusedError
            It is not ready and has told no pose yet.
        """
        said = self._driver.state()
        joints = self._joints_of(said)
        if self._space is None:
            reported = self._reported(said)
            pose = None if reported is None else pose_forms.decode(self._declared, reported)
        else:
            pose = None if joints is None else self._space.tcp(joints)
        if pose is None:
            if said.mode == "ready":
                raise self._senseless("no pose")
            if self._pose is None:
                raise RefusedError(f"robot: {said.mode}{said.detail and f': {said.detail}'}")
            pose = self._pose  # an arm that is stopped may tell no pose; it has one
        self._pose = pose
        return RobotState(
            said.t, pose.position, pose.rotation, said.mode, joints, said.detail, said.busy
        )

    def start(self, period: float) -> None:
        """Enter servo mode.

        Raises
        ------
        InstrumentError
            The controller does not take this period, or does not start.
        RefusedError
            It is not ready.
        """
        shortest, longest = self._declared.period_range
        if not shortest <= period <= longest:
            raise InstrumentError(
                f"robot: {self._declared.make} takes a set-point every {shortest:g} to "
                f"{longest:g} s, not every {period:g} s"
            )
        self._driver.start(period)
        self._period, self._started = period, True
        # After the start: arms sink a little when their brakes are released.
        self._sent = self._joints_of(self._driver.state())

    def send(self, position: Floats, rotation: Floats) -> bool:
        """Send one set-point; False when not started, not finite, or not taken.

        Raises
        ------
        RefusedError
            It is out of reach, or a joint would have to turn faster than it can.
        """
        if not self._started:
            return False
        if not finite(position, rotation):
            return False
        if self._space is None:
            return self._driver.send(pose_forms.encode(self._declared, Pose(position, rotation)))
        if self._sent is None:
            raise self._senseless("no joint angles")
        joints = self._space.step(Pose(position, rotation), self._sent, self._period)
        taken = self._driver.send(self._written(joints))
        if taken:
            self._sent = joints
        return taken

    def stop(self) -> None:
        """Leave servo mode and stand still at once."""
        self._started = False
        self._driver.stop()

    def check_output(self, name: str) -> None:
        """Make sure that an output can be switched.

        Raises
        ------
        InputError
            The driver switches none, or none of this name.
        """
        if not isinstance(self._driver, OutputDriver):
            raise InputError(f"robot: its driver switches no outputs, and {name} is one")
        self._driver.output(name)

    def switch(self, name: str, on: bool) -> None:
        """Switch an output; InstrumentError where the controller does not do it."""
        if isinstance(self._driver, OutputDriver):
            self._driver.switch(name, on)

    def halt(self) -> bool:
        """Stop while another call hangs; False where the driver has no way to.

        See `watchdog.Halting`.
        """
        self._started = False
        if not isinstance(self._driver, HaltingDriver):
            return False
        self._driver.halt()
        return True

    def close(self) -> None:
        """Disconnect; stops first."""
        self._started = False
        self._driver.close()

    def _joints_of(self, said: DriverState) -> Floats | None:
        """Actual joint angles, rad."""
        if said.joints is None:
            return None
        if not (said.joints.ndim == 1 and finite(said.joints)):
            raise self._senseless("joint angles that are not numbers")
        if self._space is not None and len(said.joints) != 6:
            raise self._senseless(f"{len(said.joints)} joint angles")
        return self._radians(said.joints)

    def _radians(self, joints: Floats) -> Floats:
        return np.radians(joints) if self._declared.angle == "deg" else joints.copy()

    def _written(self, joints: Floats) -> Floats:
        return np.degrees(joints) if self._declared.angle == "deg" else joints.copy()

    def _reported(self, said: DriverState) -> Floats | None:
        """Pose as the controller writes it."""
        if said.pose is None:
            return None
        if said.pose.shape != (pose_forms.width(self._declared),):
            raise self._senseless(f"a pose of {said.pose.size} numbers")
        if not np.isfinite(said.pose).all():
            raise self._senseless("a pose that is not a number")
        return said.pose

    def _theirs(self, pose: Floats, near: Floats) -> Floats | None:
        """Joint angles of a pose by the controller's inverse kinematics, rad."""
        assert isinstance(self._driver, InverseDriver)
        found = self._driver.inverse(pose, self._written(near))
        if found is None:
            return None
        if not (found.shape == (6,) and finite(found)):
            raise self._senseless("an inverse that is not six numbers")
        return self._radians(found)

    def _senseless(self, what: str) -> InstrumentError:
        return InstrumentError(f"robot: {self._declared.make} sends {what}; check its driver")


class PlanServo(PoseServo):
    """The same for a driver whose controller plays a whole plan by itself."""

    def upload(
        self,
        position: Floats,
        rotation: Floats,
        period: float,
        meanwhile: Callable[[], None] = lambda: None,
    ) -> None:
        """Hand over set-points; each is checked as `send` checks it.

        Parameters
        ----------
        position, rotation : array, shape (n, 3) and (n, 3, 3)
            mm.
        period : float
            From one to the next, s.
        meanwhile : callable
            Called for every set-point; what it raises ends the upload.

        Raises
        ------
        RefusedError
            One is out of reach or needs too fast a joint; named by its time.
        InstrumentError
            The controller does not take them.
        """
        assert isinstance(self._driver, PlanDriver)
        poses = [Pose(*one) for one in zip(position, rotation, strict=True)]
        if self._space is None:
            targets = [pose_forms.encode(self._declared, pose) for pose in poses]
        else:
            targets = self._all_joints(self._space, poses, period, meanwhile)
        self._driver.upload(np.array(targets), period, meanwhile)

    def play(self) -> None:
        """Begin to move."""
        assert isinstance(self._driver, PlanDriver)
        self._driver.play()

    def _all_joints(
        self,
        space: JointSpace,
        poses: list[Pose],
        period: float,
        meanwhile: Callable[[], None],
    ) -> list[Floats]:
        before = self._joints_of(self._driver.state())
        if before is None:
            raise self._senseless("no joint angles")
        targets = []
        for number, pose in enumerate(poses):
            meanwhile()
            try:
                before = space.step(pose, before, period)
            except RefusedError as error:
                raise RefusedError(f"set-point at {number * period:.2f} s: {error}") from None
            targets.append(self._written(before))
        return targets


def servo(driver: ServoDriver, clock: Clock, tool: Tool | None = None) -> PoseServo:
    """Return the servo of a driver: one that plays whole plans where the driver does.

    Parameters
    ----------
    driver : ServoDriver
    clock : Clock
    tool : Tool, optional
    """
    kind = PlanServo if isinstance(driver, PlanDriver) else PoseServo
    return kind(driver, clock, tool)


def _joint_space(declared: DriverInfo, tool: Tool | None) -> JointSpace | None:
    if declared.space == "pose":
        return None
    if declared.arm is None:
        raise InputError(f"robot: {declared.make} is driven by joints, and its driver has no model")
    return JointSpace(declared.arm, declared, tool)

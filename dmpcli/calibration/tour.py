"""The tool through its static poses: turned about its tip by the servo loop of `execute`."""

import signal
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from dmpcli.admittance.payload_identification import check_orientations
from dmpcli.arrays import Floats
from dmpcli.calibration.orientations import around
from dmpcli.calibration.resting import Watcher, at_rest
from dmpcli.control import guards
from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.force_tracking import ForceInput
from dmpcli.control.servo_loop import ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.errors import RefusedError, beside
from dmpcli.instruments.protocols import RobotState
from dmpcli.kinematics.reachability import Reach
from dmpcli.planning import plan as planning
from dmpcli.planning import preflight
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import Plan
from dmpcli.records.static_poses import StaticPose
from dmpcli.settings.calibrate import CalibrateSettings
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.trajectory import StrokeTrajectory

_TRIES = 3


class Interrupted(Exception):  # noqa: N818
    """A signal came, and the arm stands still.

    Attributes
    ----------
    number : int
    """

    def __init__(self, number: int, reason: str) -> None:
        super().__init__(reason)
        self.number = number


class Tour:
    """One way through all poses and back.

    Parameters
    ----------
    arm : ReadyArm
        Ready, not in servo mode.
    sensing : Sensing
        Has heard its first sample.
    settings : CalibrateSettings
    interruption : Interruption
        The first signal decelerates, the second stops at once.
    taken : list of StaticPose
        Filled, and kept whatever ends the tour.
    reach : Reach, optional
        Of an arm whose joints are known: then all poses are checked before anything moves.
    tick : callable
        Called after each pose.
    """

    def __init__(
        self,
        arm: ReadyArm,
        sensing: Sensing,
        settings: CalibrateSettings,
        interruption: Interruption,
        taken: list[StaticPose],
        reach: Reach | None = None,
        tick: Callable[[], None] = lambda: None,
    ) -> None:
        self._arm, self._sensing, self._settings = arm, sensing, settings
        self._interruption, self._taken, self._tick = interruption, taken, tick
        self._reach = reach
        self._watcher = Watcher(arm.servo, arm.clock, sensing)

    def run(self) -> None:
        """Visit every pose, and return to where the tool stood.

        Raises
        ------
        InputError
            The robot does not take the servo period.
        RefusedError
            The arm is not ready, cannot reach a pose, meets an obstacle or does not come to rest.
        InstrumentError
            An instrument fails.
        Interrupted
            A signal came.
        """
        s = self._settings
        state = self._arm.servo.state()
        home = state.pose
        goals = [replace(home, rotation=R) for R in around(state.rotation, s.poses, s.tilt)]
        self._check(state, [home, *goals, home])
        self._at_start = self._sensing.newest.wrench
        for number, goal in enumerate(goals, start=1):
            self._go(goal, f"pose {number}")
            self._taken.append(self._dwell(number))
            self._tick()
        self._go(home, "the way back")

    def _check(self, state: RobotState, stops: list[Pose]) -> None:
        """Refuse before anything moves what would be refused on the way."""
        arm, s = self._arm, self._settings
        guards.check_period(arm.info, s.period, f"--period {s.period:g}")
        guards.check_state(state, s.workspace)
        # The sensor's turn on the flange changes nothing here.
        check_orientations(np.array([stop.rotation for stop in stops[1:-1]]), s.condition)
        if self._reach is None:
            return
        joints = self._reach.standing(state.joints, stops[0])
        for start, goal in pairwise(stops):
            plan, there = self._way(start, goal), self._there(goal)
            checks, joints = preflight.by_joints(plan, there, self._reach, joints)
            for check in checks:
                if not check.passed:
                    value = beside(check.value, check.limit, ".3g")
                    raise RefusedError(
                        f"the arm cannot turn the tool through all poses from here: "
                        f"{check.quantity} {value} {check.unit} is over "
                        f"{check.limit:.3g} {check.unit}; begin in another pose, or give a "
                        "smaller --tilt"
                    )

    def _there(self, goal: Pose) -> StrokeTrajectory:
        """A stroke of one period that stays in a pose."""
        return StrokeTrajectory(
            np.array([0.0, self._settings.period]),
            np.array([goal.position, goal.position]),
            np.array([goal.rotation, goal.rotation]),
            id="pose",
        )

    def _way(self, start: Pose, goal: Pose) -> Plan:
        """Straight to a pose, and one period there."""
        s = self._settings
        speed = _limits(s).speed
        return planning.make(self._there(goal), s.period, 1.0, _limits(s), start, speed)

    def _go(self, goal: Pose, where: str) -> None:
        self._stop_if_asked()
        s, state = self._settings, self._arm.servo.state()
        watch = StopLimits(
            following_error=s.following_error,
            following_angle=s.following_angle,
            force=s.max_force,
            torque=s.max_torque,
        )
        loop = ServoLoop(
            self._way(state.pose, goal),
            _limits(s),
            watch,
            self._arm,
            ForceInput(self._sensing, self._change),
        )
        outcome = loop.run(self._interruption)
        if (error := outcome.error(f"{where}: ")) is not None:
            raise error
        if outcome.signal is not None:
            raise Interrupted(outcome.signal, outcome.reason)

    def _change(self, sensed: Floats, rotation: Floats) -> Floats:  # noqa: ARG002
        """What the loop watches: the payload is not known yet, so its turning counts as force."""
        return sensed - self._at_start

    def _dwell(self, number: int) -> StaticPose:
        s = self._settings
        for _ in range(_TRIES):
            rested = self._watcher.rests(s.settle, s.patience, self._asked)
            self._stop_if_asked()
            if not rested:
                break
            pose = self._watcher.dwell(s.dwell)
            guards.check_state(self._arm.servo.state(), s.workspace)
            if at_rest(pose.moved, pose.turned):
                return pose
        raise RefusedError(f"pose {number}: the arm does not come to rest; see what moves it")

    def _asked(self) -> bool:
        return self._interruption.count > 0

    def _stop_if_asked(self) -> None:
        number = self._interruption.number
        if number is not None:
            raise Interrupted(number, f"{signal.Signals(number).name}: stopped between two poses")


def _limits(settings: CalibrateSettings) -> Limits:
    """Limits of the set-points; the TCP stays where it is but for what the arm strayed."""
    return Limits(
        20.0,
        200.0,
        5000.0,
        settings.max_rotation_speed,
        settings.max_rotation_acceleration,
        settings.max_rotation_jerk,
        settings.workspace,
    )

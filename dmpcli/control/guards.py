"""What no loop may let pass: an arm not ready, lost, late or straying; and how to leave the bench.

A comparison with NaN is false, so every guard here says what it accepts, not what it refuses.
"""

import math
from collections.abc import Callable
from contextlib import ExitStack

import numpy as np

from dmpcli.arrays import Floats, finite
from dmpcli.errors import InputError, InstrumentError, RefusedError, beside
from dmpcli.instruments.protocols import PlanPlayer, RobotState, Servo, ServoInfo
from dmpcli.settings.ranges import Box
from dmpcli.spatial.pose import Pose

LAG = 0.1
"""The actual pose may lag the set-points by this much more than the look-ahead, s."""


def check_streams(robot: Servo) -> None:
    """Refuse a robot that takes no set-points, before it is opened.

    Raises
    ------
    InputError
    """
    if isinstance(robot, PlanPlayer):
        raise InputError("--robot: mode=file only plays whole plans; leave it out")


def check_playing(robot: Servo, allowed: bool) -> None:
    """Refuse a robot that plays a plan by itself, before it is opened, unless that is meant.

    Raises
    ------
    InputError
    """
    if isinstance(robot, PlanPlayer) and not allowed:
        raise InputError(
            "--robot: with mode=file the arm draws on when the link or this computer fails, and "
            "only the pendant and the emergency stop end it then; leave it out, or give "
            "--allow-file-mode if somebody stands there"
        )


def check_ready(state: RobotState) -> None:
    """Refuse to go on where the arm may not move, in the controller's words.

    Raises
    ------
    RefusedError
    """
    if state.mode != "ready":
        why = f" ({state.detail})" if state.detail else ""
        pressed = "release it and " if state.mode == "emergency stop" else ""
        raise RefusedError(
            f"robot: {state.mode}{why}; {pressed}clear it on the pendant and try again"
        )


def check_state(state: RobotState, box: Box | None = None) -> None:
    """Refuse to go on where the arm is not ready, or not where it may be.

    Parameters
    ----------
    state : RobotState
    box : tuple of float, optional
        The workspace.

    Raises
    ------
    RefusedError
        The mode forbids motion, or the tool is outside the workspace.
    InstrumentError
        The pose is not a number.
    """
    check_ready(state)
    check_pose(state)
    check_inside(state.position, box, "the tool")


def check_pose(state: RobotState) -> None:
    """Refuse to believe a pose that is not a number.

    Raises
    ------
    InstrumentError
    """
    if not finite(state.position, state.rotation):
        raise InstrumentError("robot: the pose that it sends is not a number; check its driver")


def check_inside(position: Floats, box: Box | None, what: str) -> None:
    """Refuse a position outside the workspace.

    Parameters
    ----------
    position : array, shape (3,)
        mm.
    box : tuple of float or None
        None is no bound.
    what : str
        Whose position it is, for the message.

    Raises
    ------
    RefusedError
    """
    if box is None:
        return
    for axis, value, low, high in zip("xyz", position.tolist(), box[::2], box[1::2], strict=True):
        if not low <= value <= high:
            text = beside(value, low if value < low else high, ".3f")
            raise RefusedError(
                f"{what} at {axis} = {text} mm leaves the workspace ({low:g} to {high:g} mm)"
            )


def check_setpoint(setpoint: Pose, box: Box | None) -> None:
    """Refuse to send what is not a pose, or one outside the workspace.

    Parameters
    ----------
    setpoint : Pose
    box : tuple of float or None

    Raises
    ------
    RefusedError
    """
    if not finite(setpoint.position, setpoint.rotation):
        raise RefusedError("the next set-point is not a number and was not sent; check settings")
    check_inside(setpoint.position, box, "the next set-point")


def check_wrench(wrench: Floats, force: float, torque: float) -> None:
    """Refuse to go on against more than the tool may meet.

    Parameters
    ----------
    wrench : array, shape (6,)
        On the tool, at the TCP.
    force, torque : float
        The most of either, N and N·m.

    Raises
    ------
    RefusedError
    """
    parts = ((wrench[:3], force, "force", "N"), (wrench[3:], torque, "torque", "N·m"))
    for part, most, name, unit in parts:
        size = math.sqrt(part @ part)
        if not size <= most:
            raise RefusedError(
                f"{name} {beside(size, most, '.3g')} {unit} on the tool is over {most:g} {unit}; "
                f"raise --max-{name} if it may meet that"
            )


def check_period(info: ServoInfo, period: float, asked: str) -> None:
    """Refuse a servo period that the robot does not take.

    Parameters
    ----------
    info : ServoInfo
    period : float
        s.
    asked : str
        How the user asked for it, for the message.

    Raises
    ------
    InputError
    """
    shortest, longest = info.period_range
    if not shortest <= period <= longest:
        raise InputError(
            f"{asked}: the {info.make} robot takes periods of {shortest:g} to {longest:g} s "
            f"({1.0 / longest:g} to {1.0 / shortest:g} Hz), its look-ahead is {info.lookahead:g} s"
        )
    step = info.period_step
    if step > 0.0 and abs(period - step * round(period / step)) > 1e-9:
        raise InputError(
            f"{asked}: the {info.make} robot takes periods of whole multiples of {1e3 * step:g} ms"
        )


def check_late(late: float, info: ServoInfo, period: float) -> None:
    """Refuse a cycle that woke later than half the look-ahead, or than one period if that is more.

    An arm that takes set-points at once has no look-ahead.

    Parameters
    ----------
    late : float
        s after the deadline.
    info : ServoInfo
    period : float
        s.

    Raises
    ------
    RefusedError
    """
    limit = max(info.lookahead / 2.0, period)
    if not late <= limit:
        raise RefusedError(
            f"{beside(1e3 * late, 1e3 * limit, '.0f')} ms late, over {1e3 * limit:g} ms (half the "
            "robot's look-ahead); "
            "use a quieter computer or a longer look-ahead"
        )


class FollowingErrorMonitor:
    """The set-points just sent, which the actual pose must stay near.

    They reach back over the look-ahead and a tenth of a second: what a look-ahead delays is no
    error, what stands still or strays is.

    Parameters
    ----------
    info : ServoInfo
    period : float
        s.
    distance, angle : float
        How far the arm may stray from the nearest of them, mm and rad.

    Attributes
    ----------
    last : tuple of array, or None
        The set-point sent last.
    """

    def __init__(self, info: ServoInfo, period: float, distance: float, angle: float) -> None:
        window = int(np.ceil((info.lookahead + LAG) / period - 1e-9)) + 1
        self._positions, self._rotations = np.zeros((window, 3)), np.zeros((window, 9))
        self._count = 0
        self._distance, self._angle = distance, angle
        self.last: Pose | None = None

    def add(self, setpoint: Pose) -> None:
        """Remember a set-point that was sent."""
        at = self._count % len(self._positions)
        self._positions[at], self._rotations[at] = setpoint.position, setpoint.rotation.ravel()
        self._count += 1
        self.last = setpoint

    def strayed(self, state: RobotState) -> tuple[float, float]:
        """Distance and angle to the nearest set-point, mm and rad; 0 before the first."""
        if self.last is None:
            return 0.0, 0.0
        known = min(self._count, len(self._positions))
        away = self._positions[:known] - state.position
        nearest = float(np.minimum.reduce(np.vecdot(away, away)))
        trace = float(np.maximum.reduce(self._rotations[:known] @ state.rotation.ravel()))
        # In this order a NaN stays one.
        cosine = min(max((trace - 1.0) / 2.0, -1.0), 1.0)
        return math.sqrt(nearest), math.acos(cosine)

    def check(self, state: RobotState) -> None:
        """Refuse to go on where the arm does not follow.

        Raises
        ------
        RefusedError
        """
        distance, angle = self.strayed(state)
        if not (distance <= self._distance and angle <= self._angle):
            raise RefusedError(
                f"following error {beside(distance, self._distance, '.2f')} mm, "
                f"{beside(angle, self._angle, '.3f')} rad is over "
                f"{self._distance:g} mm, {self._angle:g} rad"
            )


def leave(*deeds: Callable[[], None]) -> InstrumentError | None:
    """Do every one of the deeds, in order, whatever any of them raises.

    Parameters
    ----------
    *deeds : callable
        Such as `Servo.stop`, `Servo.close` and `Sensor.close`.

    Returns
    -------
    InstrumentError or None
        The first failure of an instrument; a defect is raised, after the last deed.
    """
    failures: list[InstrumentError] = []

    def attempt(deed: Callable[[], None]) -> None:
        try:
            deed()
        except InstrumentError as failure:
            failures.append(failure)

    with ExitStack() as left:
        for deed in reversed(deeds):
            left.callback(attempt, deed)
    return failures[0] if failures else None

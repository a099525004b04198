"""What is sent in motion: no step but one that the checks before the motion would have passed."""

import math

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.control import guards
from dmpcli.errors import RefusedError, beside
from dmpcli.instruments.protocols import RobotState
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import Plan
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import log_one

# The arm may be so far from the first set-point, mm and rad: brakes that are released let it sink
# a little. Nor further than it may go in a period, but for the noise of an arm at rest.
_START_DISTANCE, _START_ANGLE = 0.5, 0.005
_NOISE_DISTANCE, _NOISE_ANGLE = 0.02, 0.001
# Between two checked set-points the brake's curve may be faster than either by this share, and
# accelerate more, with what the force coupling adds.
_SLACK, _ACCELERATION_SLACK = 0.01, 0.1


def check_start(state: RobotState, plan: Plan, limits: Limits) -> None:
    """Refuse to begin where the arm does not stand at the plan's first set-point.

    Parameters
    ----------
    state : RobotState
        Read last before the first set-point.
    plan : Plan
    limits : Limits

    Raises
    ------
    RefusedError
        It has moved since the plan was made, or is not ready.
    InstrumentError
        Its pose is not a number.
    """
    guards.check_state(state, limits.workspace)
    distance, angle = state.pose.apart(plan.at(0))
    far = min(_START_DISTANCE, max(limits.speed * plan.period, _NOISE_DISTANCE))
    turned = min(_START_ANGLE, max(limits.rotation_speed * plan.period, _NOISE_ANGLE))
    if not (distance <= far and angle <= turned):
        raise RefusedError(
            f"the arm stands {beside(distance, far, '.3g')} mm, "
            f"{beside(angle, turned, '.3g')} rad from the first set-point, over "
            f"{far:.2g} mm, {turned:.2g} rad: it has moved since it was checked; run it again"
        )


class StepLimits:
    """The steps from one set-point to the next.

    Parameters
    ----------
    limits : Limits
    period : float
        s.
    """

    def __init__(self, limits: Limits, period: float) -> None:
        self._limits, self._period = limits, period
        self._step: Floats = np.zeros(6)

    def check(self, before: Pose | None, setpoint: Pose) -> None:
        """Refuse to send what the checks before the motion cannot have seen.

        Parameters
        ----------
        before : Pose or None
            The set-point sent last.
        setpoint : Pose
            The next one.

        Raises
        ------
        RefusedError
        """
        guards.check_setpoint(setpoint, self._limits.workspace)
        if before is None:
            return
        position, rotation = setpoint.position, setpoint.rotation
        period, limits = self._period, self._limits
        step = np.concatenate([position - before.position, log_one(rotation @ before.rotation.T)])
        speed, turning = _sizes(step / period)
        if not (
            speed <= (1.0 + _SLACK) * limits.speed
            and turning <= (1.0 + _SLACK) * limits.rotation_speed
        ):
            raise RefusedError(
                f"the next set-point would take {beside(speed, limits.speed, '.4g')} mm/s, "
                f"{beside(turning, limits.rotation_speed, '.3g')} rad/s, over "
                f"{limits.speed:g} mm/s, {limits.rotation_speed:g} rad/s"
            )
        gain, twist = _sizes((step - self._step) / period**2)
        if not (
            gain <= (1.0 + _ACCELERATION_SLACK) * limits.acceleration
            and twist <= (1.0 + _ACCELERATION_SLACK) * limits.rotation_acceleration
        ):
            raise RefusedError(
                f"the next set-point would take {beside(gain, limits.acceleration, '.4g')} mm/s², "
                f"{beside(twist, limits.rotation_acceleration, '.3g')} rad/s², over "
                f"{limits.acceleration:g} mm/s², {limits.rotation_acceleration:g} rad/s²"
            )
        self._step = step


def _sizes(step: Floats) -> tuple[float, float]:
    """Length of the first three numbers, and of the others."""
    return math.sqrt(step[:3] @ step[:3]), math.sqrt(step[3:] @ step[3:])

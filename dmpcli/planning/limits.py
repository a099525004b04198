"""What the arm may do."""

from dataclasses import dataclass

from dmpcli.settings.execute import ExecuteSettings
from dmpcli.settings.ranges import Box


@dataclass(frozen=True)
class Limits:
    """Limits of the set-points at the servo period.

    Attributes
    ----------
    speed, acceleration, jerk : float
        Of the TCP, mm/s, mm/s², mm/s³.
    rotation_speed, rotation_acceleration, rotation_jerk : float
        rad/s, rad/s², rad/s³.
    workspace : Box or None
    """

    speed: float
    acceleration: float
    jerk: float
    rotation_speed: float
    rotation_acceleration: float
    rotation_jerk: float
    workspace: Box | None = None


def limits_of(settings: ExecuteSettings) -> Limits:
    """Return the limits that the settings of a run state."""
    return Limits(
        settings.max_speed,
        settings.max_acceleration,
        settings.max_jerk,
        settings.max_rotation_speed,
        settings.max_rotation_acceleration,
        settings.max_rotation_jerk,
        settings.workspace,
    )

"""What the arm may do."""

from dataclasses import dataclass

from dmpcli.instruments.guards import Box


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

"""What the arm may do."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Limits of the set-points at the servo period.

    Attributes
    ----------
    speed, acceleration, jerk : float
        Of the TCP, mm/s, mm/s², mm/s³.
    rotation_speed, rotation_acceleration, rotation_jerk : float
        rad/s, rad/s², rad/s³.
    workspace : tuple of float, or None
        xmin, xmax, ymin, ymax, zmin, zmax, mm, base frame.
    """

    speed: float
    acceleration: float
    jerk: float
    rotation_speed: float
    rotation_acceleration: float
    rotation_jerk: float
    workspace: tuple[float, float, float, float, float, float] | None = None

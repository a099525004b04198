"""What the arm may do."""

from dataclasses import dataclass

Box = tuple[float, float, float, float, float, float]
"""xmin, xmax, ymin, ymax, zmin, zmax, mm, base frame."""


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


def ordered(box: Box) -> Box:
    """Return a workspace whose minima lie below its maxima.

    Raises
    ------
    ValueError
        They do not.
    """
    if not all(low < high for low, high in zip(box[::2], box[1::2], strict=True)):
        raise ValueError("each minimum of the workspace must lie below its maximum")
    return box

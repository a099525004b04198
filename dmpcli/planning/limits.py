"""What the arm may do."""

from dataclasses import dataclass

from dmpcli.arrays import Floats
from dmpcli.errors import RefusedError, beside

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

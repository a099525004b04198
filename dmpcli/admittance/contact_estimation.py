"""What a landing tells of a contact: how stiff it is, and how late its force is felt.

The tool comes down at an even speed, feels the surface, and stops. While it went on, the force rose
by k for every millimetre, however late it was felt; two resting points give k without any delay.
By how much the force lags a move from one to the other is the delay of the whole loop.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Line:
    """Least squares of force over depth, ``F = offset + slope·depth``.

    Attributes
    ----------
    slope : float
        N/mm.
    offset : float
        N.
    deviation : float
        Standard deviation of the slope, N/mm; infinite below three points.
    """

    slope: float
    offset: float
    deviation: float


def line(depth: Sequence[float], force: Sequence[float]) -> Line:
    """Fit a line to what was felt on the way in.

    Parameters
    ----------
    depth, force : sequence of float
        Depth to which the tool had been led, mm, and the force along the normal, N.
    """
    n = len(depth)
    if n < 2:
        return Line(0.0, force[0] if force else 0.0, math.inf)
    x, y = sum(depth) / n, sum(force) / n
    xx = sum((d - x) ** 2 for d in depth)
    if xx <= 0.0:
        return Line(0.0, y, math.inf)
    slope = sum((d - x) * (f - y) for d, f in zip(depth, force, strict=True)) / xx
    left = sum((f - y - slope * (d - x)) ** 2 for d, f in zip(depth, force, strict=True))
    deviation = math.sqrt(left / (n - 2) / xx) if n > 2 else math.inf
    return Line(slope, y - slope * x, deviation)


def delay_of_move(
    way: Sequence[tuple[float, float]],
    rested: tuple[tuple[float, float], tuple[float, float]],
    period: float,
) -> float:
    """Delay from a displacement to its force, s, of a move from one resting point to another.

    Whatever the move's profile, and whether what follows it is a lag or a dead time: the area
    between what was led and what was felt is the delay times the move.

    Parameters
    ----------
    way : sequence of tuple of float
        Depth to which the tool had been led, mm, and force felt, N, of each cycle from the move's
        begin to the second rest's end.
    rested : tuple of two points
        Depth and force at rest before and after.
    period : float
        s.
    """
    (depth, force), (after, pressed) = rested
    if after == depth or pressed == force:
        return 0.0
    softness = (after - depth) / (pressed - force)
    area = sum(d - depth - softness * (f - force) for d, f in way) * period
    return max(area / (after - depth), 0.0)


def static_stiffness(
    depths: tuple[float, float], forces: tuple[float, float], least: float
) -> float | None:
    """Stiffness between two resting points, N/mm; None where they lie too near to tell.

    Parameters
    ----------
    depths : tuple of float
        mm.
    forces : tuple of float
        N.
    least : float
        By how much the forces must differ, N.
    """
    pressed, rise = depths[1] - depths[0], forces[1] - forces[0]
    if abs(rise) < least or pressed * rise <= 0.0:
        return None
    return rise / pressed


class RiseTest:
    """Whether a force that is too small rises as the tool goes after it: a contact, or an offset.

    A reading that stays while the tool moves in by more than what is missing is no surface.

    Parameters
    ----------
    slack : float
        mm that the tool moves in for nothing before it is doubted: lost motion and noise.
    """

    def __init__(self, slack: float) -> None:
        self._slack = slack
        self._from: tuple[float, float] | None = None

    def believed(self, force: float, wanted: float, depth: float, stiffness: float) -> bool:
        """Take in one cycle.

        Parameters
        ----------
        force, wanted : float
            Felt and wanted along the normal, N.
        depth : float
            To which the tool is led, mm.
        stiffness : float
            Of the contact, N/mm.
        """
        if force >= 0.5 * wanted:
            self._from = None
            return True
        if self._from is None:
            self._from = (force, depth)
            return True
        before, since = self._from
        moved = depth - since
        if moved <= 2.0 * (wanted - before) / stiffness + self._slack:
            return True
        return force - before >= 0.25 * stiffness * moved

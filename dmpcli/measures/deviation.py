"""How far one stroke lies from another, once start and goal are laid upon each other."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats

# Pairs of point and segment held at once: temporaries of 256 kB stay in the processor's cache.
_BLOCK = 32_000


@dataclass(frozen=True)
class Deviation:
    """Distances of a stroke from its reference, mm.

    Attributes
    ----------
    nearest_rms, nearest_max : float
        To the nearest point of the reference: the drawn shape, whatever the timing.
    phase_rms, phase_max : float
        To the reference's point at the same share of the duration.
    """

    nearest_rms: float
    nearest_max: float
    phase_rms: float
    phase_max: float


def carried(
    position: Floats,
    origin: Floats,
    axes: Floats,
    new_origin: Floats,
    new_axes: Floats,
    stretch: float = 1.0,
) -> Floats:
    """Carry a stroke rigidly from one chart to another, stretched along start-goal alone.

    Parameters
    ----------
    position : array, shape (n, 3)
        mm, base frame.
    origin, new_origin : array, shape (3,)
        Start of the stroke, and where it shall lie, mm.
    axes, new_axes : array, shape (3, 3)
        Unit vectors along, across and off the plane as columns.
    stretch : float
        Ratio of the start-goal distances, new to old.

    Returns
    -------
    array, shape (n, 3)
        mm, base frame.
    """
    task = (position - origin) @ axes
    return np.asarray(new_origin + (task * [stretch, 1.0, 1.0]) @ new_axes.T)


def deviation(t: Floats, position: Floats, t_reference: Floats, reference: Floats) -> Deviation:
    """Deviation of a stroke from a reference that already lies where the stroke lies.

    Parameters
    ----------
    t : array, shape (n,)
        s.
    position : array, shape (n, 3)
        mm.
    t_reference : array, shape (m,)
    reference : array, shape (m, 3)
        m ≥ 2.
    """
    nearest = nearest_distance(position, reference)
    phase = (t - t[0]) / (t[-1] - t[0])
    phase_reference = (t_reference - t_reference[0]) / (t_reference[-1] - t_reference[0])
    same = np.column_stack([np.interp(phase, phase_reference, column) for column in reference.T])
    apart = np.linalg.norm(position - same, axis=1)
    return Deviation(_rms(nearest), float(nearest.max()), _rms(apart), float(apart.max()))


def nearest_rms(points: Floats, polyline: Floats) -> float:
    """Root mean square of `nearest_distance`, in the points' unit."""
    return _rms(nearest_distance(points, polyline))


def nearest_distance(points: Floats, polyline: Floats) -> Floats:
    """Distance of each point to the nearest point of a polyline; segments count, not only corners.

    Parameters
    ----------
    points : array, shape (n, d)
    polyline : array, shape (m, d)
        m ≥ 2; corners may coincide.

    Returns
    -------
    array, shape (n,)
    """
    # About the polyline's middle the expanded squares below lose fewer digits; they only choose
    # the segment, the distance itself is then taken directly.
    middle = polyline.mean(axis=0)
    points, polyline = points - middle, polyline - middle
    a, b = polyline[:-1], np.diff(polyline, axis=0)
    bb = np.einsum("md,md->m", b, b)
    safe = np.where(bb > 0.0, bb, 1.0)
    ab, aa = np.einsum("md,md->m", a, b), np.einsum("md,md->m", a, a)
    rows = max(1, _BLOCK // len(a))
    result = np.empty(len(points))
    for first in range(0, len(points), rows):
        p = points[first : first + rows]
        along = p @ b.T - ab
        share = np.clip(along / safe, 0.0, 1.0)
        squared = aa - 2.0 * (p @ a.T) + share * (share * bb - 2.0 * along)
        best = np.argmin(squared, axis=1)
        foot = a[best] + share[np.arange(len(p)), best, None] * b[best]
        result[first : first + rows] = np.linalg.norm(p - foot, axis=1)
    return result


def _rms(distance: Floats) -> float:
    return float(np.sqrt(np.mean(distance**2)))

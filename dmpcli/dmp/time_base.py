"""From time stamps as they come to an even grid: bursts merged, gaps filled and told.

The shape-preserving interpolation (PCHIP) is scipy's: between samples it never leaves their range,
so that noise on unequal steps does not swing up.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.dmp import smoothing
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory

# Stamps closer than this part of the usual step came in one burst, which spans at most as much.
_BURST = 0.25
_SPAN = 0.5
# Stamps come in bursts altogether when short steps and long ones differ by this factor, short ones
# take less than this part of the time, and there are so many long ones.
_FACTOR = 5.0
_SHORT_SHARE = 0.2
_LONG_STEPS = 8
# Steps without a sample, in usual ones, that are told.
_GAP = 5.0


@dataclass(frozen=True)
class TimeBase:
    """A recording on an even grid.

    Attributes
    ----------
    stroke : Trajectory
        Even, from t = 0.
    origin : float
        Time of its first sample in the recording, s.
    gaps : tuple of (float, float)
        Times between which samples were missing, of the recording, s.
    merged : int
        Samples that bursts lost by being averaged.
    resampled : bool
        Whether the steps were uneven, so that samples were interpolated.
    """

    stroke: Trajectory
    origin: float
    gaps: tuple[tuple[float, float], ...]
    merged: int
    resampled: bool


def even(stroke: Trajectory) -> TimeBase:
    """Bring a recording to an even grid at its usual rate.

    Even recordings keep their samples to the last bit. Otherwise the samples of a burst become
    their mean, and positions follow PCHIP, rotations the shortest arcs.

    Parameters
    ----------
    stroke : Trajectory
        At least two samples, times increasing.

    Returns
    -------
    TimeBase
    """
    origin = float(stroke.t[0])
    if smoothing.is_even(stroke.t):
        return TimeBase(smoothing.evenly_sampled(stroke), origin, (), 0, False)
    usual = _usual_step(np.diff(stroke.t))
    merged = _merged(stroke, usual)
    lost = len(stroke.t) - len(merged.t)
    steps = np.diff(merged.t)
    step = float(np.median(steps))
    gaps = tuple(
        (float(merged.t[i]), float(merged.t[i + 1])) for i in np.flatnonzero(steps > _GAP * step)
    )
    origin = float(merged.t[0])
    if smoothing.is_even(merged.t):
        return TimeBase(smoothing.evenly_sampled(merged), origin, gaps, lost, False)
    from scipy.interpolate import PchipInterpolator

    t = merged.t - origin
    grid = np.linspace(0.0, t[-1], round(float(t[-1]) / step) + 1)
    position = np.asarray(PchipInterpolator(t, merged.position, axis=0)(grid))
    R = merged.rotation
    rotation = None if R is None else rotations.interpolate(t, R, grid)
    force = merged.contact_force
    if force is not None:
        force = np.asarray(PchipInterpolator(t, force, axis=0)(grid))
    stroke = Trajectory(grid, position, rotation, contact_force=force)
    return TimeBase(stroke, origin, gaps, lost, True)


def _usual_step(steps: Floats) -> float:
    """Step between samples, or between bursts where the stamps come in bursts altogether."""
    ordered = np.sort(steps)
    ratios = ordered[1:] / np.maximum(ordered[:-1], 1e-12)
    if len(ratios) > 0:
        at = int(np.argmax(ratios)) + 1
        long = len(ordered) - at
        short_share = float(ordered[:at].sum() / ordered.sum())
        if ratios[at - 1] >= _FACTOR and long >= _LONG_STEPS and short_share <= _SHORT_SHARE:
            return float(np.median(ordered[at:]))
    return float(np.median(steps))


def _merged(stroke: Trajectory, usual: float) -> Trajectory:
    """Average the samples of every burst."""
    starts = _bursts(stroke.t, usual)
    if len(starts) == len(stroke.t):
        return stroke
    counts = np.diff(np.append(starts, len(stroke.t)))
    t = stroke.t[0] + np.add.reduceat(stroke.t - stroke.t[0], starts) / counts
    position = np.add.reduceat(stroke.position, starts, axis=0) / counts[:, None]
    rotation = None
    if stroke.rotation is not None:
        q = continuous_quaternions(stroke.rotation)
        rotation = rotations.from_quaternion(np.add.reduceat(q, starts, axis=0))
    force = stroke.contact_force
    if force is not None:
        force = np.add.reduceat(force, starts, axis=0) / counts[:, None]
    return Trajectory(t, position, rotation, contact_force=force)


def _bursts(t: Floats, usual: float) -> Integers:
    """First sample of every burst, where a sample on its own is one too."""
    begins = np.concatenate([[True], np.diff(t) >= _BURST * usual])
    first = np.flatnonzero(begins)
    since = t - t[first[np.cumsum(begins) - 1]]
    # A faster stretch of a recording is no burst: it is thinned out, not put in one place.
    piece = np.floor(since / (_SPAN * usual)).astype(np.int64)
    begins[1:] |= np.diff(piece) != 0
    return np.flatnonzero(begins)


def continuous_quaternions(R: Floats) -> Floats:
    """Quaternions (x, y, z, w) of a path of rotations (T, 3, 3), signs without a jump, (T, 4)."""
    q = rotations.to_quaternion(R)
    turns = np.where(np.einsum("ij,ij->i", q[1:], q[:-1]) < 0.0, -1.0, 1.0)
    q[1:] *= np.cumprod(turns)[:, None]
    return q

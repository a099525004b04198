"""How far along its path a stroke is at each time, and when it is at each place."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Floats, Integers

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

# A monotone cubic's slopes are at most this many times the chords beside them (Fritsch and
# Carlson, SIAM J. Numer. Anal. 17(2), 1980, 238-246).
_STEEPEST = 3.0
# A place is met to this part of the length.
_SETTLED = 1e-12
_ROUNDS = 60


@dataclass(frozen=True)
class TimeLaw:
    """A monotone function of time: piecewise cubic, with a continuous derivative.

    Attributes
    ----------
    t : array, shape (K,)
        Increasing, s.
    s : array, shape (K,)
        Non-decreasing; arc length, mm.
    speed : array, shape (K,)
        ds/dt at t, at least 0.
    """

    t: Floats
    s: Floats
    speed: Floats

    @property
    def length(self) -> float:
        """Arc length of the whole path, mm."""
        return float(self.s[-1])

    @property
    def duration(self) -> float:
        """Seconds from the first to the last sample."""
        return float(self.t[-1])

    def place(self, t: Floats) -> tuple[Floats, Floats]:
        """Arc length and speed at times.

        Parameters
        ----------
        t : array, shape (M,)
            Within the law's own, s.

        Returns
        -------
        s, speed : array, shape (M,)
            Of the units of `s`, and per second.
        """
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 2)
        h = self.t[k + 1] - self.t[k]
        s, slope = self._cubic(k, (t - self.t[k]) / h)
        return s, slope / h

    def time(self, s: Floats) -> Floats:
        """Time at which the path is at arc length `s`; the earliest one where it stands still.

        Parameters
        ----------
        s : array, shape (M,)
            From 0 to `length`, mm.

        Returns
        -------
        array, shape (M,)
            s.
        """
        s = np.asarray(np.clip(s, 0.0, self.length))
        k = np.clip(np.searchsorted(self.s, s, side="left") - 1, 0, len(self.s) - 2)
        rise = self.s[k + 1] - self.s[k]
        low, high = np.zeros(len(s)), np.ones(len(s))
        # The parabola with the interval's first slope is a close guess.
        rest = s - self.s[k]
        slope = (self.t[k + 1] - self.t[k]) * self.speed[k]
        root = slope + np.sqrt(np.maximum(slope**2 + 4.0 * (rise - slope) * rest, 0.0))
        r = np.clip(2.0 * rest / np.where(root > 0.0, root, 1.0), 0.0, 1.0)
        # Newton's step where it stays between the bounds, else bisection: slopes may be 0 at stops.
        left = np.arange(len(s))
        for _ in range(_ROUNDS):
            value, slope = self._cubic(k[left], r[left])
            off = value - s[left]
            far = np.abs(off) > _SETTLED * self.length
            if not np.any(far):
                break
            left, off, slope = left[far], off[far], slope[far]
            high[left] = np.where(off > 0.0, r[left], high[left])
            low[left] = np.where(off > 0.0, low[left], r[left])
            step = r[left] - off / np.where(slope > 0.0, slope, 1.0)
            inside = (slope > 0.0) & (step >= low[left]) & (step <= high[left])
            r[left] = np.where(inside, step, 0.5 * (low[left] + high[left]))
        return np.asarray(self.t[k] + r * (self.t[k + 1] - self.t[k]))

    def _cubic(self, k: Integers, r: Floats) -> tuple[Floats, Floats]:
        """Value and derivative by r in interval k, at its share r from 0 to 1."""
        h = self.t[k + 1] - self.t[k]
        rise = self.s[k + 1] - self.s[k]
        a, b = h * self.speed[k], h * self.speed[k + 1]
        two, three = a + b - 2.0 * rise, 3.0 * rise - 2.0 * a - b
        value = self.s[k] + r * (a + r * (three + r * two))
        return value, a + r * (2.0 * three + 3.0 * r * two)


def monotone(t: Floats, s: Floats, speed: Floats) -> TimeLaw:
    """A law through the given values, its slopes held where the cubic would turn back.

    Parameters
    ----------
    t, s, speed : array, shape (K,)
        As of `TimeLaw`.

    Returns
    -------
    Law
    """
    chord = np.diff(s) / np.diff(t)
    bound = np.minimum(np.append(chord, np.inf), np.append(np.inf, chord))
    return TimeLaw(t, s, np.clip(speed, 0.0, _STEEPEST * bound))


def of_path(path: "BSpline", t: Floats) -> TimeLaw:
    """Arc length of a path by time.

    Simpson's rule over the speed: the error is of the fourth order in the step.

    Parameters
    ----------
    path : BSpline
        Position by time, of D coordinates, mm.
    t : array, shape (K,)
        Even, from 0, s; the law's nodes.

    Returns
    -------
    Law
    """
    fine = np.empty(2 * len(t) - 1)
    fine[::2] = t
    fine[1::2] = 0.5 * (t[:-1] + t[1:])
    speed = np.linalg.norm(path(fine, 1), axis=1)
    steps = (speed[:-2:2] + 4.0 * speed[1::2] + speed[2::2]) * (np.diff(t) / 6.0)
    return monotone(t, np.append(0.0, np.cumsum(steps)), speed[::2])

"""How many strokes that share their times lie on a surface: `on_surface` for B of them at once.

Each figure is that of the stroke alone; no stroke knows of those beside it.
"""

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.spatial.vectors import cross, dot, length

if TYPE_CHECKING:
    from dmpcli.metrics.kernels.polyline import Polyline

_REACH = 8
"""Samples of the demonstration looked at on either side of the one of the same phase."""

_AT_ONCE = 1 << 18
"""Pairs of point and sample worked on at once."""

_LEVEL = 1e-12
"""Heights that differ by no more than this differ by rounding alone, mm."""


class TaughtHeights:
    """Heights of a demonstration at the places of strokes; see `on_surface.height_there`.

    Parameters
    ----------
    phase : array, shape (m,)
        0 to 1, increasing.
    place : array, shape (m, 3)
        u, v, w as drawn, mm; m ≥ 2.
    compiled : bool
        Whether kernels look for them: the same but for rounding.
    """

    def __init__(self, phase: Floats, place: Floats, compiled: bool = False) -> None:
        self.phase, self.place, self.compiled = phase, place, compiled

    @cached_property
    def _clear(self) -> Floats:
        return self._clearance(_REACH)

    @cached_property
    def _curve(self) -> "tuple[Polyline, Floats]":
        """What kernels search, and the clearance of its corners beyond each reach."""
        from dmpcli.metrics.kernels import polyline

        clear = np.stack([self._clearance(reach) for reach in polyline.REACHES])
        return polyline.curve(self.place), clear

    def _clearance(self, reach: int) -> Floats:
        """Least distance of each sample to those beyond a reach, shape (m,), mm."""
        m = len(self.place)
        clear = np.empty(m)
        rows = max(1, _AT_ONCE // m)
        for first in range(0, m, rows):
            at = np.arange(first, min(first + rows, m))
            apart = np.hypot(*(self.place[at, None, :2] - self.place[:, :2]).transpose(2, 0, 1))
            apart[np.abs(at[:, None] - np.arange(m)) <= reach] = np.inf
            clear[at] = apart.min(axis=1)
        return clear

    def at(self, phase: Floats, uv: Floats, stretch: Floats) -> Floats:
        """Heights w where the stretched demonstration passes nearest, shape (B, n), mm.

        Parameters
        ----------
        phase : array, shape (n,)
            Of the samples.
        uv : array, shape (2, B, n)
            mm.
        stretch : array, shape (B,)
            Of u.
        """
        w = self.place[:, 2]
        if np.ptp(w) <= _LEVEL:
            return np.full(uv.shape[1:], w[0])
        if self.compiled:
            from dmpcli.metrics.kernels import polyline

            found = np.empty(uv.shape[1:])
            polyline.heights_there(*self._curve, np.ascontiguousarray(uv), stretch, found)
            return found
        nearest = self._nearest(phase, uv, stretch)
        u, v = uv
        # Beside the nearest sample on the nearer of its two segments: a lift is steep.
        best, found = np.full(u.shape, np.inf), w[nearest]
        for first in (np.maximum(nearest - 1, 0), np.minimum(nearest, len(w) - 2)):
            (u0, v0, w0), (u1, v1, w1) = self.place[first].T, self.place[first + 1].T
            u0, u1 = (stretch * u0).T, (stretch * u1).T
            du, dv, gu, gv = u1 - u0, v1.T - v0.T, u - u0, v - v0.T
            size = np.maximum(du * du + dv * dv, 1e-300)
            share = np.clip((gu * du + gv * dv) / size, 0.0, 1.0)
            apart = np.hypot(gu - share * du, gv - share * dv)
            nearer = apart < best
            best = np.where(nearer, apart, best)
            found = np.where(nearer, w0.T + share * (w1 - w0).T, found)
        return np.asarray(found)

    def _nearest(self, phase: Floats, uv: Floats, stretch: Floats) -> Integers:
        """The nearest samples (B, n), the first of several.

        Those about the same phase are looked at; where the clearance does not rule out the others,
        all of them.
        """
        m, (u, v), wide = len(self.place), uv, stretch[:, None]
        corner = np.rint(np.interp(phase, self.phase, np.arange(m))).astype(np.int64)
        best, nearest = np.full(u.shape, np.inf), np.zeros(u.shape, dtype=np.int64)
        for by in range(-_REACH, _REACH + 1):
            there = np.clip(corner + by, 0, m - 1)
            gu, gv = u - wide * self.place[there, 0], v - self.place[there, 1]
            off = gu * gu + gv * gv
            nearer = off < best
            best = np.where(nearer, off, best)
            nearest = np.where(nearer, there, nearest)
        here = np.hypot(u - wide * self.place[corner, 0], v - self.place[corner, 1])
        room = np.minimum(wide, 1.0) * self._clear[corner]
        # With what rounding may add up to, and more.
        stroke, sample = np.nonzero(here + np.sqrt(best) > room * (1.0 - 1e-9) - 1e-9)
        rows = max(1, _AT_ONCE // m)
        for first in range(0, len(stroke), rows):
            b, i = stroke[first : first + rows], sample[first : first + rows]
            gu = u[b, i, None] - stretch[b, None] * self.place[:, 0]
            gv = v[b, i, None] - self.place[:, 1]
            nearest[b, i] = np.argmin(gu * gu + gv * gv, axis=1)
        return nearest


def heights(position: Floats, foot: Floats, normal: Floats) -> Floats:
    """Signed distances (B, n) of points to their feet, (B, n, 3) each; see `on_surface.height`."""
    gap = position - foot
    side = np.where(dot(gap, normal)[..., 0] < 0.0, -1.0, 1.0)
    return np.asarray(side * length(gap)[..., 0])


def tilts(up: Floats, normal: Floats) -> Floats:
    """Angles between tools from their tips upwards and normals, rad.

    Parameters
    ----------
    up : array, shape (B, n, 3)
        -R e_z.
    normal : array, shape (B, n, 3) or (B, 1, 3)
        On the tool's side.

    Returns
    -------
    array, shape (B, n)
    """
    return np.asarray(np.arctan2(length(cross(up, normal))[..., 0], dot(up, normal)[..., 0]))


def path_lengths(foot: Floats) -> Floats:
    """Lengths of polylines (B, n, 3), shape (B,), mm."""
    return np.asarray(length(np.diff(foot, axis=1))[..., 0].sum(axis=1))


def stretched_lengths(place: Floats, stretch: Floats) -> Floats:
    """Lengths of one polyline whose u is stretched, mm.

    Parameters
    ----------
    place : array, shape (m, 2)
        u, v of its corners, mm.
    stretch : array, shape (B,)
        Factors of u.

    Returns
    -------
    array, shape (B,)
    """
    du, dv = np.diff(place, axis=0).T
    return np.asarray(np.hypot(stretch[:, None] * du, dv).sum(axis=1))

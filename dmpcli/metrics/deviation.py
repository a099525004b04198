"""How far strokes lie from a demonstration, each once start and goal are laid upon each other.

Many strokes are compared without a loop over them and without looking at every segment: what is
known of the demonstration's clearance says which ones cannot be the nearest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from dmpcli.arrays import Floats, Integers

if TYPE_CHECKING:
    from dmpcli.metrics.kernels.polyline import Polyline

# Pairs of point and segment held at once: temporaries of 256 kB stay in the processor's cache.
_BLOCK = 32_000

_REACHES = (1, 2, 4, 8, 16, 32, 64)
"""Segments looked at on either side of a corner: as few as are sure to hold the nearest one."""

_FIRST, _MOST, _SHIFTS = 2, 64, 2
_ROUGH = 1e-8
"""Squared distances below this, and of far corners, are taken again without cancellation, mm²."""

_FEW = 4
"""Fewer strokes than this are compared with every segment."""

_AT_ONCE = 1 << 15
"""Pairs of point and segment worked on at once."""


@dataclass(frozen=True)
class Deviations:
    """Distances of B strokes from the demonstration, shape (B,) each, mm.

    Attributes
    ----------
    nearest_rms, nearest_max : array
        To the nearest point of the demonstration: the drawn shape, whatever the timing.
    phase_rms, phase_max : array
        To the demonstration's point at the same share of the duration.
    """

    nearest_rms: Floats
    nearest_max: Floats
    phase_rms: Floats
    phase_max: Floats


class Taught:
    """A demonstration that strokes are compared with, in its own chart.

    Parameters
    ----------
    t : array, shape (m,)
        Increasing, s; m ≥ 2.
    place : array, shape (m, 3)
        u, v, w from its start, mm.
    compiled : bool
        Whether kernels compare strokes with it: the same but for rounding.
    """

    def __init__(self, t: Floats, place: Floats, compiled: bool = False) -> None:
        self.phase = (t - t[0]) / (t[-1] - t[0])
        self.place = place
        self.compiled = compiled

    @cached_property
    def _clear(self) -> list[Floats]:
        return _clearance(self.place)

    @cached_property
    def _filled(self) -> Floats:
        return np.pad(self.place, ((_MOST, _MOST), (0, 0)), mode="edge").T.copy()

    def deviations(self, t: Floats, place: Floats, stretch: Floats) -> Deviations:
        """Deviations of B strokes that share their times.

        Parameters
        ----------
        t : array, shape (n,)
            s.
        place : array, shape (3, B, n)
            u, v, w of each stroke from its start, mm.
        stretch : array, shape (B,)
            Their start-goal distances over the demonstration's; 1 for closed strokes.
        """
        phase = (t - t[0]) / (t[-1] - t[0])
        same = np.stack([np.interp(phase, self.phase, column) for column in self.place.T])
        if self.compiled:
            return self._walked(same, place, stretch)
        u, v, w = place
        apart = np.sqrt(
            (u - stretch[:, None] * same[0]) ** 2 + (v - same[1]) ** 2 + (w - same[2]) ** 2
        )
        if len(stretch) < _FEW:
            # What the clearance spares would not pay for finding it.
            pairs = zip(place.transpose(1, 2, 0), stretch, strict=True)
            nearest = np.stack([nearest_distance(p, self.place * [s, 1.0, 1.0]) for p, s in pairs])
        else:
            nearest = self._nearest(phase, place, stretch)
        return Deviations(_rms(nearest), nearest.max(axis=1), _rms(apart), apart.max(axis=1))

    @cached_property
    def _curve(self) -> "tuple[Polyline, Floats]":
        """What kernels search, and the clearance of its corners beyond each reach."""
        from dmpcli.metrics.kernels import polyline

        return polyline.curve(self.place), np.stack(_clearance(self.place, polyline.REACHES))

    def _walked(self, same: Floats, place: Floats, stretch: Floats) -> Deviations:
        """Deviations by kernels; `same` are the demonstration's places (3, n) at the phases."""
        from dmpcli.metrics.kernels import polyline

        curve, clear = self._curve
        out = np.empty((4, len(stretch)))
        polyline.deviations(curve, clear, same, np.ascontiguousarray(place), stretch, out)
        return Deviations(*out)

    def _nearest(self, phase: Floats, place: Floats, stretch: Floats) -> Floats:
        """Distances to the stretched demonstration, shape (B, n), mm."""
        # The corner of the same phase is where the search begins: the segments on either side.
        corner = np.rint(np.interp(phase, self.phase, np.arange(len(self.phase)))).astype(np.int64)
        wide = stretch[:, None]
        u, v, w = self.place[corner].T
        gap = place[0] - wide * u, place[1] - v, place[2] - w
        off = gap[0] * gap[0]
        off += gap[1] * gap[1]
        off += gap[2] * gap[2]
        gap = wide * gap[0], gap[1], gap[2]
        near = off.copy()
        for other in (corner - 1, corner + 1):
            bu, bv, bw = (self.place[np.clip(other, 0, len(self.place) - 1)] - self.place[corner]).T
            bb = wide * wide * (bu * bu) + np.maximum(bv * bv + bw * bw, 1e-200)
            along = gap[0] * bu
            along += gap[1] * bv
            along += gap[2] * bw
            share = along / bb
            np.maximum(share, 0.0, out=share)
            np.minimum(share, 1.0, out=share)
            # |gap - share b|², where it is not so small that rounding would tell.
            bb *= share
            bb -= along
            bb -= along
            bb *= share
            bb += off
            np.minimum(near, bb, out=near)
        unsure = near < _ROUGH + 1e-10 * off * off
        near = np.sqrt(np.maximum(near, 0.0))
        unsure |= np.sqrt(off) + near > np.minimum(wide, 1.0) * self._clear[0][corner]
        stroke, sample = np.nonzero(unsure)
        if len(stroke):
            some, known = place[:, stroke, sample], near[stroke, sample] + 1e-7
            near[stroke, sample] = self._among(some, corner[sample], known, stretch, stroke)
        return np.asarray(near)

    def _among(
        self,
        point: Floats,
        corner: Integers,
        known: Floats,
        stretch: Floats,
        stroke: Integers,
    ) -> Floats:
        """Distances of single points (3, k) that need a farther look, shape (k,), mm.

        `known` is no less than the distance to some segment, shape (k,).
        """
        wide, near = stretch[stroke], known.copy()
        which = self._reach(point, corner, near, wide)
        far = np.flatnonzero(which > _FIRST)
        # From a nearer corner less of the curve need be looked at.
        for _ in range(_SHIFTS):
            near[far], corner[far] = self._shifted(point[:, far], wide[far], corner[far], near[far])
        which[far] = self._reach(point[:, far], corner[far], near[far], wide[far])
        for i, reach in enumerate(_REACHES):
            at = np.flatnonzero(which == i)
            near[at] = self._within(point[:, at], wide[at], corner[at], reach)
        left = np.flatnonzero(which == len(_REACHES))
        for one in np.unique(stroke[left]):
            at = left[stroke[left] == one]
            near[at] = nearest_distance(point[:, at].T, self.place * [stretch[one], 1.0, 1.0])
        return near

    def _reach(self, point: Floats, corner: Integers, near: Floats, wide: Floats) -> Integers:
        """Which reach around their corners is sure to hold the nearest segments, shape (k,)."""
        u, v, w = self.place[corner].T
        need = _length(point[0] - wide * u, point[1] - v, point[2] - w) + near
        need /= np.minimum(wide, 1.0)
        return np.asarray(sum((need > clear[corner]).astype(np.int64) for clear in self._clear))

    def _shifted(
        self, point: Floats, wide: Floats, corner: Integers, near: Floats
    ) -> tuple[Floats, Integers]:
        """Corners so many segments on as the points are ahead, where nearer; and the distances."""
        m = len(self.place)
        i = np.minimum(corner, m - 2)
        a, b = self.place.T[:, corner], self.place.T[:, i + 1] - self.place.T[:, i]
        au, bu = wide * a[0], wide * b[0]
        along = (point[0] - au) * bu + (point[1] - a[1]) * b[1] + (point[2] - a[2]) * b[2]
        shift = along / np.maximum(bu * bu + b[1] * b[1] + b[2] * b[2], 1e-200)
        there = np.clip(corner + np.rint(np.clip(shift, -_MOST, _MOST)), 0, m - 1).astype(np.int64)
        u, v, w = self.place.T[:, there]
        then = _length(point[0] - wide * u, point[1] - v, point[2] - w)
        return np.minimum(near, then), np.where(then < near, there, corner)

    def _within(self, point: Floats, wide: Floats, corner: Integers, reach: int) -> Floats:
        """Distance of points (3, k) to the segments around their corners, shape (k,)."""
        near = np.empty(len(corner))
        # Corner i stands at i + _MOST in the filled-up curve.
        windows = sliding_window_view(self._filled, 2 * reach + 1, axis=1)[:, _MOST - reach :]
        size = max(1, _AT_ONCE // (2 * reach))
        for first in range(0, len(corner), size):
            s = slice(first, first + size)
            window = np.stack([some[corner[s]] for some in windows])
            window[0] *= wide[s, None]
            near[s] = np.sqrt(_to_segments(window, point[:, s, None]).min(axis=1))
        return near


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


def _to_segments(corners: Floats, point: Floats) -> Floats:
    """Squared distances of points (3, k, 1) to the segments of curves (3, k, m), (k, m - 1)."""
    bu, bv, bw = corners[..., 1:] - corners[..., :-1]
    du, dv, dw = point - corners[..., :-1]
    bb = bu * bu + bv * bv + bw * bw
    share = du * bu
    share += dv * bv
    share += dw * bw
    share /= np.maximum(bb, 1e-200)
    np.maximum(share, 0.0, out=share)
    np.minimum(share, 1.0, out=share)
    du -= share * bu
    dv -= share * bv
    dw -= share * bw
    du *= du
    dv *= dv
    dw *= dw
    du += dv
    du += dw
    return np.asarray(du)


def _clearance(place: Floats, reaches: Sequence[int] = _REACHES) -> list[Floats]:
    """Least distance of each corner to the segments beyond each reach along the curve, mm.

    A stretch by s along u leaves at least min(1, s) of every distance.
    """
    m = len(place)
    a, b = place[:-1], np.diff(place, axis=0)
    bb = np.einsum("md,md->m", b, b)
    safe = np.where(bb > 0.0, bb, 1.0)
    clear = [np.empty(m) for _ in reaches]
    rows = max(1, _AT_ONCE // m)
    for first in range(0, m, rows):
        corner = np.arange(first, min(first + rows, m))
        gap = place[corner, None] - a
        share = np.clip(np.einsum("kmd,md->km", gap, b) / safe, 0.0, 1.0)
        apart = np.linalg.norm(gap - share[..., None] * b, axis=-1)
        # What rounding may add up to, and more.
        apart = np.maximum(apart * (1.0 - 1e-9) - 1e-9, 0.0)
        before, after = np.full((2, len(corner), m), np.inf)
        before[:, 1:] = np.minimum.accumulate(apart, axis=1)
        after[:, :-1] = np.minimum.accumulate(apart[:, ::-1], axis=1)[:, ::-1]
        row = np.arange(len(corner))
        for known, reach in zip(clear, reaches, strict=True):
            low, high = np.maximum(corner - reach, 0), np.minimum(corner + reach, m - 1)
            known[corner] = np.minimum(before[row, low], after[row, high])
    return clear


def _length(x: Floats, y: Floats, z: Floats) -> Floats:
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def _rms(distance: Floats) -> Floats:
    return np.asarray(np.sqrt(np.einsum("bn,bn->b", distance, distance) / distance.shape[1]))

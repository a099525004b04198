"""A surface as a picture of pixels: what is seen of triangles from afar, and how far off it is.

Each triangle is filled row by row, all rows of all triangles at once, and the nearest wins
(a depth buffer, E. Catmull, 1974). Lines are drawn where the picture bends or breaks off.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import AnyArray, Booleans, Floats, Integers

DARK, LIGHT = 0.58, 0.97
"""Greys of a triangle seen edge-on, and from the front."""

_AT_ONCE = 100_000
_BEND = np.cos(np.radians(24.0))
_LINE = 0.45
_LEAST_AREA = 1e-12


@dataclass(frozen=True)
class Camera:
    """A view from afar, without perspective.

    Attributes
    ----------
    right, up, toward : array, shape (3,)
        Unit vectors of the picture, and to the eye.
    low : array, shape (2,)
        Lower left corner, mm along `right` and `up`.
    size : array, shape (2,)
        Width and height, mm.
    scale : float
        Pixels per mm.
    """

    right: Floats
    up: Floats
    toward: Floats
    low: Floats
    size: Floats
    scale: float

    def seen(self, points: Floats) -> Floats:
        """Return where points (..., 3) are in the picture: mm from its corner, and towards it."""
        at = points @ np.stack([self.right, self.up, self.toward], axis=-1)
        return np.asarray(at - np.append(self.low, 0.0))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of pixels."""
        width, height = np.maximum(np.ceil(self.size * self.scale), 1).astype(int)
        return int(height), int(width)


@dataclass(frozen=True)
class Picture:
    """A rendered surface; the first row of pixels is the lowest.

    Attributes
    ----------
    grey : array, shape (h, w)
        0 to 1.
    there : array of bool, shape (h, w)
        Where the surface is.
    depth : array, shape (h, w)
        mm towards the eye; -inf where there is none.
    """

    grey: Floats
    there: Booleans
    depth: Floats

    def hides(self, camera: Camera, points: Floats, by: float) -> Booleans:
        """Tell which points the surface hides, being nearer to the eye by more than a bound.

        Parameters
        ----------
        camera : Camera
            The one of the picture.
        points : array, shape (n, 3)
            mm; of one beside the picture the nearest pixel tells.
        by : float
            mm, so that a stroke does not hide in the surface that it lies on.

        Returns
        -------
        array of bool, shape (n,)
        """
        at = camera.seen(points)
        h, w = self.depth.shape
        column = np.clip((at[:, 0] * camera.scale).astype(int), 0, w - 1)
        row = np.clip((at[:, 1] * camera.scale).astype(int), 0, h - 1)
        return np.asarray(self.depth[row, column] > at[:, 2] + by)


def rendered(corners: Floats, camera: Camera) -> Picture:
    """Render triangles.

    Parameters
    ----------
    corners : array, shape (m, 3, 3)
        mm.
    camera : Camera
    """
    h, w = camera.shape
    depth, face = np.full(h * w, -np.inf), np.full(h * w, -1, dtype=np.int64)
    seen = camera.seen(corners)
    seen[..., :2] *= camera.scale
    for first in range(0, len(seen), _AT_ONCE):
        pixel, height, number = _filled(seen[first : first + _AT_ONCE], (h, w))
        np.maximum.at(depth, pixel, height)
        nearest = height == depth[pixel]
        face[pixel[nearest]] = number[nearest] + first
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0.0, length, 1.0)[:, None]
    normal *= np.where(normal @ camera.toward < 0.0, -1.0, 1.0)[:, None]
    # A lamp over the left shoulder of who looks on tells faces apart that lean both ways.
    lamp = camera.toward + 0.45 * camera.up - 0.35 * camera.right
    lit = np.clip(normal @ (lamp / np.linalg.norm(lamp)), 0.0, 1.0)
    there = face >= 0
    grey = np.ones(h * w)
    grey[there] = DARK + (LIGHT - DARK) * lit[face[there]]
    shown = np.zeros((h * w, 3))
    shown[there] = normal[face[there]]
    lines = _lines(shown.reshape(h, w, 3), there.reshape(h, w), depth.reshape(h, w), camera)
    grey[lines.ravel()] = np.minimum(grey[lines.ravel()], _LINE)
    return Picture(grey.reshape(h, w), there.reshape(h, w) | lines, depth.reshape(h, w))


def _filled(seen: Floats, shape: tuple[int, int]) -> tuple[Integers, Floats, Integers]:
    """Pixels that triangles (m, 3, 3) cover, the depth there, and which triangle it is."""
    h, w = shape
    a, b, c = seen[:, 0], seen[:, 1], seen[:, 2]
    ab, ac = b - a, c - a
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    good = np.abs(area) > _LEAST_AREA
    safe = np.where(good, area, 1.0)
    across = (ab[:, 2] * ac[:, 1] - ac[:, 2] * ab[:, 1]) / safe
    upward = (ac[:, 2] * ab[:, 0] - ab[:, 2] * ac[:, 0]) / safe
    y = seen[..., 1]
    low = np.clip(np.ceil(y.min(axis=1) - 0.5), 0, h).astype(np.int64)
    high = np.clip(np.floor(y.max(axis=1) - 0.5), -1, h - 1).astype(np.int64)
    triangle, row = _ranges(low, np.where(good, high, low - 1))
    middle = row + 0.5
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for i in range(3):
        p, q = seen[triangle, i], seen[triangle, (i + 1) % 3]
        cut = (p[:, 1] <= middle) != (q[:, 1] <= middle)
        rise = np.where(cut, q[:, 1] - p[:, 1], 1.0)
        x = p[:, 0] + (middle - p[:, 1]) / rise * (q[:, 0] - p[:, 0])
        left = np.where(cut, np.minimum(left, x), left)
        right = np.where(cut, np.maximum(right, x), right)
    open_ = np.isfinite(left)
    left, right = np.where(open_, left, 1.0), np.where(open_, right, 0.0)
    first = np.clip(np.ceil(left - 0.5), 0, w).astype(np.int64)
    last = np.clip(np.floor(right - 0.5), -1, w - 1).astype(np.int64)
    span, column = _ranges(first, last)
    number = triangle[span]
    off = np.column_stack([column + 0.5, middle[span]]) - a[number, :2]
    height = a[number, 2] + across[number] * off[:, 0] + upward[number] * off[:, 1]
    return row[span] * w + column, height, number


def _ranges(first: Integers, last: Integers) -> tuple[Integers, Integers]:
    """Return the numbers from first to last of each pair, and which pair they are of."""
    count = np.maximum(last - first + 1, 0)
    which = np.repeat(np.arange(len(count)), count)
    within = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    return which, first[which] + within


def _lines(normal: Floats, there: Booleans, depth: Floats, camera: Camera) -> Booleans:
    """Pixels where the surface bends sharply, hides another part of itself, or ends."""
    lines = np.zeros(there.shape, dtype=bool)
    known = np.where(there, depth, 0.0)
    step = max(8.0 / camera.scale, 1e-9)
    for axis in (0, 1):
        here, next_ = _pair(axis)
        both = there[here] & there[next_]
        ends = there[here] != there[next_]
        bends = both & (np.einsum("...i,...i->...", normal[here], normal[next_]) < _BEND)
        breaks = both & (np.abs(known[here] - known[next_]) > step)
        lines[here] |= bends | breaks | ends
    return lines


def _pair(axis: int) -> tuple[AnyArray, AnyArray]:
    """Slices of all pixels but the last along an axis, and of those that follow them."""
    here, there = [slice(None)] * 2, [slice(None)] * 2
    here[axis], there[axis] = slice(None, -1), slice(1, None)
    return tuple(here), tuple(there)  # type: ignore[return-value]

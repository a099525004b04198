"""SVG drawings as the path of a pen: mm, y up from the lower edge of the drawing.

Transforms, viewBox and units are applied by svgelements. Paths are drawn one after the other, as
they stand in the file; between them the pen is lifted, carried across and set down.
"""

import io
import logging
import re
from typing import Any

import numpy as np

from dmpcli import extras
from dmpcli.arrays import Booleans, Floats
from dmpcli.errors import InputError, counted
from dmpcli.extras import SVG
from dmpcli.formats.motion import MotionStroke
from dmpcli.records import untrusted
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import LENGTH

PIXEL = 25.4 / 96.0
"""A CSS pixel, mm."""

LARGEST = 32 << 20
"""Bytes of a drawing."""
MOST_POINTS = 2_000_000
FARTHEST = 1e9
"""Pixels, which are more than 100 m in any unit."""

MOST_DIGITS = 64
"""Of a number: what the library takes for one grows with their third power."""
_LONG = re.compile(rb"[0-9]{%d}" % (MOST_DIGITS + 1))

_SHARP = np.radians(10.0)
"""A turn of more than this is a corner, which a sample hits."""


def decode(
    source: Source,
    speed: float = 50.0,
    lift: float = 5.0,
    tolerance: float = 0.05,
    rate: float = 100.0,
    unit: str | None = None,
) -> tuple[MotionStroke, list[str]]:
    """Read a drawing.

    Parameters
    ----------
    source : Source
    speed : float
        Of the pen, mm/s, on paper and in the air.
    lift : float
        Between paths, mm.
    tolerance : float
        How far chords may lie off curves, mm.
    rate : float
        Samples per second.
    unit : str, optional
        Of a pixel, where the drawing has no size in mm, cm, in, pt or pc.

    Returns
    -------
    MotionStroke
        z is 0 on paper; without orientation.
    list of str
        How it was read.

    Raises
    ------
    InputError
        No SVG, without paths, or one whose size --length-unit contradicts.
    """
    if len(source.content) > LARGEST:
        raise InputError(f"{source.name}: is larger than {LARGEST >> 20} MiB; simplify the drawing")
    long = _LONG.search(source.content)
    if long is not None:
        line = source.content.count(b"\n", 0, long.start()) + 1
        raise InputError(
            f"{source.name}: line {line}: a number of more than {MOST_DIGITS} digits; export the "
            "drawing again"
        )
    (svgelements,) = extras.load(SVG, source.name, "svgelements")
    drawing = _parsed(svgelements, source)
    sized = _has_size(source.content)
    if unit is not None and sized:
        raise InputError(f"--length-unit {unit}: {source.name} says its size itself; leave it out")
    scale = _pixel(svgelements, sized) if unit is None else LENGTH[unit]
    lines, hidden = _lines(svgelements, drawing, source.name, tolerance / scale)
    if not lines:
        raise InputError(f"{source.name}: holds no path; text must be made paths first")
    points = np.concatenate(lines)
    if not np.isfinite(points).all() or np.abs(points).max() * scale > 1e5:
        raise InputError(f"{source.name}: a path runs beyond 100 m; check its units")
    height = _height(drawing, points)
    flat = [np.column_stack([line[:, 0], height - line[:, 1]]) * scale for line in lines]
    t, position = _timed(_with_lifts(flat, lift), speed, rate, source.name)
    size = np.ptp(position[:, :2], axis=0)
    told = [
        f"{counted(len(flat), 'path')}, {size[0]:.1f} x {size[1]:.1f} mm"
        + ("" if sized or unit is not None else " (a pixel is 1/96 inch; --length-unit says else)")
    ]
    if hidden:
        told.append(f"{counted(hidden, 'text')} left out: make paths of text first")
    return MotionStroke(t, position), told


def _parsed(svgelements: Any, source: Source) -> Any:
    logging.getLogger("svgelements").setLevel(logging.CRITICAL)
    with untrusted.decoding(source.name):
        return svgelements.SVG.parse(io.BytesIO(source.content), reify=True, ppi=96.0)


def _pixel(svgelements: Any, unit: str) -> float:
    """Return the pixel, mm: of a drawing in mm by the library's own figure, which is rounded."""
    if unit in ("mm", "cm"):
        return LENGTH[unit] / float(svgelements.Length(f"1{unit}").value(ppi=96.0))
    return PIXEL


def _has_size(content: bytes) -> str:
    """Return the unit of length in which the root says its width; empty if there is none."""
    root = re.search(rb"<(?:\w+:)?svg\b[^>]*>", content)
    width = root and re.search(rb"\bwidth\s*=\s*[\"']\s*[0-9.eE+-]+\s*(mm|cm|in|pt|pc)", root[0])
    return width[1].decode() if width else ""


def _height(drawing: Any, points: Floats) -> float:
    """Lower edge of the drawing, in pixels: of its page, else of what is drawn."""
    try:
        height = float(drawing.height)
    except (TypeError, ValueError, AttributeError):
        return float(points[:, 1].max())
    return height if np.isfinite(height) and height > 0.0 else float(points[:, 1].max())


def _lines(svgelements: Any, drawing: Any, name: str, tolerance: float) -> tuple[list[Floats], int]:
    """Polylines of all paths, pixels, y down; and how many texts are not among them."""
    lines, hidden, count = [], 0, 0
    # Numbers without bounds overflow within the library; what comes of them is looked at after.
    with untrusted.decoding(name), np.errstate(all="ignore"):
        for element in drawing.elements():
            values = getattr(element, "values", None) or {}
            if values.get("visibility") == "hidden" or values.get("display") == "none":
                continue
            if isinstance(element, svgelements.Text):
                hidden += 1
            if not isinstance(element, svgelements.Shape):
                continue
            for part in svgelements.Path(element).as_subpaths():
                line = _polyline(svgelements, svgelements.Path(part), tolerance)
                if not (np.abs(line) <= FARTHEST).all():
                    raise InputError(f"{name}: a path runs beyond 100 m; check its units")
                count += len(line)
                if count > MOST_POINTS:
                    raise InputError(f"{name}: is too long; give a coarser --tolerance")
                if len(line) > 1:
                    lines.append(line)
    return lines, hidden


def _polyline(svgelements: Any, path: Any, tolerance: float) -> Floats:
    points: list[tuple[float, float]] = []
    for segment in path:
        if isinstance(segment, svgelements.Move | svgelements.Line | svgelements.Close):
            if segment.end is not None:
                points.append((segment.end.x, segment.end.y))
        else:
            points += _curve(segment, tolerance)[1:].tolist()
    found = np.array(points, dtype=float).reshape(-1, 2)
    if not len(found) or not np.isfinite(found).all():
        return found
    step = np.linalg.norm(np.diff(found, axis=0), axis=1)
    return np.asarray(found[np.concatenate([[True], step > 1e-9])])


def _curve(segment: Any, tolerance: float) -> Floats:
    """Points of a curve, none of whose chords lies further off than the tolerance."""
    count = 8
    while True:
        share = np.linspace(0.0, 1.0, 2 * count + 1)
        points = np.asarray(segment.npoint(share), dtype=float)
        off = points[1::2] - (points[:-1:2] + points[2::2]) / 2.0
        if count >= 4096 or not np.linalg.norm(off, axis=1).max() > tolerance:
            return points
        count *= 2


def _with_lifts(lines: list[Floats], lift: float) -> Floats:
    """One polyline in space, shape (n, 3), mm: from path to path through the air."""
    parts = []
    for i, line in enumerate(lines):
        flat = np.column_stack([line, np.zeros(len(line))])
        if i and (lift > 0.0 and np.linalg.norm(line[0] - lines[i - 1][-1]) > 1e-6):
            up = np.array([[*lines[i - 1][-1], lift], [*line[0], lift]])
            parts.append(up)
        parts.append(flat)
    points = np.concatenate(parts)
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.asarray(points[np.concatenate([[True], step > 1e-9])])


def _timed(line: Floats, speed: float, rate: float, name: str) -> tuple[Floats, Floats]:
    """Sample a polyline at even times; each stretch between corners takes a whole number of them.

    Corners are hit, so that none is cut; the speed is off by what that rounds.
    """
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    if length[-1] * rate / speed > MOST_POINTS:
        raise InputError(
            f"{name}: {length[-1] / 1000.0:.3g} m at {speed:g} mm/s are too many samples; give a "
            "higher --speed or a lower --rate"
        )
    corner = np.flatnonzero(_corners(line))
    spans = np.maximum(np.rint(np.diff(length[corner]) * rate / speed).astype(int), 1)
    ends = np.concatenate([[0], np.cumsum(spans)])
    s = np.interp(np.arange(ends[-1] + 1), ends, length[corner])
    position = np.column_stack([np.interp(s, length, axis) for axis in line.T])
    return np.arange(len(s)) / rate, position


def _corners(line: Floats) -> Booleans:
    """Tell ends and corners of a polyline, shape (n,)."""
    step = np.diff(line, axis=0)
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    cosine = np.einsum("ij,ij->i", step[1:], step[:-1])
    found = np.ones(len(line), dtype=bool)
    found[1:-1] = cosine < np.cos(_SHARP)
    return found

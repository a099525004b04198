"""What the reader of recordings makes of a file: rows, rate, gaps, extent, speed, what fit trims.

It is the very reader of `fit`, `report` and `import`, so that what stands here is what they get.
"""

import shlex
import textwrap
from typing import Any

import numpy as np

from dmpcli.dmp.preprocessing import preprocess
from dmpcli.errors import InputError, counted
from dmpcli.records import plausibility, recordings, rotation_forms
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import Layout
from dmpcli.reporting import typed
from dmpcli.reporting.stroke_measures import Row
from dmpcli.spatial.rotations import log
from dmpcli.spatial.trajectory import Trajectory

GAP = 1.5
"""A step of more median steps than this is a gap."""

LISTED = 5
"""Gaps and pauses that are listed."""


def summary(source: Source, layout: Layout | None, options: str) -> Row:
    """Read a recording and measure what was read.

    Parameters
    ----------
    source : Source
    layout : Layout, optional
        How it is read.
    options : str
        As they are typed.

    Returns
    -------
    dict
        ``refused`` alone where the reader refuses it.
    """
    try:
        found = recordings.read(source, layout)
    except InputError as refused:
        return {"refused": str(refused).removeprefix(f"{source.name}: ")}
    stroke = found.stroke
    name = shlex.quote(source.name)
    words = f" {options}" if options and not found.ours else ""
    return {
        "rows": len(stroke.t),
        **_timing(stroke),
        **_space(stroke),
        "orientation": _orientation(stroke),
        "fit": _trimmed(stroke),
        "told": list(found.told),
        "doubts": list(found.doubts),
        "command": f"dmpcli fit {name} -o skill.json{words}",
    }


def _timing(stroke: Trajectory) -> Row:
    steps = np.diff(stroke.t)
    median = float(np.median(steps))
    wide = np.flatnonzero(steps > GAP * median)
    return {
        "duration": float(stroke.t[-1] - stroke.t[0]),
        "rate": 1.0 / median,
        "least_step": float(steps.min()),
        "largest_step": float(steps.max()),
        "gaps": [
            {"at": float(stroke.t[i] - stroke.t[0]), "seconds": float(steps[i])} for i in wide
        ],
    }


def _space(stroke: Trajectory) -> Row:
    steps = np.linalg.norm(np.diff(stroke.position, axis=0), axis=1)
    return {
        "least": stroke.position.min(axis=0).tolist(),
        "largest": stroke.position.max(axis=0).tolist(),
        "length": float(steps.sum()),
        "speed": plausibility.measures(stroke.t, stroke.position).speed,
        "largest_speed": float((steps / np.diff(stroke.t)).max()),
    }


def _orientation(stroke: Trajectory) -> Row | None:
    if stroke.rotation is None:
        return None
    R = np.asarray(stroke.rotation)
    turned = np.linalg.norm(log(R @ R[0].T), axis=1)
    return {"lean": rotation_forms.lean(R[0]), "turn": float(np.degrees(turned.max()))}


def _trimmed(stroke: Trajectory) -> Row:
    """What `fit` would cut off, s, and what it would warn of."""
    try:
        found = preprocess(stroke)
    except InputError as refused:
        return {"refused": str(refused)}
    return {
        "before": found.trimmed[0],
        "after": found.trimmed[1],
        "pauses": [list(span) for span in found.pauses],
        "approach": None if found.approach is None else list(found.approach),
        "retract": None if found.retract is None else list(found.retract),
    }


def lines(found: Row, width: int) -> list[str]:
    """Return the summary for people."""
    if "refused" in found:
        return textwrap.wrap(f"fit refuses it: {found['refused']}", width, subsequent_indent="  ")
    size = np.subtract(found["largest"], found["least"])
    middle = np.add(found["largest"], found["least"]) / 2.0
    said = [
        f"read: {counted(found['rows'], 'row')}, {found['duration']:.3f} s at "
        f"{found['rate']:.6g} Hz, {_gaps(found)}",
        f"extent {_three(size)} mm about {_three(middle)}, path {found['length']:.1f} mm",
        f"speed {found['speed']:.3g} mm/s in the mean while it moves, "
        f"{found['largest_speed']:.3g} at most from row to row",
        _turned(found["orientation"]),
        _cut(found["fit"]),
        *found["told"],
        *(f"doubtful: {doubt}" for doubt in found["doubts"]),
    ]
    wrapped = [line for text in said for line in textwrap.wrap(text, width, subsequent_indent="  ")]
    return [*wrapped, *typed.wrapped(found["command"], width)]


def _gaps(found: Row) -> str:
    gaps: list[dict[str, Any]] = found["gaps"]
    if not gaps:
        return "no gaps"
    shown = ", ".join(f"{gap['seconds']:.3g} s at {gap['at']:.3f} s" for gap in gaps[:LISTED])
    return f"{counted(len(gaps), 'gap')}: {shown}" + (", ..." if len(gaps) > LISTED else "")


def _turned(orientation: Row | None) -> str:
    if orientation is None:
        return "no orientation was read"
    return (
        f"the tool leans {orientation['lean']:.1f}° from straight down at the start and turns by "
        f"up to {orientation['turn']:.1f}° from there"
    )


def _cut(fit: Row) -> str:
    if "refused" in fit:
        return f"fit refuses it: {fit['refused']}"
    text = f"fit would trim {fit['before']:.2f} s before and {fit['after']:.2f} s after"
    spans = [("pause", span) for span in fit["pauses"][:LISTED]]
    spans += [(word, fit[word]) for word in ("approach", "retract") if fit[word] is not None]
    return text + "".join(f"; {word} {a:.2f} to {b:.2f} s" for word, (a, b) in spans)


def _three(values: Any) -> str:
    return " ".join(f"{value + 0.0:.1f}" for value in values)

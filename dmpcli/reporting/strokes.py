"""The strokes of trajectory files, batches and runs, as figures and tables take them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.dmp.contact_heights import ContactHeights
from dmpcli.errors import InputError
from dmpcli.records import learning_record as lessons
from dmpcli.records import schemas, tolerance_mark
from dmpcli.records.file_io import DASH
from dmpcli.records.record import Record
from dmpcli.records.schemas import OK
from dmpcli.records.trajectory_reader import rows_by_id, stored
from dmpcli.reporting import tracking
from dmpcli.reporting.stroke import LEAST, ReportedStroke, chart_axes
from dmpcli.spatial.trajectory import StrokeTrajectory
from dmpcli.surfaces import plane


def strokes_of(
    record: Record,
    label: str,
    normal: Floats | None = None,
    pairs: Mapping[str, Mapping[str, Any]] | None = None,
) -> list[ReportedStroke]:
    """Return the strokes of a run or of a trajectory file, one per id.

    Parameters
    ----------
    record : Record
    label : str
        What to call the file.
    normal : array, shape (3,), optional
        Normal of the plane that all strokes lie on; otherwise the file's own says.
    pairs : mapping, optional
        Of a batch: what is known of each id (start, goal, normal).

    Raises
    ------
    InputError
        A file of pairs, which holds no stroke, a stroke of fewer than 5 samples, or one whose time
        does not increase.
    """
    if record.schema is schemas.RUN:
        return _drawn(record, label, normal)
    if record.schema is not schemas.TRAJECTORY:
        raise InputError("holds start-goal pairs, not strokes; give the folder that it lies in")
    facts = record.provenance.facts
    groups, role = rows_by_id(record.columns["id"]), role_of(facts)
    strokes = []
    for name, rows in groups.items():
        one = stored(record, name, _enough(rows), facts | dict((pairs or {}).get(name, {})))
        full = label if len(groups) == 1 else f"{label}[{name}]"
        strokes.append(_planned(one, one.position, full, role, normal))
    return strokes


def _drawn(record: Record, label: str, normal: Floats | None) -> list[ReportedStroke]:
    """Return the strokes of a run in the order in which they were drawn.

    Of several, one that was stopped within its first samples is none; `states_of` counts it.
    """
    facts = record.provenance.facts
    rows = np.flatnonzero(record.columns["phase"] == "stroke")
    groups = {"": rows}
    if "id" in record.columns and len(rows):
        groups = {name: rows[i] for name, i in rows_by_id(record.columns["id"][rows]).items()}
    own = {said["id"]: said for said in facts.get("strokes", ())}
    several = len(groups) > 1 or len(own) > 1
    if several:
        groups = {name: i for name, i in groups.items() if len(i) >= LEAST} or {"": rows[:0]}
    strokes = []
    for name, group in groups.items():
        known = dict(facts.get("trajectory", facts)) | own.get(name, {})
        known.setdefault("simulated", facts.get("simulated", False))
        if dict(facts.get("goals") or {}).get("taken"):
            known["goal"] = facts["goals"]["last"]  # of a goal that moved while it was drawn
        full = f"{label}[{name}]" if several else label
        drawn = tracking.reached(record, _enough(group))
        one = stored(drawn, name, _enough(np.arange(len(drawn.t))), known)
        strokes.append(_planned(one, drawn.position("plan"), full, "run", normal))
    return strokes


def states_of(run: Record) -> dict[str, int] | None:
    """Return how many strokes of a run were drawn and how many were left; None for a single one."""
    facts = run.provenance.facts
    if "drawn" not in facts:
        return None
    left = len(facts["remaining"])
    return {OK: len(facts["drawn"])} | ({"the run stopped before its end": left} if left else {})


def role_of(facts: Mapping[str, Any]) -> str:
    """Return the role of a trajectory from its facts."""
    if facts.get("model") == "original":
        return f"original {facts.get('forcing_scale', 'axis')}"
    return "modified"


def labels_of(names: Sequence[str]) -> list[str]:
    """Short names of files: without folder and suffix where that keeps them apart."""
    short = ["standard input" if name == DASH else Path(name).stem for name in names]
    return [s if short.count(s) == 1 else name for s, name in zip(short, names, strict=True)]


def _planned(
    one: StrokeTrajectory, plan: Floats, label: str, role: str, normal: Floats | None
) -> ReportedStroke:
    """Return one stroke of a file; `plan` holds the positions that it should follow, (n, 3), mm."""
    known, ends = one.facts, plan[[0, -1]]
    start = np.asarray(known.get("start", ends[0]), dtype=float)
    goal = np.asarray(known.get("goal", ends[-1]), dtype=float)
    closed = bool(known.get("closed", plane.is_closed(plan))) or not np.any(goal - start)
    own = given = one.plane_normal
    if normal is not None:
        given = normal if own is None or own @ normal >= 0.0 else -normal
    axes = None
    if given is not None:
        axes = chart_axes(start, goal, given, closed)
    elif one.normal is None:
        axes = plane.stroke_axes(plan)
    heights = known.get("end_heights", (0.0, 0.0))
    return ReportedStroke(
        label,
        "run" if role == "run" else "trajectory",
        role,
        one.t - one.t[0],
        one.position,
        one.position,
        start,
        goal,
        axes,
        closed,
        "start" in known and "goal" in known,
        bool(known.get("simulated", False)),
        rotation=one.rotation,
        side=_side(one),
        bound=known.get("model") != "original",
        lesson=lessons.of_facts(known),
        end_heights=(float(heights[0]), float(heights[1])),
        aims=_aims(np.stack([start, goal]), np.asarray(heights, dtype=float), one.normal),
        over=over_of(known),
        size=float(known.get("size", 1.0)),
        turn=float(known.get("turn", 0.0)),
        mark=tolerance_mark.of_facts(known),
    )


def over_of(facts: Mapping[str, Any]) -> ContactHeights | None:
    """Return what a trajectory's facts say of the heights that were drawn over a surface."""
    said = facts.get("over_surface")
    if said is None:
        return None
    return ContactHeights(said["band"], said["removed"], said["offset"], 0.0, 1.0, 0.0)


def _aims(ends: Floats, heights: Floats, normal: Floats | None) -> Floats | None:
    """Points that a stroke should begin and end at, shape (2, 3), mm; None where not known."""
    if not heights.any():
        return ends
    return None if normal is None else np.asarray(ends + heights[:, None] * normal[[0, -1]])


def _side(one: StrokeTrajectory) -> Floats | None:
    """Return the normal on the tool's side at the start, by the file or by its tool."""
    if one.normal is not None:
        return np.asarray(one.normal[0])
    return None if one.rotation is None else -one.rotation[0, :, 2]


def _enough(rows: Integers) -> Integers:
    if len(rows) < LEAST:
        raise InputError(f"a stroke of {len(rows)} samples cannot be measured; {LEAST} are needed")
    return rows


def pairs_of(pairs: Record) -> tuple[dict[str, dict[str, Any]], dict[str, int]]:
    """Return what a batch knows of each id, and how many pairs ended in each status.

    Parameters
    ----------
    pairs : Record
        Of schema ``pairs``.
    """
    ids = [str(name) for name in pairs.columns["id"]]
    start, goal = pairs.stack(["x0", "y0", "z0"]), pairs.stack(["xg", "yg", "zg"])
    known: dict[str, dict[str, Any]] = {
        name: {"start": start[i], "goal": goal[i]} for i, name in enumerate(ids)
    }
    if pairs.has(*schemas.NORMAL):
        for name, normal in zip(ids, pairs.stack(schemas.NORMAL), strict=True):
            if np.isfinite(normal).all():
                known[name]["normal"] = normal
    states: dict[str, int] = {}
    for status in pairs.columns["status"]:
        states[str(status)] = states.get(str(status), 0) + 1
    return known, states

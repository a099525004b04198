"""A stroke: one curve of a file, with what is needed to measure and to draw it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.errors import InputError
from dmpcli.figures import lag
from dmpcli.measures.surface import wave_along
from dmpcli.measures.wave import WaveHeights, stroke_wave
from dmpcli.primitives.contact_heights import ContactHeights
from dmpcli.records import lesson as lessons
from dmpcli.records import marks, schemas
from dmpcli.records.lesson import Lesson
from dmpcli.records.pairs import OK
from dmpcli.records.record import Record
from dmpcli.records.streams import DASH
from dmpcli.surfaces import plane

if TYPE_CHECKING:
    from dmpcli.figures.footing import Footing
    from dmpcli.figures.recorded import Recorded

NEAR = 1.0
"""Strokes whose starts and goals are this near to each other lie at the same place, mm."""

LEAST = 5
"""Fewer samples than this have no third derivative to speak of."""

_NONE = WaveHeights(np.empty(0), np.empty(0))


@dataclass(frozen=True)
class Stroke:
    """One curve of a demonstration, a trajectory or a run.

    Attributes
    ----------
    label : str
        What tables and legends call it.
    kind : str
        The file's schema: ``demonstration``, ``trajectory`` or ``run``.
    role : str
        ``demonstration``, ``builtin``, ``reference``, ``original axis``, ``original distance``,
        ``modified``, ``run``: the key of its style and of the paper's tables.
    t : array, shape (n,)
        s, from 0.
    position : array, shape (n, 3)
        mm, base frame; of a demonstration as `fit` sees it: idle ends cut off, smoothed.
    raw : array, shape (n, 3)
        The same samples before smoothing.
    start, goal : array, shape (3,)
        Where it should begin and end, mm.
    axes : array, shape (3, 3), or None
        Chart axes along, across and off its plane as columns; None on a curved surface.
    closed : bool
    intended : bool
        Whether the file says where the stroke should begin and end.
    simulated : bool
        No arm was there.
    guide : array, shape (m, 3), optional
        The curve that a demonstration was dragged along, where the file tells it, mm.
    rotation : array, shape (n, 3, 3), optional
        Of the tool, of trajectories and runs that hold it.
    side : array, shape (3,), optional
        Normal on the tool's side where the stroke begins, as far as the file tells it.
    bound : bool
        Whether it was meant to lie on a surface: the original model knows none.
    staged : bool
        False for a recording of which nobody knows what was to be drawn: a person dragged.
    footing : Footing, optional
        How the stroke lies on a surface that it was measured on.
    lesson : Lesson, optional
        How the skill that drew it saw its recordings; of a demonstration, how it is seen.
    recorded : Recorded, optional
        What a demonstration is a view of.
    place : array, shape (n, 3), optional
        u, v, w of a demonstration on the surface that it was taught on, mm; else its plane's axes
        tell them.
    geodesic : float, optional
        Start-goal distance along that surface, mm.
    lost : tuple of float
        RMS and largest of what smoothing took off a demonstration beyond its noise, mm.
    noise : float
        Of a demonstration, standard deviation per axis, mm.
    elsewhere : bool
        Whether a demonstration was taught on a surface that is not at hand, so that nothing can be
        compared with it.
    by_skill : bool
        Whether its skill's own curve stands for a demonstration whose taught surface is not at
        hand; `lost` is by how much that curve strays from the recording.
    end_heights : tuple of float
        How far above start and goal it should begin and end, mm.
    aims : array, shape (2, 3), optional
        Those points, mm; None where the normals there are not known.
    over : ContactHeights, optional
        What was drawn of the skill's heights over a surface.
    size, turn : float
        Of a closed stroke, beside the demonstration's; rad.
    mark : dict, optional
        By how much the skill that drew it misses its tolerance; see `records.marks`.
    """

    label: str
    kind: str
    role: str
    t: Floats
    position: Floats
    raw: Floats
    start: Floats
    goal: Floats
    axes: Floats | None
    closed: bool
    intended: bool
    simulated: bool
    guide: Floats | None = None
    rotation: Floats | None = None
    side: Floats | None = None
    bound: bool = True
    staged: bool = True
    footing: "Footing | None" = None
    lesson: Lesson | None = None
    recorded: "Recorded | None" = None
    place: Floats | None = None
    geodesic: float | None = None
    lost: tuple[float, float] = (0.0, 0.0)
    noise: float = 0.0
    elsewhere: bool = False
    by_skill: bool = False
    end_heights: tuple[float, float] = (0.0, 0.0)
    aims: Floats | None = None
    over: ContactHeights | None = None
    size: float = 1.0
    turn: float = 0.0
    mark: dict[str, float] | None = None

    @cached_property
    def wave(self) -> WaveHeights:
        """Its wave heights; on a curved surface along it. None for a line or a closed stroke."""
        if self.closed:
            return _NONE
        if self.place is not None:
            return wave_along(self.place[:, :2], self.length) or _NONE
        if self.axes is None:
            return (self.footing and self.footing.wave) or _NONE
        return stroke_wave(self.position, self.start, self.goal, self.axes[:, 2])

    @property
    def length(self) -> float:
        """Start-goal distance, along the surface that it was taught on, mm."""
        if self.geodesic is not None:
            return self.geodesic
        return float(np.linalg.norm(self.goal - self.start))

    def at_place_of(self, other: "Stroke") -> bool:
        """Tell whether both strokes begin and end within 1 mm of each other."""
        apart = np.linalg.norm([self.start - other.start, self.goal - other.goal], axis=1)
        return bool(apart.max() <= NEAR)

    @cached_property
    def chart(self) -> Floats | None:
        """u, v, w in its own chart, shape (n, 3), mm; None where it has none."""
        return self.flat if self.place is None else self.place

    @cached_property
    def flat(self) -> Floats | None:
        """u, v, w on its plane, shape (n, 3), mm; None where it has none."""
        return None if self.axes is None else (self.position - self.start) @ self.axes

    def seen_for(self, other: "Stroke") -> "Stroke":
        """Return this demonstration as the skill saw it that drew another stroke."""
        if self.recorded is None or other.lesson is None:
            return self
        return self.recorded.stroke(other.lesson)

    def as_drawn_by(self, other: "Stroke") -> Floats | None:
        """u, v, w of this demonstration as another stroke should have them, shape (n, 3), mm."""
        if self.chart is None or other.axes is None:
            return None
        stretch = 1.0 if self.closed or other.closed else other.length / self.length
        return as_drawn(self.chart * [stretch, 1.0, 1.0], other.over, other.size, other.turn)

    def carried_to(self, other: "Stroke") -> Floats | None:
        """Positions with start, goal and plane laid upon another stroke's, shape (n, 3), mm."""
        place = self.as_drawn_by(other)
        if place is None or other.axes is None:
            return None
        return np.asarray(other.start + place @ other.axes.T)


def as_drawn(
    place: Floats, over: ContactHeights | None, size: float = 1.0, turn: float = 0.0
) -> Floats:
    """Chart coordinates (n, 3) of a demonstration as a stroke was to have them.

    Flat where it touches the surface; if closed, larger, and turned about the normal.
    """
    if over is None and (size, turn) == (1.0, 0.0):
        return place
    c, s = np.cos(turn), np.sin(turn)
    u, v, w = place.T
    w = w if over is None else over.drawn(w)
    return np.column_stack([size * (c * u - s * v), size * (s * u + c * v), w])


def strokes_of(
    record: Record,
    label: str,
    normal: Floats | None = None,
    pairs: Mapping[str, Mapping[str, Any]] | None = None,
) -> list[Stroke]:
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
    facts = record.provenance.facts
    if record.schema is schemas.RUN:
        return _drawn(record, label, normal)
    if record.schema is schemas.TRAJECTORY:
        groups, role = _by_id(record.columns["id"]), role_of(facts)
        strokes = []
        for name, rows in groups.items():
            known = facts | dict((pairs or {}).get(name, {}))
            full = label if len(groups) == 1 else f"{label}[{name}]"
            strokes.append(_planned(_part(record, rows), full, role, normal, known))
        return strokes
    raise InputError("holds start-goal pairs, not strokes; give the folder that it lies in")


def _drawn(record: Record, label: str, normal: Floats | None) -> list[Stroke]:
    """Return the strokes of a run in the order in which they were drawn.

    Of several, one that was stopped within its first samples is none; `states_of` counts it.
    """
    facts = record.provenance.facts
    rows = np.flatnonzero(record.columns["phase"] == "stroke")
    groups = {"": rows}
    if "id" in record.columns and len(rows):
        groups = {name: rows[i] for name, i in _by_id(record.columns["id"][rows]).items()}
    own = {said["id"]: said for said in facts.get("strokes", ())}
    several = len(groups) > 1 or len(own) > 1
    if several:
        groups = {name: i for name, i in groups.items() if len(i) >= LEAST} or {"": rows[:0]}
    strokes = []
    for name, group in groups.items():
        known = dict(facts.get("trajectory", facts)) | own.get(name, {})
        full = f"{label}[{name}]" if several else label
        drawn = lag.reached(record, group)
        drawn = _part(drawn, np.arange(len(drawn.t)))
        strokes.append(_planned(drawn, full, "run", normal, known, "plan"))
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
    record: Record,
    label: str,
    role: str,
    normal: Floats | None,
    known: Mapping[str, Any],
    plan: str = "",
) -> Stroke:
    """Return the one stroke of a record; `plan` names the columns that it should follow."""
    t, position, ends = record.t, record.position(), record.position(plan)
    intended = "start" in known and "goal" in known
    start = np.asarray(known.get("start", ends[0]), dtype=float)
    goal = np.asarray(known.get("goal", ends[-1]), dtype=float)
    closed = bool(known.get("closed", plane.is_closed(ends))) or not np.any(goal - start)
    given = _normal(known, record)
    if normal is not None:
        given = normal if given is None or given @ normal >= 0.0 else -normal
    axes = None
    if given is not None:
        axes = chart_axes(start, goal, given, closed)
    elif not record.has(*schemas.NORMAL):
        axes = plane.stroke_axes(ends)
    heights = tuple(map(float, known.get("end_heights", (0.0, 0.0))))
    return Stroke(
        label,
        record.schema.name,
        role,
        t - t[0],
        position,
        position,
        start,
        goal,
        axes,
        closed,
        intended,
        bool(known.get("simulated", record.provenance.facts.get("simulated", False))),
        rotation=record.rotation(),
        side=_side(record, known),
        bound=known.get("model") != "original",
        lesson=lessons.of_facts(known),
        end_heights=(heights[0], heights[1]),
        aims=_aims(start, goal, heights, _normal(known, record), record),
        over=over_of(known),
        size=float(known.get("size", 1.0)),
        turn=float(known.get("turn", 0.0)),
        mark=marks.of_facts(known),
    )


def over_of(facts: Mapping[str, Any]) -> ContactHeights | None:
    """Return what a trajectory's facts say of the heights that were drawn over a surface."""
    said = facts.get("over_surface")
    if said is None:
        return None
    return ContactHeights(said["band"], said["removed"], said["offset"], 0.0, 1.0, 0.0)


def _aims(
    start: Floats, goal: Floats, heights: Sequence[float], normal: Floats | None, record: Record
) -> Floats | None:
    """Points that a stroke should begin and end at, shape (2, 3), mm; None where not known."""
    ends = np.stack([start, goal])
    if not any(heights):
        return ends
    if normal is None:
        if not record.has(*schemas.NORMAL):
            return None
        up = record.stack(schemas.NORMAL)[[0, -1]]
    else:
        up = np.stack([normal, normal]) / np.linalg.norm(normal)
    return np.asarray(ends + np.asarray(heights)[:, None] * up)


def _side(record: Record, known: Mapping[str, Any]) -> Floats | None:
    """Return the normal on the tool's side at the start, by the file or by its tool."""
    if known.get("normal") is not None:
        return np.asarray(known["normal"], dtype=float)
    if record.has(*schemas.NORMAL):
        return np.asarray(record.stack(schemas.NORMAL)[0])
    rotation = record.rotation()
    return None if rotation is None else -rotation[0, :, 2]


def _normal(known: Mapping[str, Any], record: Record) -> Floats | None:
    """Return the one normal of a stroke's plane; None where it is not known or turns."""
    if known.get("normal") is not None:
        return np.asarray(known["normal"], dtype=float)
    if not record.has(*schemas.NORMAL):
        return None
    normals = record.stack(schemas.NORMAL)
    return normals[0] if np.ptp(normals, axis=0).max() < 1e-6 else None


def chart_axes(start: Floats, goal: Floats, normal: Floats, closed: bool) -> Floats:
    """Axes (3, 3) of a stroke's chart as columns: along, across and off the plane of a normal."""
    n = normal / np.linalg.norm(normal)
    if closed:
        return plane.closed_axes(n)
    return plane.open_axes((goal - start) / np.linalg.norm(goal - start), n)


def _part(record: Record, rows: Integers) -> Record:
    """Return some rows of a record, checked: enough of them, and time increases."""
    _enough(len(rows))
    back = np.flatnonzero(np.diff(record.t[rows]) <= 0.0)
    if len(back):
        raise InputError(
            f"column 't', row {rows[back[0] + 1] + 1}: time does not increase; sort the rows"
        )
    return replace(record, columns={name: c[rows] for name, c in record.columns.items()})


def _by_id(ids: Any) -> dict[str, Integers]:
    """Rows of each id, in order of first appearance."""
    borders = np.flatnonzero(np.concatenate([[True], ids[1:] != ids[:-1], [True]]))
    runs: dict[str, list[Any]] = {}
    for first, last in pairwise(borders.tolist()):
        runs.setdefault(str(ids[first]), []).append(np.arange(first, last))
    return {name: np.concatenate(rows) for name, rows in runs.items()}


def _enough(count: int) -> None:
    if count < LEAST:
        raise InputError(f"a stroke of {count} samples cannot be measured; {LEAST} are needed")


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

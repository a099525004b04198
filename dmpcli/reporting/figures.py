"""Which figures a report calls for, what they show, and how that was measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from dmpcli.arrays import Floats
from dmpcli.dmp.skill import Skill
from dmpcli.records.record import Record
from dmpcli.reporting import batch_figures, drawing, ruling, run_figures
from dmpcli.reporting.batch import MeasuredBatch
from dmpcli.reporting.contact_figure import contact_figure
from dmpcli.reporting.curve_names import name_of, named, short
from dmpcli.reporting.drawing import PlottedCurve, curve_of
from dmpcli.reporting.part_figure import PlacedCurve, part_figure
from dmpcli.reporting.plane_figure import Beyond, plane_figure
from dmpcli.reporting.pose_error_figure import pose_error_figure
from dmpcli.reporting.pose_errors import Compared
from dmpcli.reporting.report_surface import ReportSurface
from dmpcli.reporting.spread_curves import spread_curves
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.style import STYLES
from dmpcli.reporting.time_figure import time_figure
from dmpcli.surfaces.sharp_edges import sharp_edges

MOST_PLACES = 4
"""More start-goal pairs than this share one figure instead of having two each."""

MOST_CURVES = 200
"""Strokes drawn in that one figure; of more, an even choice."""

MOST_NAMED = 6
"""Strokes on a surface that are named one by one; of more, their roles."""

MOST_IDS = 30
"""Strokes of one figure whose ids are written beside their starts."""

MOST_RUNS = 3
"""Runs, and compared pairs, that have figures of their own."""

FAR = 4.0
"""A demonstration that would make a picture so many times larger is left out of it."""

NAMES = (
    "plane",
    "time",
    "surface",
    "force",
    "contact",
    "deadlines",
    "pose_error",
    "spread_demonstrations",
)
"""What the files of the figures begin with, beside ``batch_``."""


@dataclass(frozen=True)
class ReportFigure:
    """A figure of the report.

    Attributes
    ----------
    name : str
        Of its files, without suffix.
    title, caption : str
        What it shows; how that was measured.
    files : dict of bytes
        SVG and PNG, by suffix.
    """

    name: str
    title: str
    caption: str
    files: dict[str, bytes]


@dataclass(frozen=True)
class Shown:
    """What is drawn.

    Attributes
    ----------
    strokes : sequence of ReportedStroke
        In the order of the command line.
    ground : ReportSurface, optional
        The surface that they were placed on.
    runs : sequence of (str, Record, dict)
        Runs by name, and what the report says of their contact.
    pairs : sequence of Compared
    skills : sequence of (str, Skill)
    batches : sequence of MeasuredBatch
    png : bool
        Whether figures are made as PNG too.
    """

    strokes: Sequence[ReportedStroke]
    ground: ReportSurface | None = None
    runs: Sequence[tuple[str, Record, dict[str, Any] | None]] = ()
    pairs: Sequence[Compared] = ()
    skills: Sequence[tuple[str, Skill]] = ()
    batches: Sequence[MeasuredBatch] = ()
    png: bool = False

    def saved(self, name: str, title: str, caption: str, figure: Figure) -> ReportFigure:
        """Return a figure as its files.

        Parameters
        ----------
        name : str
            Of the files, without suffix.
        title, caption : str
            What it shows; how that was measured.
        figure : Figure
            Its axes are ruled here, so that nothing may be added to it afterwards.
        """
        ruling.rule(figure)
        return ReportFigure(name, title, caption, drawing.saved(figure, self.png))


def gallery(shown: Shown) -> list[ReportFigure]:
    """Draw the figures that a report calls for; the same strokes give the same bytes."""
    with drawing.settings(text=True):
        found = [*_strokes(shown), *_runs(shown)]
        for number, pair in enumerate(shown.pairs[:MOST_RUNS], start=1):
            text = (
                "Distance and angle between each pose and the one of the same time. Aligned: after "
                "the one motion of space that brings all of them nearest."
            )
            found.append(
                shown.saved(
                    _numbered("pose_error", number),
                    f"Pose error of {short(pair.name)} against {short(pair.against)}",
                    text,
                    pose_error_figure(pair),
                )
            )
        several = [(name, skill) for name, skill in shown.skills if skill.spread is not None]
        for number, (name, skill) in enumerate(several, start=1):
            text = "The skill's own stroke in a band of one standard deviation, and that deviation."
            made = _numbered("spread_demonstrations", number)
            title = f"How the demonstrations of {short(name)} scatter"
            found.append(shown.saved(made, title, text, spread_curves(skill)))
        for number, many in enumerate(shown.batches, start=1):
            found += _batch(shown, many, number)
    return found


def _numbered(name: str, number: int) -> str:
    return f"{name}_{number}" if number > 1 else name


def _strokes(shown: Shown) -> list[ReportFigure]:
    strokes, ground = shown.strokes, shown.ground
    taught = [stroke for stroke in strokes if stroke.kind == "demonstration"]
    first = taught[0] if taught else None
    places: list[list[ReportedStroke]] = []
    for stroke in strokes:
        if stroke.kind != "demonstration":
            _join(places, stroke)
    found: list[ReportFigure] = []
    if taught and (len(taught) > 1 or not places):
        found += _of_place("demonstrations", taught, [], places, shown)
        if not places:
            found = _renamed(found)
    if len(places) > MOST_PLACES:
        found.append(_overview(places, first, shown))
    else:
        for number, place in enumerate(places, start=1):
            found += _of_place(_numbered("", number), place, taught[:1], places, shown)
    if ground is not None and any(stroke.footing for stroke in strokes):
        found.append(_on_surface(shown, ground))
    return found


def _renamed(found: list[ReportFigure]) -> list[ReportFigure]:
    return [
        ReportFigure(one.name.replace("_demonstrations", ""), one.title, one.caption, one.files)
        for one in found
    ]


def _join(places: list[list[ReportedStroke]], stroke: ReportedStroke) -> None:
    for place in places:
        if stroke.at_place_of(place[0]):
            place.append(stroke)
            return
    places.append([stroke])


def _of_place(
    ending: str,
    place: list[ReportedStroke],
    taught: list[ReportedStroke],
    places: list[list[ReportedStroke]],
    shown: Shown,
) -> list[ReportFigure]:
    """Draw what lies between one start and one goal: on its plane, and over time."""
    more = f"_{ending}" if ending and not ending.startswith("_") else ending
    at = place[0]
    same = [one for one in taught if one.at_place_of(at)]
    away = [one for one in taught if one not in same]
    moved = [(one, carried) for one in away if (carried := one.carried_to(at)) is not None]
    curves = named([*same, *place], moved)
    along = _unrolled(place, taught)
    others = [other for other in places if other[0] is not at]
    elsewhere = [(_names([one]), one.position) for one in away]
    elsewhere += [(_names(other), other[0].position) for other in others if away]
    here = tuple(stroke.position for stroke in place)
    if along is None:
        ends, axes = (at.start, at.goal), at.axes
        beyond = Beyond(_edges(shown.ground), elsewhere, [], here=here)
        drawn = [*_guides(at), *curves]
    else:
        length = at.footing.length if at.footing and at.footing.length else at.length
        ends, axes = (np.zeros(3), np.array([length, 0.0, 0.0])), None
        view = "unrolled along the shortest way on the surface from start to goal"
        beyond = Beyond(_NO_EDGES, elsewhere, [], view, here)
        drawn = along
    names = _names(place)
    return [
        shown.saved(
            f"plane{more}",
            f"{names}: along and across",
            _said_of_plane(bool(moved), along is not None, curves),
            plane_figure(drawn, [ends], axes, beyond, along=along is not None),
        ),
        shown.saved(
            f"time{more}", f"{names}: over time", _said_of_time(curves), time_figure(curves)
        ),
    ]


_NO_EDGES = np.empty((0, 2, 3))


def _names(strokes: Sequence[ReportedStroke]) -> str:
    return ", ".join(short(stroke.label) for stroke in strokes)


def _unrolled(
    place: Sequence[ReportedStroke], taught: Sequence[ReportedStroke]
) -> list[PlottedCurve] | None:
    """Return strokes in their chart on a curved surface; None where they have none."""
    charts = [
        stroke.footing.place if stroke.axes is None and stroke.footing is not None else None
        for stroke in place
    ]
    known = [chart for chart in charts if chart is not None]
    if len(known) < len(place):
        return None
    assert place[0].footing is not None
    meant = place[0].footing.demonstrated
    moved = [] if meant is None or not taught else [(taught[0], meant)]
    curves = named(place, moved)
    return curves[: len(moved)] + [
        replace(curve, position=chart, marks=stroke.wave.at(chart))
        for curve, stroke, chart in zip(curves[len(moved) :], place, known, strict=True)
    ]


def _guides(stroke: ReportedStroke) -> list[PlottedCurve]:
    """Return the curve that a demonstration was dragged along, where its file tells it."""
    if stroke.guide is None:
        return []
    style, nowhere = STYLES["reference"], np.empty(0)
    t = np.zeros(len(stroke.guide))
    name = "what was to be drawn"
    return [PlottedCurve(name, style, t, stroke.guide, nowhere, nowhere.reshape(0, 3))]


def _said_of_plane(moved: bool, unrolled: bool, curves: Sequence[PlottedCurve]) -> str:
    text = "Each curve has its number, colour and line."
    if unrolled:
        text += (
            " Along is counted on the shortest way on the surface from start to goal, across on "
            "the surface square to it, off is the distance from the surface; the demonstration is "
            "what should have been drawn."
        )
    if moved:
        text += (
            " The demonstration was taught elsewhere: it is shown here with its start, goal and "
            "plane laid upon these."
        )
    if any(len(curve.marks) for curve in curves):
        text += (
            " A wave height is the difference of neighbouring triangles across the dashed line "
            "from start to goal."
        )
    return text


def _said_of_time(curves: Sequence[PlottedCurve]) -> str:
    text = "X, Y and Z of the tip in the robot's base frame, its speed"
    if any(curve.turn is not None for curve in curves):
        text += ", and by how much the tool is turned from where the stroke began"
    text += "."
    if any(curve.shift for curve in curves):
        text += (
            " A soft start, or an arm that follows its set-points, makes the same motion later: "
            "such curves are moved in time by what the legend says, so that the same points of "
            "the path lie above one another."
        )
    return text


def _edges(ground: ReportSurface | None) -> Floats:
    """Return the sharp edges of the part, shape (k, 2, 3), mm."""
    if ground is None or ground.V is None or ground.F is None:
        return _NO_EDGES
    return sharp_edges(ground.V, ground.F)


def _overview(
    places: Sequence[Sequence[ReportedStroke]],
    first: ReportedStroke | None,
    shown: Shown,
) -> ReportFigure:
    every = [stroke for place in places for stroke in place]
    chosen = every[:: -(-len(every) // MOST_CURVES)]
    drawn = ([first] if first else []) + chosen
    curves = [curve_of(stroke).unmarked(STYLES[stroke.role].name) for stroke in drawn]
    key = list({curve.name: curve for curve in curves}.values())
    at = first or drawn[0]
    ids = [(_id(s.label), s.start) for s in chosen] if len(chosen) <= MOST_IDS else []
    ends = [(s.start, s.goal) for s in chosen] if len(chosen) <= MOST_IDS else [(at.start, at.goal)]
    if first:
        ends = [(first.start, first.goal), *[end for end in ends if end[0] is not first.start]]
    beyond = Beyond(_edges(shown.ground), [], ids)
    count = f"all {len(every)}" if len(chosen) == len(every) else f"{len(chosen)} of {len(every)}"
    text = f"Shown are {count} strokes, where they were drawn."
    if ids:
        text += " Beside each start stands the stroke's id."
    figure = plane_figure(curves, ends, at.axes, beyond, key)
    return shown.saved("plane", f"{len(every)} strokes at {len(places)} places", text, figure)


def _id(label: str) -> str:
    """Return a stroke's id within its file."""
    return (
        label[label.index("[") + 1 : -1] if label.endswith("]") and "[" in label else short(label)
    )


def _on_surface(shown: Shown, ground: ReportSurface) -> ReportFigure:
    strokes = shown.strokes
    placed = [stroke for stroke in strokes if stroke.footing]
    chosen = placed[:: -(-len(placed) // MOST_CURVES)]
    reference = next((s for s in strokes if s.kind == "demonstration"), None)
    near = reference is not None and _near(reference, placed)
    if len(chosen) > MOST_NAMED:
        curves = [curve_of(s).unmarked(STYLES[s.role].name) for s in chosen]
        taught = [curve_of(reference).unmarked("demonstration")] if near and reference else []
        key = list({curve.name: curve for curve in [*taught, *curves]}.values())
        ids = [(_id(s.label), s.start) for s in chosen] if len(chosen) <= MOST_IDS else []
    else:
        both = ([reference] if near and reference else []) + chosen
        every = [
            curve.plain().called(_height_named(stroke))
            for stroke, curve in zip(both, named(both), strict=True)
        ]
        taught, curves = every[: len(both) - len(chosen)], every[len(both) - len(chosen) :]
        key, ids = every, []
    pairs = [PlacedCurve(stroke, curve) for stroke, curve in zip(chosen, curves, strict=True)]
    text = (
        "The distance is that of each point to the nearest one of the surface. Wave heights are "
        "measured along the surface."
    )
    if reference is not None and not near:
        text += " The demonstration was taught too far away to be in the picture."
    figure = part_figure(pairs, ground, taught, ids, key)
    return shown.saved("surface", f"On {ground.label}", text, figure)


def _height_named(stroke: ReportedStroke) -> str:
    """Return a stroke's name with its wave height along the surface, and how far off it lies."""
    name = name_of(stroke, height=False)
    footing = stroke.footing
    if footing is None:
        return name
    wave = footing.wave
    if wave is not None and wave.mean is not None:
        name += f", wave {wave.mean:.2f} mm along it"
    return f"{name}, at most {np.abs(footing.height).max():.3f} mm off"


def _near(reference: ReportedStroke, placed: Sequence[ReportedStroke]) -> bool:
    """Tell whether a picture of both is not much larger than one of the strokes."""
    alone = np.vstack([stroke.position for stroke in placed])
    both = np.vstack([alone, reference.position])
    sizes = [float(np.linalg.norm(np.ptp(points, axis=0))) for points in (both, alone)]
    return sizes[0] <= FAR * sizes[1]


def _runs(shown: Shown) -> list[ReportFigure]:
    found = []
    for number, (name, run, pressed) in enumerate(shown.runs[:MOST_RUNS], start=1):
        figure = run_figures.force_figure(run, pressed)
        if figure is not None:
            text = (
                "Force on the tool as sensed, tool weight and offset taken off. The normal is the "
                "plane's that the file tells, else the direction back along the tool."
            )
            made = _numbered("force", number)
            found.append(shown.saved(made, f"{short(name)}: how hard it pressed", text, figure))
        coupled = contact_figure(run)
        if coupled is not None:
            text = (
                "What the force coupling felt, wanted and did. e is added along the planned "
                "normal, positive away from the work; the path is the tool's, in its own plane."
            )
            made = _numbered("contact", number)
            found.append(shown.saved(made, f"{short(name)}: contact", text, coupled))
        ahead = 1e3 * float(run.provenance.facts.get("lookahead") or 0.0)
        text = (
            "Lateness is the time from when a set-point was due until it was sent. The arm is "
            f"compared with the plan {ahead:.0f} ms before, which is its look-ahead."
        )
        made = _numbered("deadlines", number)
        title = f"{short(name)}: punctuality and following"
        found.append(shown.saved(made, title, text, run_figures.deadline_figure(run)))
    return found


def _batch(shown: Shown, many: MeasuredBatch, number: int) -> list[ReportFigure]:
    makers: dict[str, tuple[Callable[[MeasuredBatch], Figure | None], str, str]] = {
        "batch_distribution": (
            batch_figures.distributions,
            "how the strokes differ",
            "Strokes counted by what was measured of them; nine in ten lie in the shaded band.",
        ),
        "batch_worst": (
            batch_figures.worst,
            "the worst strokes",
            "By each measure the three worst, seen in their own plane, over the demonstration.",
        ),
    }
    found = []
    for name, (maker, title, caption) in makers.items():
        figure = maker(many)
        if figure is not None:
            full = f"{short(many.label)}: {title}"
            found.append(shown.saved(_numbered(name, number), full, caption, figure))
    return found

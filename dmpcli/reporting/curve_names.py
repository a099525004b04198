"""Strokes as curves that can be told apart, by number, colour and line, each under its own name."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.reporting.drawing import PlottedCurve
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.style import STYLES, PlotStyle
from dmpcli.spatial import rotations

LONGEST = 34
"""Letters of a stroke's name in a legend; of a longer one its beginning and its end."""

SAME = 0.02
"""Where strokes pass the same shares of their paths at times that differ alike, to this, they are
the same motion begun sooner or later, s."""

_COLOURS = ("#E69F00", "#CC79A7", "#56B4E9", "#D55E00", "#0072B2", "#009E73", "#9A4F96", "#6A5D2E")
_LINES: tuple[str | tuple[int, tuple[float, ...]], ...] = (
    "-",
    (0, (5.0, 1.5)),
    (0, (3.0, 1.0, 1.0, 1.0)),
    (0, (1.0, 1.0)),
)
_SHARES = np.linspace(0.25, 0.75, 21)


def named(
    strokes: Sequence[ReportedStroke], taught: Sequence[tuple[ReportedStroke, Floats]] = ()
) -> list[PlottedCurve]:
    """Return strokes as curves, each in a style and under a name of its own, numbered.

    Parameters
    ----------
    strokes : sequence of ReportedStroke
    taught : sequence of (ReportedStroke, array)
        Demonstrations that are shown where they were not drawn, and where; these come first.
    """
    shown = [(stroke, place) for stroke, place in taught]
    shown += [(stroke, stroke.position) for stroke in strokes]
    styles = styles_of([stroke for stroke, _ in shown])
    curves = []
    for number, ((stroke, place), style) in enumerate(zip(shown, styles, strict=True), start=1):
        curves.append(
            PlottedCurve(
                name_of(stroke, moved=number <= len(taught)),
                style,
                stroke.t,
                place,
                stroke.wave.at(stroke.t),
                stroke.wave.at(place),
                str(number) if len(shown) > 1 else "",
                0.0 if number == 1 else later(shown[0][0], stroke),
                turn_of(stroke),
            )
        )
    return curves


def name_of(stroke: ReportedStroke, moved: bool = False, height: bool = True) -> str:
    """Return a stroke's name, what it is, and its wave height.

    Parameters
    ----------
    stroke : ReportedStroke
    moved : bool
        Whether it is drawn elsewhere than where it was recorded, which is then said.
    height : bool
        Whether the wave height is said, mm, where there is one.
    """
    what = STYLES[stroke.role].name
    if moved:
        what = f"{what}, moved here"
    text = f"{short(stroke.label)}: {what}"
    mean = stroke.wave.mean
    return text if mean is None or not height else f"{text}, wave {mean:.2f} mm"


def short(label: str) -> str:
    """Return a name, or the two ends of a long one."""
    if len(label) <= LONGEST:
        return label
    return f"{label[: LONGEST // 2 - 1]}…{label[-LONGEST // 2 + 1 :]}"


def styles_of(strokes: Sequence[ReportedStroke]) -> list[PlotStyle]:
    """Return a style for each: the first of a role has the role's, and no two have the same."""
    roles = {stroke.role for stroke in strokes}
    taken = {STYLES[role].color for role in roles}
    others = [(c, line) for line, c in product(_LINES[1:] + _LINES[:1], _COLOURS) if c not in taken]
    styles: list[PlotStyle] = []
    met: set[str] = set()
    extra = 0
    for stroke in strokes:
        base = STYLES[stroke.role]
        if stroke.role in met:
            colour, line = others[extra % len(others)]
            base = replace(base, color=colour, line=line, width=1.4, order=base.order + 1)
            extra += 1
        met.add(stroke.role)
        styles.append(base)
    return styles


def later(first: ReportedStroke, stroke: ReportedStroke) -> float:
    """How much later a stroke passes the same shares of its path, s; 0 unless alike everywhere.

    A soft start delays all that follows it by half its time, and an arm follows its set-points
    later: drawn over time the same motions would seem to differ.
    """
    behind = _passed(stroke) - _passed(first)
    if np.ptp(behind) > SAME + 2.0 * float(np.median(np.diff(stroke.t))):
        return 0.0
    return float(np.median(behind))


def _passed(stroke: ReportedStroke) -> Floats:
    """When a stroke has come so far along its path, s."""
    way = np.append(0.0, np.linalg.norm(np.diff(stroke.position, axis=0), axis=1).cumsum())
    return np.asarray(np.interp(_SHARES * way[-1], way, stroke.t))


def turn_of(stroke: ReportedStroke) -> Floats | None:
    """How far the tool is turned from where the stroke began, degrees, shape (n,)."""
    if stroke.rotation is None:
        return None
    turned = stroke.rotation @ stroke.rotation[0].T
    return np.asarray(np.degrees(np.linalg.norm(rotations.log(turned), axis=1)))


def speed_of(t: Floats, position: Floats) -> Floats:
    """Speed of the tip, mm/s, shape (n,)."""
    return np.asarray(np.linalg.norm(np.gradient(position, t, axis=0), axis=1))

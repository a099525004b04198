"""The figures of the paper that a set of strokes calls for, under its numbers."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from dmpcli.reporting import drawing
from dmpcli.reporting.drawing import PlottedCurve, curve_of
from dmpcli.reporting.plane_curves import plane_curves
from dmpcli.reporting.report_surface import ReportSurface
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.style import STYLES
from dmpcli.reporting.surface_view import surface_view
from dmpcli.reporting.time_curves import time_curves

MOST_PLACES = 4
"""More start-goal pairs than this share one figure instead of having two each."""

MOST_CURVES = 200
"""Strokes drawn in that one figure; of more, an even choice."""


MOST_NAMED = 6
"""Strokes on a surface that the legend names one by one; of more, their roles."""


def gallery(
    strokes: Sequence[ReportedStroke], ground: ReportSurface | None = None
) -> dict[str, bytes]:
    """Draw the figures that the strokes call for.

    Parameters
    ----------
    strokes : sequence of ReportedStroke
        In the order of the command line.
    ground : ReportSurface, optional
        The surface that they were placed on.

    Returns
    -------
    dict of bytes
        File names (SVG and PNG) and contents. Figure 4: several demonstrations, or one with the
        curve it followed. Figures 5 and 6: what lies where the first demonstration lies, against
        time and on the plane. Figures 7 and 8: likewise elsewhere, the demonstration carried
        there. Figure 9: on a surface that was given, in space.
    """
    files = {}
    with drawing.settings():
        figures = _figures(strokes)
        if ground is not None and any(stroke.footing for stroke in strokes):
            figures["fig9_surface"] = _on_surface(strokes, ground)
        for name, figure in figures.items():
            for suffix, content in drawing.saved(figure).items():
                files[f"{name}.{suffix}"] = content
    return files


def _figures(strokes: Sequence[ReportedStroke]) -> dict[str, Figure]:
    figures = {}
    demonstrations = [s for s in strokes if s.kind == "demonstration"]
    first = demonstrations[0] if demonstrations else None
    if first and (len(demonstrations) > 1 or first.guide is not None):
        curves = _guides(first) + _named(demonstrations, drag=True)
        figures["fig4_drag_plane"] = _on_plane(curves, first)
    places: list[list[ReportedStroke]] = []
    for stroke in strokes:
        if stroke.kind != "demonstration":
            _join(places, stroke)
    if first and not places:
        places.append([first])
    if len(places) > MOST_PLACES:
        figures["fig8_generalization_plane"] = _overview(places, first)
        return figures
    elsewhere = 0
    for place in places:
        if first and place[0].at_place_of(first):
            shown = [first] + [s for s in place if s is not first]
            curves, (time, plane) = _named(shown), ("fig5_reproduction", "fig6_reproduction")
        else:
            elsewhere += 1
            more = f"_{elsewhere}" if elsewhere > 1 else ""
            time, plane = f"fig7_generalization{more}", f"fig8_generalization{more}"
            curves = _carried(first, place[0]) + _named(place)
        figures[f"{time}_time"] = time_curves(curves)
        figures[f"{plane}_plane"] = _on_plane(curves, place[0])
    return figures


def _join(places: list[list[ReportedStroke]], stroke: ReportedStroke) -> None:
    for place in places:
        if stroke.at_place_of(place[0]):
            place.append(stroke)
            return
    places.append([stroke])


def _carried(demonstration: ReportedStroke | None, to: ReportedStroke) -> list[PlottedCurve]:
    position = demonstration.carried_to(to) if demonstration else None
    if demonstration is None or position is None:
        return []
    return [curve_of(demonstration, position, "demonstration, moved here")]


def _guides(demonstration: ReportedStroke) -> list[PlottedCurve]:
    """Return the curve that the demonstration followed, where its file tells it."""
    if demonstration.guide is None:
        return []
    nowhere = np.empty(0)
    t = np.zeros(len(demonstration.guide))
    style = STYLES["reference"]
    return [PlottedCurve(style.name, style, t, demonstration.guide, nowhere, nowhere.reshape(0, 3))]


def _named(strokes: Sequence[ReportedStroke], drag: bool = False) -> list[PlottedCurve]:
    """Curves under their role's name, with the file's name where several share a role."""
    roles = [stroke.role for stroke in strokes]
    curves = []
    for stroke in strokes:
        name = STYLES[stroke.role].name
        if drag and stroke.role == "demonstration":
            name = "admittance drag"
        if roles.count(stroke.role) > 1:
            name = f"{name} ({stroke.label})"
        curves.append(curve_of(stroke, name=name))
    return curves


def _on_plane(curves: Sequence[PlottedCurve], at: ReportedStroke) -> Figure:
    return plane_curves(curves, at.start, at.goal, at.axes)


def _on_surface(strokes: Sequence[ReportedStroke], ground: ReportSurface) -> Figure:
    placed = [stroke for stroke in strokes if stroke.footing]
    step = -(-len(placed) // MOST_CURVES)
    reference = next((s for s in strokes if s.kind == "demonstration"), None)
    return surface_view(placed[::step], ground, reference, plain=len(placed) > MOST_NAMED)


def _overview(places: Sequence[Sequence[ReportedStroke]], first: ReportedStroke | None) -> Figure:
    every = [stroke for place in places for stroke in place]
    step = -(-len(every) // MOST_CURVES)
    drawn = ([first] if first else []) + every[::step]
    curves = [curve_of(stroke).unmarked(STYLES[stroke.role].name) for stroke in drawn]
    key = {curve.name: curve for curve in curves}
    at = first or drawn[0]
    return plane_curves(curves, at.start, at.goal, at.axes, list(key.values()))

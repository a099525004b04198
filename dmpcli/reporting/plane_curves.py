"""Strokes on their plane, and edge-on: the paper's Figures 4, 6 and 8."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from dmpcli.arrays import Floats
from dmpcli.reporting import drawing
from dmpcli.reporting.drawing import PlottedCurve, Seen

_WIDE, _LEAST, _TALL = 5.9, 1.2, 6.0
_EDGE = 0.85
_LEFT, _RIGHT, _GAP, _TOP, _BOTTOM = 0.75, 0.2, 0.5, 0.3, 0.6
_LEVEL = 0.99


def plane_curves(
    curves: Sequence[PlottedCurve],
    start: Floats,
    goal: Floats,
    axes: Floats | None,
    legend: Sequence[PlottedCurve] | None = None,
) -> Figure:
    """Draw curves in equal aspect on the plane (a), and from its edge (b) over at least 10 mm.

    Parameters
    ----------
    curves : sequence of PlottedCurve
        At least one.
    start, goal : array, shape (3,)
        Ends of the start-goal line that the wave heights are measured across, mm.
    axes : array, shape (3, 3), optional
        Chart axes of the plane. A level plane, and no plane, is drawn in base X, Y, Z; any other
        in its own coordinates from the start: along, across, off.
    legend : sequence of PlottedCurve, optional
        Curves that the legend names; all of them otherwise.
    """
    named = curves if legend is None else legend
    names, seen = view(start, axes)
    flat = np.vstack([seen(curve.position) for curve in curves] + [seen(np.stack([start, goal]))])
    (x0, y0, _), (x1, y1, _) = flat.min(axis=0), flat.max(axis=0)
    x_limits, y_limits = drawing.spanned(x0, x1), drawing.spanned(y0, y1)
    ratio = (y_limits[1] - y_limits[0]) / (x_limits[1] - x_limits[0])
    width, height = _WIDE, _WIDE * ratio
    if height > _TALL:
        width, height = max(_TALL / ratio, _LEAST), _TALL
    columns = 2
    foot = _BOTTOM + drawing.ROW * drawing.legend_rows(named, columns)
    left = _LEFT + 0.5 * (_WIDE - width)
    figure = drawing.page(_LEFT + _WIDE + _RIGHT, foot + _EDGE + _GAP + height + _TOP)

    top = drawing.panel(figure, left, foot + _EDGE + _GAP, width, height)
    edge = drawing.panel(figure, left, foot, width, _EDGE, sharex=top)
    line = seen(np.stack([start, goal]))
    top.plot(line[:, 0], line[:, 1], color="#888888", lw=0.7, ls=(0, (8, 4)), zorder=1)
    for curve in curves:
        p, marks = seen(curve.position), seen(curve.marks)
        drawing.draw(top, p[:, 0], p[:, 1], curve.style)
        drawing.draw(edge, p[:, 0], p[:, 2], curve.style)
        drawing.mark(top, marks[:, 0], marks[:, 1], curve.style)
    top.set_aspect("equal", adjustable="box")
    top.set_xlim(x_limits)
    top.set_ylim(y_limits)
    edge.set_ylim(drawing.spanned(float(flat[:, 2].min()), float(flat[:, 2].max())))
    top.tick_params(labelbottom=False)
    top.set_ylabel(names[1])
    edge.set_ylabel(names[2])
    edge.set_xlabel(names[0])
    drawing.letter(top, "a")
    drawing.letter(edge, "b")
    figure.align_ylabels()
    drawing.legend(figure, named, columns)
    return figure


def view(start: Floats, axes: Floats | None) -> tuple[tuple[str, str, str], Seen]:
    """Return what the axes of a figure are called, and the coordinates that it shows."""
    if axes is None or abs(axes[2, 2]) > _LEVEL:
        return ("X / mm", "Y / mm", "Z / mm"), Seen(np.zeros(3), np.eye(3))
    return ("along / mm", "across / mm", "off / mm"), Seen(start, axes)

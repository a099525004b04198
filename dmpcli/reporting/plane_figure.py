"""Strokes on their plane: from above, from its edge, and where that is among all the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dmpcli.arrays import Floats
from dmpcli.reporting import drawing
from dmpcli.reporting.drawing import PlottedCurve
from dmpcli.reporting.plane_curves import view

_WIDE, _LEAST, _TALL = 5.7, 1.6, 5.0
_EDGE, _MAP = 0.85, 1.5
_LEFT, _RIGHT, _GAP, _TOP, _BOTTOM = 0.95, 0.2, 0.5, 0.3, 0.5
_EDGE_SPAN = 0.05
_GREY = "#8A8A8A"


@dataclass(frozen=True)
class Beyond:
    """What lies around the strokes of a figure.

    Attributes
    ----------
    outline : array, shape (k, 2, 3)
        Edges of the part, mm.
    elsewhere : list of (str, array)
        Strokes that lie at other places, by name, (n, 3) mm.
    ids : list of (str, array)
        What to write beside points (3,), mm.
    seen : str
        How the strokes are looked at.
    here : tuple of array
        The strokes themselves in the base frame, (n, 3) mm, for where they lie.
    """

    outline: Floats
    elsewhere: list[tuple[str, Floats]]
    ids: list[tuple[str, Floats]]
    seen: str = "from above the plane"
    here: tuple[Floats, ...] = ()


def plane_figure(
    curves: Sequence[PlottedCurve],
    ends: Sequence[tuple[Floats, Floats]],
    axes: Floats | None,
    beyond: Beyond,
    legend: Sequence[PlottedCurve] | None = None,
    along: bool = False,
) -> Figure:
    """Draw curves in equal aspect on the plane (a), from its edge (b), and where it lies (c).

    The edge view has a scale of its own, so that small heights are seen; its axis says which.

    Parameters
    ----------
    curves : sequence of PlottedCurve
        At least one.
    ends : sequence of (array, array)
        Starts and goals to be marked, shape (3,) each, mm; the first line is drawn.
    axes : array, shape (3, 3), optional
        Chart axes of the plane. A level plane, and no plane, is drawn in base X, Y, Z.
    beyond : Beyond
    legend : sequence of PlottedCurve, optional
        Curves that the legend names; all of them otherwise.
    along : bool
        Whether positions are along, across and off a surface already.
    """
    key = curves if legend is None else legend
    names, seen = view(ends[0][0], np.eye(3) if along else axes)
    if along:
        names = ("along / mm", "across / mm", "off / mm")
    flat = np.vstack([seen(curve.position) for curve in curves] + [seen(np.stack(e)) for e in ends])
    (x0, y0, z0), (x1, y1, z1) = flat.min(axis=0), flat.max(axis=0)
    x_limits, y_limits = drawing.spanned(x0, x1, 0.1), drawing.spanned(y0, y1, 0.1)
    ratio = (y_limits[1] - y_limits[0]) / (x_limits[1] - x_limits[0])
    width, height = _WIDE, _WIDE * ratio
    if height > _TALL:
        width, height = max(_TALL / ratio, _LEAST), _TALL
    more = drawing.key_of_ends() + _more(beyond)
    columns = 1 if max(len(curve.name) for curve in key) > 40 else 2
    foot = _BOTTOM + drawing.ROW * drawing.legend_rows(key, columns, len(more))
    below = _MAP + _GAP + 0.12 if beyond.elsewhere else 0.0
    left = _LEFT + 0.5 * (_WIDE - width)
    figure = drawing.page(_LEFT + _WIDE + _RIGHT, foot + below + _EDGE + _GAP + height + _TOP)
    top = drawing.panel(figure, left, foot + below + _EDGE + _GAP, width, height)
    edge = drawing.panel(figure, left, foot + below, width, _EDGE, sharex=top)
    _outline(top, seen(beyond.outline))
    line = seen(np.stack(ends[0]))
    if len(ends) == 1:
        top.plot(line[:, 0], line[:, 1], color="#888888", lw=0.7, ls=(0, (8, 4)), zorder=1)
    for curve, share in zip(curves, drawing.shares(len(curves)), strict=True):
        p, marks = seen(curve.position), seen(curve.marks)
        for axis, pane in ((1, top), (2, edge)):
            drawing.draw(pane, p[:, 0], p[:, axis], curve.style, curve.t)
            drawing.number(pane, p[:, 0], p[:, axis], curve, share)
        drawing.mark(top, marks[:, 0], marks[:, 1], curve.style)
    for curve in curves[:1] if len(ends) == 1 else []:
        p = seen(curve.position)
        drawing.heading(top, p[:, 0], p[:, 1], curve.style)
    for start, goal in ends:
        drawing.ends(top, seen(start[None])[0], seen(goal[None])[0])
    for text, point in beyond.ids:
        _write(top, text, seen(point[None])[0])
    top.set_aspect("equal", adjustable="box")
    top.set_xlim(x_limits)
    top.set_ylim(y_limits)
    span = max(1.2 * (z1 - z0), _EDGE_SPAN)
    edge.set_ylim(0.5 * (z0 + z1) - 0.5 * span, 0.5 * (z0 + z1) + 0.5 * span)
    edge.locator_params(axis="y", nbins=4)
    top.tick_params(labelbottom=False)
    drawing.labels(top, y=names[1])
    drawing.labels(edge, y=names[2])
    drawing.labels(edge, x=names[0])
    drawing.title(top, f"(a)  {beyond.seen}, to scale")
    larger = (x_limits[1] - x_limits[0]) / width / (span / _EDGE)
    said = f", heights drawn {rounded(larger)} times as large" if larger > 1.5 else ""
    drawing.title(edge, f"(b)  from the side{said}")
    if beyond.elsewhere:
        _map(drawing.panel(figure, _LEFT, foot, _WIDE, _MAP), beyond)
    drawing.legend(figure, key, columns, more)
    return figure


def _more(beyond: Beyond) -> list[tuple[Line2D, str]]:
    if not len(beyond.outline):
        return []
    return [(Line2D([], [], color=_GREY, lw=0.8), "edges of the part")]


def _outline(axes: Axes, edges: Floats) -> None:
    if len(edges):
        axes.add_collection(
            LineCollection(list(edges[..., :2]), colors=_GREY, lw=0.8, zorder=0.5), autolim=False
        )


def _write(axes: Axes, text: str, at: Floats) -> None:
    axes.annotate(
        text, (float(at[0]), float(at[1])), (5, 4), textcoords="offset points", fontsize=7.0,
        bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7}, zorder=41,
    )  # fmt: skip


def _map(axes: Axes, beyond: Beyond) -> None:
    """Draw where these strokes and the others lie, in base X and Y from above."""
    for name, position in beyond.elsewhere:
        axes.plot(position[:, 0], position[:, 1], color="black", lw=1.0)
        _write(axes, name, position[0])
    for position in beyond.here:
        axes.plot(position[:, 0], position[:, 1], color="#D55E00", lw=2.0)
    _write(axes, "(a)", beyond.here[0][0])
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    drawing.labels(axes, x="X / mm")
    drawing.labels(axes, y="Y / mm")
    title = "(c)  where that is, seen from above the robot's base"
    drawing.title(axes, title)


def rounded(value: float) -> str:
    """Return a number with two digits that count, without a power of ten."""
    digits = 1 - int(np.floor(np.log10(abs(value))))
    return f"{round(value, digits):.{max(digits, 0)}f}"

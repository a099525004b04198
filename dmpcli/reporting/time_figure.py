"""Strokes against time: position, speed of the tip, and how the tool turns."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dmpcli.reporting import drawing
from dmpcli.reporting.curve_names import speed_of
from dmpcli.reporting.drawing import PlottedCurve
from dmpcli.reporting.time_curves import swing_axis

_WIDTH, _HEIGHT = 5.9, 1.25
_LEFT, _RIGHT, _GAP, _TOP, _BOTTOM = 0.95, 0.2, 0.36, 0.3, 0.48
_LEAST_TURN = 1.0


def time_figure(curves: Sequence[PlottedCurve]) -> Figure:
    """Draw X, Y, Z, speed and turn of the tool, each curve moved in time by its `shift`.

    Parameters
    ----------
    curves : sequence of PlottedCurve
        At least one.
    """
    turning = any(curve.turn is not None for curve in curves)
    rows = [*"XYZ", "speed", *(["turn"] if turning else [])]
    columns = 1 if max(len(curve.name) for curve in curves) > 40 else 2
    foot = _BOTTOM + drawing.ROW * drawing.legend_rows(curves, columns)
    height = foot + len(rows) * _HEIGHT + (len(rows) - 1) * _GAP + _TOP
    figure = drawing.page(_LEFT + _WIDTH + _RIGHT, height)
    swing = swing_axis(curves)
    moved = any(curve.shift for curve in curves)
    low = min(float(curve.t[0] - curve.shift) for curve in curves)
    high = max(float(curve.t[-1] - curve.shift) for curve in curves)
    for i, name in enumerate(rows):
        bottom = foot + (len(rows) - 1 - i) * (_HEIGHT + _GAP)
        axes = drawing.panel(figure, _LEFT, bottom, _WIDTH, _HEIGHT)
        _row(axes, name, curves)
        if i == swing:
            for curve in curves:
                t = curve.marks_t - curve.shift
                drawing.mark(axes, t, curve.marks[:, i], curve.style)
        axes.set_xlim(low, high)
        drawing.title(axes, f"({'abcde'[i]})")
        axes.tick_params(labelbottom=i == len(rows) - 1)
        if i == len(rows) - 1:
            drawing.labels(
                axes, x="t / s of the first; the others moved, see below" if moved else "t / s"
            )
    drawing.legend(figure, [_moved(curve) for curve in curves], columns)
    return figure


def _moved(curve: PlottedCurve) -> PlottedCurve:
    """Return the curve with a name that says by how much its time was moved."""
    if not curve.shift:
        return curve
    way = "earlier" if curve.shift > 0.0 else "later"
    return curve.called(f"{curve.name}, drawn {abs(curve.shift):.3f} s {way}")


def _row(axes: Axes, name: str, curves: Sequence[PlottedCurve]) -> None:
    shown = []
    for curve, share in zip(curves, drawing.shares(len(curves)), strict=True):
        if name == "turn" and curve.turn is None:
            continue
        if name == "speed":
            values = speed_of(curve.t, curve.position)
        elif name == "turn":
            assert curve.turn is not None
            values = curve.turn
        else:
            values = curve.position[:, "XYZ".index(name)]
        t = curve.t - curve.shift
        drawing.draw(axes, t, values, curve.style, t)
        drawing.number(axes, t, values, curve, share)
        shown.append(values)
    every = np.concatenate(shown)
    if name == "speed":
        axes.set_ylim(0.0, 1.1 * float(every.max()) or 1.0)
        drawing.labels(axes, y="speed / mm/s")
    elif name == "turn":
        axes.set_ylim(0.0, max(1.1 * float(every.max()), _LEAST_TURN))
        drawing.labels(axes, y="tool turned / °")
    else:
        axes.set_ylim(drawing.spanned(float(every.min()), float(every.max())))
        drawing.labels(axes, y=f"{name} / mm")
    axes.locator_params(axis="y", nbins=5)

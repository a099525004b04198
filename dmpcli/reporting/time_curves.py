"""X, Y and Z against time in three panels: the paper's Figures 5 and 7."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from dmpcli.reporting import drawing
from dmpcli.reporting.drawing import PlottedCurve

_WIDTH, _HEIGHT = 5.9, 1.5
_LEFT, _RIGHT, _GAP, _TOP, _BOTTOM = 0.75, 0.2, 0.42, 0.3, 0.55


def time_curves(curves: Sequence[PlottedCurve]) -> Figure:
    """Draw the curves; peak and trough are marked on the axis that the wave swings along most.

    Parameters
    ----------
    curves : sequence of PlottedCurve
        At least one.
    """
    columns = 2
    foot = _BOTTOM + drawing.ROW * drawing.legend_rows(curves, columns)
    figure = drawing.page(_LEFT + _WIDTH + _RIGHT, foot + 3 * _HEIGHT + 2 * _GAP + _TOP)
    swing = swing_axis(curves)
    for i, name in enumerate("XYZ"):
        bottom = foot + (2 - i) * (_HEIGHT + _GAP)
        axes = drawing.panel(figure, _LEFT, bottom, _WIDTH, _HEIGHT)
        for curve in curves:
            drawing.draw(axes, curve.t, curve.position[:, i], curve.style)
            if i == swing:
                drawing.mark(axes, curve.marks_t, curve.marks[:, i], curve.style)
        values = np.concatenate([curve.position[:, i] for curve in curves])
        axes.set_ylim(drawing.spanned(float(values.min()), float(values.max())))
        axes.set_xlim(0.0, max(float(curve.t[-1]) for curve in curves))
        axes.set_ylabel(f"{name} / mm")
        drawing.letter(axes, "abc"[i])
        if i < 2:
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("t / s")
        figure.align_ylabels()
    drawing.legend(figure, curves, columns)
    return figure


def swing_axis(curves: Sequence[PlottedCurve]) -> int:
    """Find the base axis on which the curves turn back and forth most; y where none does."""
    turning = [sum(_turns(curve, axis) for curve in curves) for axis in range(3)]
    return int(np.argmax(turning)) if max(turning) > 0.0 else 1


def _turns(curve: PlottedCurve, axis: int) -> float:
    """Way from end to end by the marks, less the way straight on, mm."""
    ends = curve.position[[0, -1], axis]
    way = np.concatenate([ends[:1], curve.marks[:, axis], ends[1:]])
    return float(np.abs(np.diff(way)).sum() - abs(ends[1] - ends[0]))

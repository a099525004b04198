"""The figure of pose errors over time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dmpcli.metrics import pose_error
from dmpcli.reporting import drawing
from dmpcli.reporting.gaps import gaps, line
from dmpcli.reporting.pose_errors import Compared

_WIDTH, _PANEL = 5.9, 1.3
_LEFT, _RIGHT, _GAP, _TOP, _BOTTOM = 0.95, 0.2, 0.42, 0.3, 0.55
_AS_IS, _ALIGNED = "#0072B2", "#D55E00"


def pose_error_figure(pair: Compared) -> Figure:
    """Draw the absolute error of position (a) and of rotation (b) over time, as is and aligned."""
    parts = [("position", "off / mm", 1.0)]
    if pair.absolute.rotation is not None:
        parts.append(("rotation", "turned / °", 180.0 / np.pi))
    foot = _BOTTOM + 2 * drawing.ROW
    height = foot + len(parts) * _PANEL + (len(parts) - 1) * _GAP + _TOP
    made = drawing.page(_LEFT + _WIDTH + _RIGHT, height)
    for i, (name, unit, factor) in enumerate(parts):
        bottom = foot + (len(parts) - 1 - i) * (_PANEL + _GAP)
        axes = drawing.panel(made, _LEFT, bottom, _WIDTH, _PANEL)
        _panel(axes, pair, name, factor)
        drawing.labels(axes, y=unit)
        drawing.title(axes, f"({'ab'[i]})  {name}")
        axes.tick_params(labelbottom=i == len(parts) - 1)
    drawing.labels(axes, x="t / s")
    key = [
        (Line2D([], [], color=_AS_IS, lw=1.3), "as it is"),
        (Line2D([], [], color=_ALIGNED, lw=1.3, ls="--"), "after alignment"),
        (Line2D([], [], color=_AS_IS, lw=0.8, ls=":"), "root mean square as it is"),
        (Line2D([], [], color=_ALIGNED, lw=0.8, ls=":"), "root mean square after alignment"),
    ]
    made.legend([one for one, _ in key], [text for _, text in key], loc="lower center", ncols=2)
    return made


def _panel(axes: Axes, pair: Compared, name: str, factor: float) -> None:
    largest = 0.0
    apart = gaps(pair.estimate.t)
    for errors, colour, dashes in ((pair.absolute, _AS_IS, "-"), (pair.aligned, _ALIGNED, "--")):
        values = None if errors is None else getattr(errors, name)
        if values is None:
            continue
        line(axes, pair.estimate.t, factor * values, apart, color=colour, lw=1.3, ls=dashes)
        axes.axhline(factor * pose_error.summary(values)["rmse"], color=colour, lw=0.8, ls=":")
        largest = max(largest, factor * float(values.max()))
    axes.set_ylim(0.0, 1.1 * largest or 1.0)
    axes.set_xlim(float(pair.estimate.t[0]), float(pair.estimate.t[-1]))

"""Grid, ticks and numbers of a panel, all lines of a kind as one.

matplotlib makes five artists for each tick, and lays each out: of a report with twenty panels that
would be a third of its time.
"""

from typing import Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.transforms import ScaledTranslation

from dmpcli.arrays import Floats

_SLACK = 1e-9
_LEFT: Literal[0] = 0
_DOWN: Literal[3] = 3
"""matplotlib's TICKLEFT and TICKDOWN, of which its types know the numbers alone."""

_LENGTH, _PAD = 3.5, 3.5
"""Of a tick, and from it to its number, points."""


def rule(figure: Figure) -> None:
    """Draw the axes of all panels as lines and texts, in place of matplotlib's own.

    Where ticks stand, what they say and what the axes are called is taken from these, so that this
    comes last.

    Parameters
    ----------
    figure : Figure
        Of panels whose labels stand at places of their own, see `drawing.labels`.
    """
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            # One with its numbers on the other side, of a colour bar, stays matplotlib's.
            if axis.get_visible() and axis.get_ticks_position() not in ("right", "top"):
                _rule(figure, axes, axis)
                axis.set_visible(False)


def _rule(figure: Figure, axes: Axes, axis: Axis) -> None:
    level = axis is axes.xaxis
    low, high = sorted(axis.get_view_interval())
    at: Floats = np.asarray(axis.get_majorticklocs(), dtype=float)
    slack = _SLACK * (high - low)
    at = at[(at >= low - slack) & (at <= high + slack)]
    if len(at):
        _lines(axes, at, level)
        if axis.get_tick_params()["labelbottom" if level else "labelleft"]:
            _numbers(figure, axes, axis, at, level)
    label = axis.label
    if label.get_text():
        axes.text(
            *label.get_position(), label.get_text(), transform=axes.transAxes,
            ha=label.get_horizontalalignment(), va=label.get_verticalalignment(),
            rotation=label.get_rotation(), rotation_mode=label.get_rotation_mode(),
        )  # fmt: skip


def _lines(axes: Axes, at: Floats, level: bool) -> None:
    place = axes.get_xaxis_transform() if level else axes.get_yaxis_transform()
    along = np.stack([np.stack([at, 0.0 * at + end], axis=-1) for end in (0.0, 1.0)], axis=1)
    rc = mpl.rcParams
    if rc["axes.grid"] and axes.axison:
        grid = LineCollection(
            list(along if level else along[..., ::-1]), transform=place, clip_on=False, zorder=0.4,
            colors=rc["grid.color"], linewidths=rc["grid.linewidth"],
        )  # fmt: skip
        axes.add_collection(grid, autolim=False)
    foot = along[:, 0] if level else along[:, 0, ::-1]
    axes.add_line(
        mpl.lines.Line2D(
            *foot.T, ls="", marker=_DOWN if level else _LEFT, ms=_LENGTH, mec="black",
            mew=rc["xtick.major.width"], transform=place, clip_on=False, zorder=2.0,
        )
    )  # fmt: skip


def _numbers(figure: Figure, axes: Axes, axis: Axis, at: Floats, level: bool) -> None:
    away = -(_LENGTH + _PAD) / 72.0
    place = axes.get_xaxis_transform() if level else axes.get_yaxis_transform()
    shifted = place + ScaledTranslation(
        0.0 if level else away, away if level else 0.0, figure.dpi_scale_trans
    )
    formatter = axis.get_major_formatter()
    texts = formatter.format_ticks(at.tolist())
    if formatter.get_offset():
        # A power of ten that matplotlib writes once, at the end of the axis; each number has it.
        texts = [f"{value:g}" for value in at.tolist()]
    for value, text in zip(at, texts, strict=True):
        axes.text(
            float(value) if level else 0.0, 0.0 if level else float(value), text,
            transform=shifted, ha="center" if level else "right",
            va="top" if level else "center_baseline",
        )  # fmt: skip

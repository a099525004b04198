"""Scatter of several demonstrations about their mean, over the share of the duration."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dmpcli.arrays import Floats
from dmpcli.dmp.contact_heights import demonstrated_scale
from dmpcli.dmp.skill import Skill
from dmpcli.reporting import drawing
from dmpcli.reporting.style import STYLES

_WIDE, _BESIDE, _HEIGHT = 3.7, 2.2, 1.05
_LEFT, _RIGHT, _GAP, _ASIDE, _TOP, _BOTTOM = 0.75, 0.2, 0.2, 0.75, 0.45, 0.5
_LENGTHS = ("u", "v", "w")
_ANGLES = (("about u", "-"), ("about v", "--"), ("about w", ":"))
_LEAST_LENGTH, _LEAST_ANGLE = 1e-3, 1e-3


@dataclass(frozen=True)
class _Row:
    """One panel of curves: mean and standard deviation, shape (P, k), what they are, and unit."""

    name: str
    unit: str
    mean: Floats
    deviation: Floats
    least: float


def spread_curves(skill: Skill) -> Figure:
    """Draw a skill's own stroke in a band of one standard deviation, and that deviation beside it.

    Parameters
    ----------
    skill : Skill
        With spread.
    """
    assert skill.spread is not None
    share, deviation = skill.spread.share, skill.spread.deviation
    mean = demonstrated_scale(skill, share * skill.duration)
    rows = [
        _Row(name, "mm", mean[:, i : i + 1], deviation[:, i : i + 1], _LEAST_LENGTH)
        for i, name in enumerate(_LENGTHS)
    ]
    if skill.oriented:
        turns = np.degrees(mean[:, 3:]), np.degrees(deviation[:, 3:])
        rows.append(_Row("angles", "°", *turns, _LEAST_ANGLE))
    tall = len(rows) * _HEIGHT + (len(rows) - 1) * _GAP
    wide = _LEFT + _WIDE + _ASIDE + _BESIDE + _RIGHT
    figure = drawing.page(wide, _BOTTOM + tall + _TOP)
    for number, row in enumerate(rows):
        bottom = _BOTTOM + (len(rows) - 1 - number) * (_HEIGHT + _GAP)
        left = drawing.panel(figure, _LEFT, bottom, _WIDE, _HEIGHT)
        right = drawing.panel(figure, _LEFT + _WIDE + _ASIDE, bottom, _BESIDE, _HEIGHT)
        _band(left, share, row)
        _alone(right, share, row)
        for axes in (left, right):
            axes.set_xlim(0.0, 1.0)
            axes.tick_params(labelbottom=number == len(rows) - 1)
            if number == len(rows) - 1:
                drawing.labels(axes, x="share of the duration")
        if number == 0:
            drawing.title(left, "(a)  mean, and one standard deviation")
            drawing.title(right, "(b)  standard deviation")
    return figure


def _band(axes: Axes, share: Floats, row: _Row) -> None:
    style = STYLES["demonstration"]
    low, high = row.mean - row.deviation, row.mean + row.deviation
    for i, (name, line) in zip(range(row.mean.shape[1]), _ANGLES, strict=False):
        axes.fill_between(share, low[:, i], high[:, i], color="#56B4E9", alpha=0.6, lw=0.0)
        axes.plot(share, row.mean[:, i], color=style.color, ls=line, lw=1.0, label=name)
    if row.mean.shape[1] > 1:
        axes.legend(fontsize=7.0, ncols=3, loc="best", handlelength=2.4, borderaxespad=0.2)
    margin = 0.06 * max(float(high.max() - low.min()), row.least)
    axes.set_ylim(float(low.min()) - margin, float(high.max()) + margin)
    drawing.labels(axes, y=f"{row.name} / {row.unit}")


def _alone(axes: Axes, share: Floats, row: _Row) -> None:
    for i, (_, line) in zip(range(row.mean.shape[1]), _ANGLES, strict=False):
        axes.plot(share, row.deviation[:, i], color="#0072B2", ls=line, lw=1.2)
    axes.set_ylim(0.0, 1.08 * max(float(row.deviation.max()), row.least))
    drawing.labels(axes, y=f"/ {row.unit}")

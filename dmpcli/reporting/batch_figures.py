"""Figures of a batch: how its measures are distributed, and its worst strokes."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dmpcli.arrays import Floats
from dmpcli.reporting import drawing
from dmpcli.reporting.batch import ALIKE, BINS, MeasuredBatch, histogram
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.style import STYLES

SHOWN = 3
"""Worst strokes drawn of each figure."""

NEAR = 0.2
"""The demonstration's wave height is shown with those that are off by less than this share."""

UNSEEN = 5e-4
"""Strokes that differ by no more are alike, mm or degrees: no table has so many digits."""

TITLES = {
    "wave_height": "wave height / mm",
    "nearest_rms": "deviation, RMS / mm",
    "nearest_max": "deviation, largest / mm",
    "goal_error": "off the goal / mm",
    "surface_distance_max": "off the surface, largest / mm",
    "surface_tilt_max": "tool off the normal, largest / °",
}
_ONE = {"wave_height": "wave", "nearest_max": "deviation", "surface_distance_max": "off surface"}

_WIDTH, _HEIGHT, _ACROSS, _UP = 2.6, 1.35, 0.85, 0.6
_TOP, _RIGHT = 0.3, 0.2
_CELL, _CELL_GAP = 1.85, 0.45


def distributions(many: MeasuredBatch) -> Figure | None:
    """Histograms of what is measured of every stroke; None where nothing is.

    A line marks the demonstration's wave height; the band holds 90 % of the strokes.
    """
    # One figure is held at a time: there may be millions of strokes.
    found = [name for name in TITLES if np.isfinite(many.values(name)).any()]
    if not found:
        return None
    rows = -(-len(found) // 2)
    figure = drawing.page(
        2 * (_ACROSS + _WIDTH) + _RIGHT, rows * (_UP + _HEIGHT) + _TOP + drawing.ROW
    )
    for i, name in enumerate(found):
        values = many.values(name)
        values = values[np.isfinite(values)]
        bottom = (rows - 1 - i // 2) * (_UP + _HEIGHT) + _UP
        left = _ACROSS + (i % 2) * (_ACROSS + _WIDTH)
        axes = drawing.panel(figure, left, bottom, _WIDTH, _HEIGHT)
        target = many.target if name == "wave_height" else None
        if target is not None and abs(target - np.median(values)) > NEAR * target:
            target = None
        _bars(axes, values, target)
        drawing.labels(axes, TITLES[name], "" if i % 2 else "strokes")
        drawing.title(axes, f"({'abcdefgh'[i]})")
    height = float(figure.get_size_inches()[1])
    figure.text(0.5, 1.0 - 0.5 * drawing.ROW / height,
        f"{many.label}: {len(many.batch):,} strokes; shaded: 90 % of them",
        ha="center", va="center", fontsize=8.0)  # fmt: skip
    return figure


def _alike(axes: Axes, values: Floats) -> None:
    """Say that all strokes have the same value: what they differ by is rounding."""
    value = float(np.median(values))
    axes.bar([0.0], [len(values)], width=0.2, color=STYLES["modified"].color)
    axes.set_xlim(-1.0, 1.0)
    told = f"{value:.3f}" if abs(value) >= 5e-4 else "0.000"
    axes.set_xticks([0.0], [f"all {told}"])


def bins_of(values: Floats) -> int:
    """How many bins values (k,) call for: few of few, and none that is narrower than they scatter.

    The rule is Freedman and Diaconis' (1981); where a quarter of the values are one, Sturges'.
    """
    few = int(np.ceil(np.log2(len(values)))) + 1
    low, high = np.quantile(values, [0.25, 0.75])
    width = 2.0 * float(high - low) / len(values) ** (1.0 / 3.0)
    if width <= 0.0:
        return min(few, BINS)
    return int(np.clip(np.ceil(float(np.ptp(values)) / width), few, BINS))


def _bars(axes: Axes, values: Floats, target: float | None) -> None:
    """Draw a histogram of values (k,), and where the demonstration stands."""
    shown = values if target is None else np.append(values, target)
    if float(np.ptp(values)) <= max(ALIKE * float(np.abs(values).max()), UNSEEN):
        _alike(axes, values)
        return
    counted = histogram(values, float(shown.min()), float(shown.max()), bins_of(values))
    assert counted is not None
    low, high = np.quantile(values, [0.05, 0.95])
    axes.axvspan(low, high, color="#F4E3C3", lw=0, zorder=0)
    axes.stairs(counted["counts"], counted["edges"], fill=True, color=STYLES["modified"].color)
    axes.margins(x=0.04)
    axes.set_ylim(bottom=0.0)
    axes.locator_params(axis="x", nbins=4)
    axes.locator_params(axis="y", nbins=4)
    if target is None:
        return
    axes.axvline(target, color=STYLES["demonstration"].color, lw=1.2, ls="--")
    right = target > np.median(values)
    axes.annotate(
        "demonstration", (target, 1.0), (-3 if right else 3, -2),
        xycoords=("data", "axes fraction"), textcoords="offset points",
        ha="right" if right else "left", va="top", fontsize=7.0,
    )  # fmt: skip


def worst(many: MeasuredBatch) -> Figure | None:
    """The worst strokes in their own charts, the demonstration under them; None without any.

    One row each: wave height, largest deviation, largest distance to a surface that was given.
    """
    rows = {name: many.worst_rows(name)[:SHOWN] for name in _ONE}
    rows = {name: found for name, found in rows.items() if found}
    if not rows:
        return None
    wanted = sorted({row for found in rows.values() for row in found})
    strokes = dict(zip(wanted, many.strokes(wanted), strict=True))
    cells = [
        (r, c, name, row) for r, (name, found) in enumerate(rows.items())
        for c, row in enumerate(found)
    ]  # fmt: skip
    curves = {row: _seen(strokes[row], many.sight.reference) for row in wanted}
    span = max(
        float(np.ptp(curve[:, :2], axis=0).max()) for pair in curves.values() for curve in pair
    )
    tall = max(float(np.ptp(curve[:, 1])) for pair in curves.values() for curve in pair)
    ratio = min(1.5, max(0.4, 1.15 * tall / span))
    cell = _CELL * ratio
    across, up = _CELL + _CELL_GAP, cell + 0.75
    figure = drawing.page(0.7 + SHOWN * across + _RIGHT, len(rows) * up + drawing.ROW + 0.1)
    for r, c, name, row in cells:
        bottom = 0.5 + drawing.ROW + (len(rows) - 1 - r) * up
        axes = drawing.panel(figure, 0.95 + c * across, bottom, _CELL, cell)
        *taught, drawn = curves[row]
        for curve in taught:
            drawing.draw(axes, curve[:, 0], curve[:, 1], STYLES["demonstration"])
        style = STYLES[strokes[row].role]
        drawing.draw(axes, drawn[:, 0], drawn[:, 1], style)
        axes.set_aspect("equal", adjustable="datalim")
        axes.locator_params(nbins=4)
        if r == len(rows) - 1:
            drawing.labels(axes, x="along / mm")
        if c == 0:
            drawing.labels(axes, y="across / mm")
        value = many.values(name)[row]
        axes.set_title(
            f"{many.batch.ids[row].as_py()}: {_ONE[name]} {value:.3f} mm", fontsize=7.5, pad=3.0
        )
    used = {strokes[row].role for row in wanted}
    key = [style for role, style in STYLES.items() if role in used]
    if any(len(pair) > 1 for pair in curves.values()):
        key.insert(0, STYLES["demonstration"])
    lines = [Line2D([], [], color=s.color, ls=s.line, lw=s.width) for s in key]
    figure.legend(
        lines, [s.name for s in key], loc="lower center", ncols=len(key), handlelength=3.2
    )
    return figure


def _seen(stroke: ReportedStroke, reference: ReportedStroke | None) -> list[Floats]:
    """Return the demonstration laid upon a stroke, if there is one, and the stroke: u, v, mm."""
    footing = stroke.footing
    if stroke.axes is None:
        if footing is None or footing.place is None:
            return [(stroke.position - stroke.start)[:, :2]]
        taught = [] if footing.demonstrated is None else [footing.demonstrated[:, :2]]
        return [*taught, footing.place[:, :2]]
    shown = [] if reference is None else [reference.carried_to(stroke)]
    curves = [curve for curve in [*shown, stroke.position] if curve is not None]
    return [((curve - stroke.start) @ stroke.axes)[:, :2] for curve in curves]

"""What the figures share: curves, pages laid out in inches, and files that come out the same."""

import contextlib
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dmpcli.arrays import Floats
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.style import RC, STYLES, PlotStyle

LEAST_SPAN = 10.0
"""Least span of an axis, mm: a hundredth of a millimetre of z shall not fill a panel."""

ROW = 0.20
"""Height of one legend row, inch."""


@dataclass(frozen=True)
class PlottedCurve:
    """A stroke as drawn: where, and under what name.

    Attributes
    ----------
    name : str
        For the legend, wave height included.
    style : PlotStyle
    t : array, shape (n,)
        s.
    position : array, shape (n, 3)
        mm; for the moved demonstration not where it was recorded.
    marks_t, marks : array, shape (m,) and (m, 3)
        Peaks and troughs of the wave, in turn.
    """

    name: str
    style: PlotStyle
    t: Floats
    position: Floats
    marks_t: Floats
    marks: Floats

    def unmarked(self, name: str) -> "PlottedCurve":
        """Return the bare line, thin, under another name."""
        thin = replace(self.style, width=0.6 * self.style.width)
        return replace(self, name=name, style=thin, marks_t=self.marks_t[:0], marks=self.marks[:0])


def curve_of(
    stroke: ReportedStroke, position: Floats | None = None, name: str | None = None
) -> PlottedCurve:
    """Return a stroke as a curve; `position` draws it elsewhere, `name` calls it otherwise."""
    style = STYLES[stroke.role]
    wave = stroke.wave
    at = stroke.position if position is None else position
    height = "" if wave.mean is None else f", {wave.mean:.2f} mm"
    return PlottedCurve(
        (name or style.name) + height,
        style,
        stroke.t,
        at,
        wave.at(stroke.t),
        wave.at(at),
    )


def page(width: float, height: float) -> Figure:
    """Return an empty figure of this size, inch."""
    return Figure(figsize=(width, height))


def panel(
    figure: Figure, left: float, bottom: float, width: float, height: float, **more: Any
) -> Axes:
    """Add axes at a place given in inches from the lower left corner."""
    w, h = figure.get_size_inches()
    return figure.add_axes((left / w, bottom / h, width / w, height / h), **more)


def letter(axes: Axes, text: str) -> None:
    """Write (a), (b), ... above the upper left corner."""
    axes.set_title(f"({text})", loc="left", fontsize=8.0, pad=4.0)


def draw(axes: Axes, x: Floats, y: Floats, style: PlotStyle) -> None:
    """Draw one line in its role's style."""
    axes.plot(
        x, y, color=style.color, ls=style.line, lw=style.width, zorder=style.order,
        solid_capstyle="round",
    )  # fmt: skip


def mark(axes: Axes, x: Floats, y: Floats, style: PlotStyle) -> None:
    """Mark the ends of each wave height: peaks and troughs as this panel shows them."""
    if len(y) == 0:
        return
    # Extrema alternate, so every second one is of a kind, whichever way the panel looks.
    first_up = np.mean(y[::2]) > np.mean(y[1::2]) if len(y) > 1 else True
    for begin, marker in ((0, "^" if first_up else "v"), (1, "v" if first_up else "^")):
        axes.plot(
            x[begin::2], y[begin::2], marker, ms=5.0, mfc="white", mec=style.color, mew=1.0,
            zorder=style.order + 10,
        )  # fmt: skip


def spanned(low: float, high: float, margin: float = 0.06) -> tuple[float, float]:
    """Limits around values, at least `LEAST_SPAN` apart."""
    span = max((high - low) * (1.0 + 2.0 * margin), LEAST_SPAN)
    middle = 0.5 * (low + high)
    return middle - 0.5 * span, middle + 0.5 * span


def legend(figure: Figure, curves: Sequence[PlottedCurve], columns: int) -> None:
    """Put the legend along the lower edge, outside all axes."""
    lines = [Line2D([], [], color=c.style.color, ls=c.style.line, lw=c.style.width) for c in curves]
    names = [c.name for c in curves]
    if _marked(curves):
        lines.append(Line2D([], [], color="black", ls="", marker="^", ms=5.0, mfc="white"))
        names.append("ends of a wave height")
    figure.legend(
        lines, names, loc="lower center", ncols=columns, handlelength=3.2, borderaxespad=0.3
    )


def legend_rows(curves: Sequence[PlottedCurve], columns: int) -> int:
    """Rows that the legend takes."""
    entries = len(curves) + (1 if _marked(curves) else 0)
    return -(-entries // columns)


def _marked(curves: Sequence[PlottedCurve]) -> bool:
    return any(len(curve.marks) for curve in curves)


def saved(figure: Figure) -> dict[str, bytes]:
    """Return the figure as the bytes of an SVG and of a PNG file, by suffix.

    The same figure gives the same bytes: no date, and identifiers that do not change.
    """
    files = {}
    for suffix, options in (
        ("svg", {"metadata": {"Date": None, "Creator": None}}),
        ("png", {"dpi": 150, "metadata": {"Software": None}}),
    ):
        sink = io.BytesIO()
        figure.savefig(sink, format=suffix, **options)
        files[suffix] = sink.getvalue()
    return files


@contextlib.contextmanager
def settings() -> Iterator[None]:
    """Context in which figures are made and saved: our settings, nobody's matplotlibrc."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(RC)
        yield

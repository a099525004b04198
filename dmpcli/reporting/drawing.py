"""What the figures share: curves, pages laid out in inches, and files that come out the same."""

import contextlib
import io
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dmpcli.arrays import Floats
from dmpcli.reporting import gaps
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.style import RC, STYLES, PlotStyle

LEAST_SPAN = 10.0
"""Least span of an axis, mm: a hundredth of a millimetre of z shall not fill a panel."""

_START: Any = {
    "marker": "o", "ms": 6.0, "mfc": "white", "mec": "black", "mew": 1.3, "ls": "",
}  # fmt: skip
_GOAL: Any = {
    "marker": "X", "ms": 7.0, "mfc": "black", "mec": "white", "mew": 0.6, "ls": "",
}  # fmt: skip

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
    number : str
        Written beside the curve, and before its name in the legend; nothing for none.
    shift : float
        How much later than the first curve it passes the same points of its path, s.
    turn : array, shape (n,), optional
        How far the tool is turned from where it began, degrees.
    """

    name: str
    style: PlotStyle
    t: Floats
    position: Floats
    marks_t: Floats
    marks: Floats
    number: str = ""
    shift: float = 0.0
    turn: Floats | None = None

    def called(self, name: str) -> "PlottedCurve":
        """Return the same curve under another name."""
        return replace(self, name=name)

    def plain(self) -> "PlottedCurve":
        """Return the same curve without its peaks and troughs."""
        return replace(self, marks_t=self.marks_t[:0], marks=self.marks[:0])

    def unmarked(self, name: str) -> "PlottedCurve":
        """Return the bare line, thin, under another name."""
        thin = replace(self.style, width=0.6 * self.style.width)
        return replace(self, name=name, style=thin, marks_t=self.marks_t[:0], marks=self.marks[:0])


def curve_of(
    stroke: ReportedStroke, position: Floats | None = None, name: str | None = None
) -> PlottedCurve:
    """Return a stroke as a curve.

    Parameters
    ----------
    stroke : ReportedStroke
    position : array, shape (n, 3), optional
        Where it is drawn instead, sample by sample, mm.
    name : str, optional
        What it is called instead; its wave height stands after either name.
    """
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


class Seen:
    """Coordinates in which a figure shows positions (n, 3)."""

    def __init__(self, origin: Floats, axes: Floats) -> None:
        self.origin, self.axes = origin, axes

    def __call__(self, position: Floats) -> Floats:
        """Return positions (..., 3) in these coordinates."""
        return np.asarray((position - self.origin) @ self.axes)


def page(width: float, height: float) -> Figure:
    """Return an empty figure of this size, inch."""
    return Figure(figsize=(width, height))


def panel(
    figure: Figure, left: float, bottom: float, width: float, height: float, **more: Any
) -> Axes:
    """Add axes at a place given in inches from the lower left corner.

    Parameters
    ----------
    figure : Figure
    left, bottom, width, height : float
        Inch.
    **more
        As `Figure.add_axes` takes it.
    """
    w, h = figure.get_size_inches()
    return figure.add_axes((left / w, bottom / h, width / w, height / h), **more)


def letter(axes: Axes, text: str) -> None:
    """Write (a), (b), ... above the upper left corner."""
    axes.set_title(f"({text})", loc="left", fontsize=8.0, pad=4.0)


def title(axes: Axes, text: str) -> None:
    """Write what a panel shows above its upper left corner."""
    # At a height of our own: to find one, matplotlib would lay out every tick.
    axes.set_title(text, loc="left", fontsize=8.0, y=1.0, pad=4.0)


def labels(axes: Axes, x: str = "", y: str = "") -> None:
    """Write what the axes of a panel are, at places of our own.

    To find places, matplotlib would lay out every tick.

    Parameters
    ----------
    axes : Axes
        Where it stands in its figure already.
    x, y : str
        With units; nothing is written of an empty one.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    width, height = axes.get_position().size * figure.get_size_inches()
    if x:
        axes.set_xlabel(x)
        axes.xaxis.set_label_coords(0.5, -0.26 / height)
    if y:
        axes.set_ylabel(y)
        axes.yaxis.set_label_coords(-0.66 / width, 0.5)


def draw(axes: Axes, x: Floats, y: Floats, style: PlotStyle, t: Floats | None = None) -> None:
    """Draw one line in its role's style; one of samples at times stops at gaps.

    Parameters
    ----------
    axes : Axes
    x, y : array, shape (n,)
        In the units of the axes.
    style : PlotStyle
    t : array, shape (n,), optional
        When the samples were taken, s.
    """
    apart = np.zeros(len(x) - 1, dtype=bool) if t is None else gaps.gaps(t)
    gaps.line(
        axes, x, y, apart, color=style.color, ls=style.line, lw=style.width, zorder=style.order,
        solid_capstyle="round",
    )  # fmt: skip


def mark(axes: Axes, x: Floats, y: Floats, style: PlotStyle) -> None:
    """Mark the ends of each wave height: peaks and troughs as this panel shows them.

    Parameters
    ----------
    axes : Axes
    x, y : array, shape (m,)
        Peaks and troughs in turn, whichever comes first.
    style : PlotStyle
    """
    if len(y) == 0:
        return
    # Extrema alternate, so every second one is of a kind, whichever way the panel looks.
    first_up = np.mean(y[::2]) > np.mean(y[1::2]) if len(y) > 1 else True
    for begin, marker in ((0, "^" if first_up else "v"), (1, "v" if first_up else "^")):
        axes.plot(
            x[begin::2], y[begin::2], marker, ms=5.0, mfc="white", mec=style.color, mew=1.0,
            zorder=style.order + 10,
        )  # fmt: skip


def number(axes: Axes, x: Floats, y: Floats, curve: PlottedCurve, share: float) -> None:
    """Write a curve's number on it, at a share of its samples.

    Parameters
    ----------
    axes : Axes
    x, y : array, shape (n,)
        The curve in this panel.
    curve : PlottedCurve
        One without a number gets none.
    share : float
        0 at the start, 1 at the goal.
    """
    if not curve.number:
        return
    i = round(share * (len(x) - 1))
    axes.text(
        x[i], y[i], curve.number, fontsize=6.5, ha="center", va="center", zorder=40,
        bbox={"boxstyle": "circle,pad=0.18", "fc": "white", "ec": curve.style.color, "lw": 0.8},
    )  # fmt: skip


def shares(count: int) -> list[float]:
    """Where on each of so many curves its number stands, so that none covers another."""
    return [0.12 + 0.76 * (k + 0.5) / count for k in range(count)]


def heading(axes: Axes, x: Floats, y: Floats, style: PlotStyle, share: float = 0.9) -> None:
    """Draw an arrowhead that says which way a curve runs.

    Parameters
    ----------
    axes : Axes
    x, y : array, shape (n,)
        The curve in this panel; one of no length gets none.
    style : PlotStyle
    share : float
        Of its length, where the arrow stands.
    """
    # By the way along it: samples lie close together where the tool is slow.
    way = np.append(0.0, np.hypot(np.diff(x), np.diff(y)).cumsum())
    if way[-1] == 0.0:
        return
    at = np.interp([share * way[-1], (share + 0.015) * way[-1]], way, np.arange(len(x)))
    ends = [(np.interp(i, np.arange(len(x)), x), np.interp(i, np.arange(len(x)), y)) for i in at]
    axes.annotate(
        "", ends[1], ends[0], zorder=34,
        arrowprops={
            "arrowstyle": "-|>", "fc": style.color, "ec": "black", "lw": 0.5,
            "mutation_scale": 15.0,
        },
    )  # fmt: skip


def ends(axes: Axes, start: Floats, goal: Floats) -> None:
    """Mark where strokes begin and where they end.

    Parameters
    ----------
    axes : Axes
    start, goal : array, shape (2,) or (3,)
        Of which the first two count, in the coordinates of the panel.
    """
    axes.plot(*start[:2], zorder=35, **_START)
    axes.plot(*goal[:2], zorder=35, **_GOAL)


def key_of_ends() -> list[tuple[Line2D, str]]:
    """What the legend says of those marks."""
    return [
        (Line2D([], [], **_START), "start"),
        (Line2D([], [], **_GOAL), "goal"),
    ]


def spanned(low: float, high: float, margin: float = 0.06) -> tuple[float, float]:
    """Limits around values, at least `LEAST_SPAN` apart.

    Parameters
    ----------
    low, high : float
        mm.
    margin : float
        Share of the span that is left free on either side.
    """
    span = max((high - low) * (1.0 + 2.0 * margin), LEAST_SPAN)
    middle = 0.5 * (low + high)
    return middle - 0.5 * span, middle + 0.5 * span


def legend(
    figure: Figure,
    curves: Sequence[PlottedCurve],
    columns: int,
    more: Sequence[tuple[Line2D, str]] = (),
) -> None:
    """Put the legend along the lower edge, outside all axes.

    Parameters
    ----------
    figure : Figure
    curves : sequence of PlottedCurve
        Where one has wave heights their marks get an entry too.
    columns : int
    more : sequence of (Line2D, str)
        Entries that are no curves, which stand last.
    """
    lines = [Line2D([], [], color=c.style.color, ls=c.style.line, lw=c.style.width) for c in curves]
    names = [f"{c.number}   {c.name}" if c.number else c.name for c in curves]
    if _marked(curves):
        lines.append(Line2D([], [], color="black", ls="", marker="^", ms=5.0, mfc="white"))
        names.append("ends of a wave height")
    for handle, name in more:
        lines.append(handle)
        names.append(name)
    figure.legend(
        lines, names, loc="lower center", ncols=columns, handlelength=3.2, borderaxespad=0.3
    )


def legend_rows(curves: Sequence[PlottedCurve], columns: int, more: int = 0) -> int:
    """Rows that the legend takes, with so many entries that are no curves.

    Parameters
    ----------
    curves : sequence of PlottedCurve
    columns : int
    more : int
        As `legend` will get them, so that a page leaves `ROW` inch for each row.
    """
    entries = len(curves) + (1 if _marked(curves) else 0) + more
    return -(-entries // columns)


def _marked(curves: Sequence[PlottedCurve]) -> bool:
    return any(len(curve.marks) for curve in curves)


def saved(figure: Figure, png: bool = True) -> dict[str, bytes]:
    """Return the figure as the bytes of an SVG file, and of a PNG file, by suffix.

    The same figure gives the same bytes: no date, and identifiers that do not change.
    """
    files = {}
    forms: dict[str, dict[str, Any]] = {"svg": {"metadata": {"Date": None, "Creator": None}}}
    if png:
        forms["png"] = {"dpi": 150, "metadata": {"Software": None}}
    for suffix, options in forms.items():
        sink = io.BytesIO()
        figure.savefig(sink, format=suffix, **options)
        files[suffix] = sink.getvalue()
    return files


@contextlib.contextmanager
def settings(text: bool = False) -> Iterator[None]:
    """Context in which figures are made and saved: our settings, nobody's matplotlibrc.

    Parameters
    ----------
    text : bool
        Whether letters of an SVG stay letters, which a page can search, instead of outlines.
    """
    with mpl.rc_context(), warnings.catch_warnings():
        # Of a file's name in letters that its font has not; a browser has them.
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        mpl.rcdefaults()
        mpl.rcParams.update(RC | ({"svg.fonttype": "none"} if text else {}))
        yield

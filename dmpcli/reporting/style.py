"""One fixed style per role, so that a colour means the same in every figure.

Colours are Okabe and Ito's, told apart by colour-blind eyes; line styles tell them apart in grey.
"""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class PlotStyle:
    """How the curves of one role are drawn, and what the legend calls them."""

    name: str
    color: str
    line: str | tuple[int, tuple[float, ...]]
    width: float = 1.4
    order: int = 3


# What good curves lie upon is drawn wider and first, so that it stays in sight beneath them.
STYLES = {
    "reference": PlotStyle("reference", "#D40000", "-", 3.6, 2),
    "demonstration": PlotStyle("demonstration", "#000000", "-", 2.2, 3),
    "builtin": PlotStyle("built-in drag", "#0072B2", (0, (6, 1.5)), 1.4, 3),
    "original axis": PlotStyle("original DMP", "#009E73", "--", 1.6, 4),
    "original distance": PlotStyle("original DMP by distance", "#009E73", "-.", 1.6, 4),
    "modified": PlotStyle("modified DMP", "#E69F00", "-", 1.2, 5),
    "run": PlotStyle("run, actual", "#9A4F96", (0, (1, 1)), 1.6, 6),
}

RC: Any = {
    "font.size": 8.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.5,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "legend.frameon": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "svg.hashsalt": "dmpcli",
    "text.parse_math": False,
}
"""matplotlib settings of every figure; the reader's own matplotlibrc has no say.

What stands between two dollars of a file's name is no formula.
"""

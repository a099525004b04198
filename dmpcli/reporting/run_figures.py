"""What a run did: how hard the tool pressed, how punctual the set-points were, how it followed."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dmpcli.arrays import Booleans, Floats
from dmpcli.records.record import Record
from dmpcli.reporting import contact, drawing, tracking
from dmpcli.reporting.gaps import gaps, line

_WIDTH, _PANEL = 5.9, 1.4
_LEFT, _RIGHT, _GAP, _TOP, _BOTTOM = 0.95, 0.2, 0.62, 0.3, 0.55
_FORCE, _ASIDE, _REST, _LINE = "#0072B2", "#D55E00", "#AAAAAA", "#444444"
_LEAST_FORCE = 1.0
_LEAST_LATE, _LEAST_OFF = 0.1, 0.01
"""Least spans of their panels, ms and mm: what is rounding shall not fill them."""


def force_figure(run: Record, row: dict[str, float] | None) -> Figure | None:
    """Draw the force of a run over time (a) and along its path (b); None where none was felt.

    Parameters
    ----------
    run : Record
    row : dict, optional
        As `contact.contact_of` has it.
    """
    normal = contact.force_along_normal(run)
    if normal is None or row is None:
        return None
    force = run.stack(contact.FORCE)
    aside = np.sqrt(np.maximum((force**2).sum(axis=1) - normal**2, 0.0))
    drawing_ = run.columns["phase"] == "stroke"
    meant = run.provenance.options.get("force_setpoint")
    meant = meant if run.provenance.options.get("coupling") == "force" else None
    key = [
        (Line2D([], [], color=_FORCE, lw=1.3), "along the normal, pressing is positive"),
        (Line2D([], [], color=_ASIDE, lw=1.0, ls="--"), "across the normal: friction"),
        (Line2D([], [], color=_REST, lw=1.0), "while it does not draw"),
        (Line2D([], [], color=_LINE, lw=0.8, ls=":"), f"contact from {row['threshold']:g} N"),
    ]
    if meant is not None:
        key.append((Line2D([], [], color=_LINE, lw=1.0, ls="-."), f"meant: {meant:g} N"))
    foot = _BOTTOM + drawing.ROW * -(-len(key) // 2)
    figure = drawing.page(_LEFT + _WIDTH + _RIGHT, foot + 2 * _PANEL + _GAP + _TOP)
    over_time = drawing.panel(figure, _LEFT, foot + _PANEL + _GAP, _WIDTH, _PANEL)
    along = drawing.panel(figure, _LEFT, foot, _WIDTH, _PANEL)
    _over_time(over_time, run.t, normal, drawing_)
    apart = gaps(run.t)
    shown = np.where(drawing_, aside, np.nan)
    line(over_time, run.t, shown, apart, color=_ASIDE, lw=1.0, ls="--")
    way = _way_of_strokes(run.position(), drawing_)
    for values, colour, dashes in ((normal, _FORCE, "-"), (aside, _ASIDE, "--")):
        shown = np.where(drawing_, values, np.nan)
        line(along, way, shown, apart, color=colour, lw=1.2, ls=dashes)
    largest = max(float(np.nanmax(np.abs(force), initial=0.0)), meant or 0.0, _LEAST_FORCE)
    for axes in (over_time, along):
        axes.axhline(row["threshold"], color=_LINE, lw=0.8, ls=":")
        if meant is not None:
            axes.axhline(meant, color=_LINE, lw=1.0, ls="-.")
        axes.set_ylim(1.1 * float(np.nanmin(normal, initial=0.0)), 1.15 * largest)
        drawing.labels(axes, y="force / N")
    over_time.set_xlim(float(run.t[0]), float(run.t[-1]))
    along.set_xlim(0.0, float(way[-1]) or 1.0)
    drawing.title(over_time, "(a)  over time")
    drawing.labels(over_time, x="t / s")
    drawing.title(along, "(b)  along the drawn path")
    drawing.labels(along, x="path / mm")
    _key(figure, key)
    return figure


def deadline_figure(run: Record) -> Figure:
    """Draw how late each set-point of a run was sent (a), and how far the arm was behind (b)."""
    deadline = np.asarray(run.columns["deadline"], dtype=float)
    late = 1e3 * np.asarray(run.columns["lateness"], dtype=float)
    off = tracking.tracking(run)
    drawn = run.columns["phase"] == "stroke"
    key = [
        (Line2D([], [], color=_FORCE, lw=1.3), "while it draws"),
        (Line2D([], [], color=_REST, lw=1.0), "while it does not draw"),
    ]
    foot = _BOTTOM + drawing.ROW
    figure = drawing.page(_LEFT + _WIDTH + _RIGHT, foot + 2 * _PANEL + _GAP + _TOP)
    panels = (
        (
            (foot + _PANEL + _GAP, late, _LEAST_LATE),
            ("late / ms", "(a)  how much later than due it was sent"),
        ),
        (
            (foot, off, _LEAST_OFF),
            ("off / mm", "(b)  distance of the arm from where it should have been"),
        ),
    )
    for (bottom, values, least), (name, title) in panels:
        axes = drawing.panel(figure, _LEFT, bottom, _WIDTH, _PANEL)
        _over_time(axes, deadline, values, drawn)
        axes.set_xlim(float(deadline[0]), float(deadline[-1]) or 1.0)
        axes.set_ylim(0.0, 1.15 * float(np.nanmax(values, initial=least)))
        drawing.labels(axes, y=name)
        drawing.title(axes, title)
        drawing.labels(axes, x="t / s")
    _key(figure, key)
    return figure


def _over_time(axes: Axes, t: Floats, values: Floats, drawn: Booleans) -> None:
    apart = gaps(t)
    line(axes, t, np.where(drawn, np.nan, values), apart, color=_REST, lw=1.0)
    line(axes, t, np.where(drawn, values, np.nan), apart, color=_FORCE, lw=1.2)


def _way_of_strokes(position: Floats, drawn: Booleans) -> Floats:
    """Length of what was drawn up to each sample, mm, shape (n,)."""
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
    return np.append(0.0, np.where(drawn[1:] & drawn[:-1], steps, 0.0).cumsum())


def _key(figure: Figure, key: list[tuple[Line2D, str]]) -> None:
    figure.legend(
        [handle for handle, _ in key], [name for _, name in key], loc="lower center", ncols=2,
        handlelength=3.2, borderaxespad=0.3,
    )  # fmt: skip

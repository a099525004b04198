"""What a force coupling did: force, set-point, correction and state over time, and on the path."""

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from dmpcli.arrays import Booleans, Floats
from dmpcli.records.record import Record
from dmpcli.reporting import contact, drawing
from dmpcli.reporting.gaps import gaps, line, usual_step

_WIDTH, _PANEL, _STRIP, _PATH = 5.9, 1.4, 0.22, 2.2
_BAR = 0.85
_LEFT, _RIGHT, _GAP, _TOP, _BOTTOM = 0.95, 0.2, 0.62, 0.3, 0.55
_FORCE, _MEANT, _E, _REST = "#0072B2", "#444444", "#D55E00", "#AAAAAA"
STATES = {
    "free": "#DDDDDD",
    "seeking": "#F0E442",
    "landing": "#56B4E9",
    "drawing": "#009E73",
    "lost": "#E69F00",
    "too hard": "#D55E00",
    "oscillating": "#CC79A7",
    "retreating": "#999999",
}
"""States of a contact, and the colour of each."""
_MAP = "viridis"


def contact_figure(run: Record) -> Figure | None:
    """Draw what the coupling of a run did; None of a run that had none.

    Force and set-point (a), the correction e of eq. (10) (b) and the state (c) over time, and the
    force along the drawn path in colour (d).

    Parameters
    ----------
    run : Record
    """
    normal = contact.force_along_normal(run)
    if normal is None or not run.has("coupling", "fn", "contact"):
        return None
    drawn = np.asarray(run.columns["phase"] == "stroke")
    if not drawn.any():
        return None
    t, meant = run.t, np.asarray(run.columns["fn"], dtype=float)
    e = np.asarray(run.columns["coupling"], dtype=float)
    states = np.array([str(word or "") for word in run.columns["contact"]], dtype=object)
    present = [name for name in STATES if (states == name).any()]
    key: list[Line2D | Patch] = [
        Line2D([], [], color=_FORCE, lw=1.3, label="force along the normal"),
        Line2D([], [], color=_MEANT, lw=1.0, ls="-.", label="set-point"),
        Line2D([], [], color=_E, lw=1.2, label="e of eq. (10)"),
        Line2D([], [], color=_REST, lw=1.0, label="while it does not draw"),
        *(Patch(color=STATES[name], label=name) for name in present),
    ]
    if np.isnan(normal[drawn]).any():
        key.append(Line2D([], [], color=_REST, lw=2.4, label="path without a known force"))
    apart = gaps(t)
    foot = _BOTTOM + drawing.ROW * -(-len(key) // 3)
    heights = (_PATH, _STRIP, _PANEL, _PANEL)
    bottoms = [foot + sum(heights[:i]) + _GAP * i for i in range(4)]
    figure = drawing.page(_LEFT + _WIDTH + _RIGHT, bottoms[-1] + _PANEL + _TOP)
    widths = (_WIDTH - _BAR, _WIDTH, _WIDTH, _WIDTH)
    path, strip, shift, force = (
        drawing.panel(figure, _LEFT, bottom, width, height)
        for bottom, width, height in zip(bottoms, widths, heights, strict=True)
    )
    bar = drawing.panel(figure, _LEFT + _WIDTH - _BAR + 0.15, foot, 0.13, _PATH)
    largest = max(float(np.nanmax(normal[drawn], initial=1.0)), float(meant.max()), 1.0)
    line(force, t, np.where(drawn, np.nan, normal), apart, color=_REST, lw=1.0)
    line(force, t, np.where(drawn, normal, np.nan), apart, color=_FORCE, lw=1.2)
    line(force, t, np.where(drawn, meant, np.nan), apart, color=_MEANT, lw=1.0, ls="-.")
    force.set_ylim(1.1 * float(np.nanmin(normal, initial=0.0)), 1.15 * largest)
    # On the ways e has no meaning, and the file has 0.
    line(shift, t, np.where(drawn | (e == 0.0), np.nan, e), apart, color=_REST, lw=1.0)
    line(shift, t, np.where(drawn, e, np.nan), apart, color=_E, lw=1.2)
    for name in present:
        spans = _spans(t, states == name)
        strip.broken_barh(spans, (0.0, 1.0), color=STATES[name])
    strip.set_ylim(0.0, 1.0)
    strip.set_yticks([])
    for axes, title, y in (
        (force, "(a)  force and set-point over time", "force / N"),
        (shift, "(b)  correction e over time", "e / mm"),
        (strip, "(c)  state of the contact over time", ""),
    ):
        axes.set_xlim(float(t[0]), float(t[-1]))
        drawing.title(axes, title)
        drawing.labels(axes, x="t / s", y=y)
    _on_path(path, bar, _flat(run, drawn), normal, drawn[1:] & drawn[:-1] & ~apart)
    figure.legend(handles=key, loc="lower center", ncols=3, handlelength=2.6, borderaxespad=0.3)
    return figure


def _on_path(axes: Axes, bar: Axes, path: Floats, force: Floats, both: Booleans) -> None:
    """Draw the path of what was drawn, coloured by the force, from each sample to the next."""
    pieces = np.stack([path[:-1], path[1:]], axis=1)[both]
    colours = mpl.colormaps[_MAP].with_extremes(bad=_REST)
    lines = LineCollection(list(pieces), cmap=colours, linewidths=2.4)
    lines.set_array(0.5 * (force[1:] + force[:-1])[both])
    axes.add_collection(lines)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale()
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.colorbar(lines, cax=bar).set_label("force / N")
    drawing.title(axes, "(d)  force along the drawn path")
    drawing.labels(axes, x="along / mm", y="across / mm")


def _spans(t: Floats, there: Booleans) -> list[tuple[float, float]]:
    """Begin and length of each time in which something holds, s."""
    begins = np.flatnonzero(there & ~np.append(False, there[:-1] & ~gaps(t)))
    lasts = np.flatnonzero(there & ~np.append(there[1:] & ~gaps(t), False))
    ends = np.append(t[1:], t[-1] + usual_step(t))
    ends[:-1][gaps(t)] = t[:-1][gaps(t)] + usual_step(t)
    return [
        (float(t[first]), float(ends[last] - t[first]))
        for first, last in zip(begins, lasts, strict=True)
    ]


def _flat(run: Record, drawn: Booleans) -> Floats:
    """Positions from the drawn part's start, in the plane that it spans, shape (n, 2), mm."""
    position = run.position()
    here = position[drawn]
    away = here[-1] - here[0]
    centred = here - here.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    along = axes[0]
    span = float(np.ptp(centred @ along))
    if float(np.linalg.norm(away)) > 0.1 * span:
        along = away / np.linalg.norm(away)
    normal = axes[2]
    # To the tool's side, as the normals that are planned are.
    rotation = run.rotation()
    if rotation is not None and normal @ rotation[drawn][0, :, 2] > 0.0:
        normal = -normal
    across = np.cross(normal, along)
    made: Floats = (position - here[0]) @ np.stack([along, across / np.linalg.norm(across)], axis=1)
    return made

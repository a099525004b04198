"""The report's tables, as rich renderables: numbers to the right, nothing wider than 80 columns."""

import io
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from dmpcli.errors import printable
from dmpcli.reporting.stroke_measures import Row

_NOTHING = "-"

WORST = 3
"""Strokes that the table of the worst names for each figure; the document names more."""

REASONS = 10
"""Reasons for which pairs were not drawn that have a row of their own."""


def number(value: float | None, digits: int) -> str:
    """Return a number with so many decimals, or a dash where there is none."""
    return _NOTHING if value is None else f"{value:.{digits}f}"


def shape(rows: Sequence[Row]) -> Table:
    """Wave heights, and deviation from the demonstration with start and goal aligned."""
    table = _table(
        "Shape, mm",
        "stroke",
        *("waves", "height", "spread", "nearest RMS", "nearest max", "phase RMS"),
    )
    for row in rows:
        wave, off = row["wave"], row["deviation"] or {}
        table.add_row(
            row["stroke"],
            str(len(wave["heights"])),
            number(wave["mean"], 3),
            number(wave["spread"], 3),
            number(off.get("nearest_rms"), 4),
            number(off.get("nearest_max"), 4),
            number(off.get("phase_rms"), 4),
        )
    return table


def waves(rows: Sequence[Row]) -> Table | None:
    """Each height of the strokes that have several; None where none has."""
    several = [row for row in rows if len(row["wave"]["heights"]) > 1]
    if not several:
        return None
    table = _table("Each wave height, mm", "stroke")
    table.add_column("from the start on", justify="left", overflow="fold")
    for row in several:
        table.add_row(row["stroke"], "  ".join(number(h, 3) for h in row["wave"]["heights"]))
    return table


def drag(rows: Sequence[Row]) -> Table | None:
    """How closely each demonstration follows the curve it was dragged along; None without one."""
    followed = [row for row in rows if row["guide"]]
    if not followed:
        return None
    table = _table("Drag, distance from the reference, mm", "demonstration")
    table.add_column("method")
    for title in ("RMS", "max", "LDLJ", "SPARC"):
        table.add_column(title, justify="right", no_wrap=True)
    for row in followed:
        table.add_row(
            row["stroke"],
            "built-in" if row["role"] == "builtin" else "admittance",
            number(row["guide"]["rms"], 3),
            number(row["guide"]["max"], 3),
            number(row["ldlj"], 2),
            number(row["sparc"], 2),
        )
    return table


def motion(rows: Sequence[Row]) -> Table:
    """Length, time, smoothness and how far the ends are from where they should be."""
    table = _table(
        "Motion and ends",
        "stroke",
        *("length mm", "time s", "peak mm/s", "LDLJ", "SPARC", "start off", "goal off"),
    )
    for row in rows:
        table.add_row(
            row["stroke"],
            number(row["length"], 2),
            number(row["duration"], 2),
            number(row["peak_speed"], 1),
            number(row["ldlj"], 2),
            number(row["sparc"], 2),
            number(row["start_error"], 4),
            number(row["goal_error"], 4),
        )
    return table


def on_surface(name: str, rows: Sequence[Row]) -> Table | None:
    """Wave height along the surface, distance to it, tool against normal; None without strokes."""
    placed = [(row["stroke"], row["surface"]) for row in rows if row["surface"]]
    if not placed:
        return None
    table = _table(
        f"On the surface ({name}), mm and degrees",
        "stroke",
        *("height", "spread", "off max", "off RMS", "tilt max", "tilt mean"),
    )
    for stroke, lies in placed:
        table.add_row(
            stroke,
            number(lies["wave_height"], 3),
            number(lies["wave_spread"], 3),
            number(lies["distance_max"], 4),
            number(lies["distance_rms"], 4),
            number(lies["tilt_max"], 2),
            number(lies["tilt_mean"], 2),
        )
    return table


def along_surface(rows: Sequence[Row]) -> Table | None:
    """Length against the demonstration's, stretch of the pieces, and ends; None without strokes."""
    placed = [(row["stroke"], row["surface"]) for row in rows if row["surface"]]
    if not placed:
        return None
    table = _table(
        "Along the surface, mm and percent",
        "stroke",
        *("length", "change", "pieces from", "to", "start off", "goal off"),
    )
    for stroke, lies in placed:
        table.add_row(
            stroke,
            number(lies["length"], 2),
            _percent(lies["length_change"]),
            _percent(lies["stretch_least"]),
            _percent(lies["stretch_largest"]),
            number(lies["start_error"], 4),
            number(lies["goal_error"], 4),
        )
    return table


def _percent(share: float | None) -> str:
    return _NOTHING if share is None else f"{100.0 * share:+.2f} %"


def deadlines(runs: Sequence[tuple[str, Row]]) -> Table:
    """Lateness of each run's set-points, and how closely the arm followed them."""
    table = _table(
        "Deadlines, lateness in ms; tracking behind the look-ahead in mm",
        "run",
        *("cycles", "p50", "p99", "max", "missed", "track RMS", "track max"),
    )
    for name, row in runs:
        table.add_row(
            name,
            str(row["cycles"]),
            *(number(1e3 * row[key], 3) for key in ("median", "p99", "worst")),
            str(row["missed"]),
            number(row["tracking_rms"], 3),
            number(row["tracking_max"], 3),
        )
    return table


FIGURES = {
    "wave_height": ("wave height, mm", 3),
    "nearest_rms": ("nearest RMS, mm", 4),
    "nearest_max": ("nearest max, mm", 4),
    "phase_rms": ("phase RMS, mm", 4),
    "length": ("length, mm", 2),
    "duration": ("time, s", 2),
    "ldlj": ("LDLJ", 2),
    "sparc": ("SPARC", 2),
    "start_error": ("start off, mm", 4),
    "goal_error": ("goal off, mm", 4),
    "surface_distance_max": ("off the surface, mm", 4),
    "surface_tilt_max": ("off the normal, degrees", 2),
    "surface_length_change": ("length over demonstrated, 1", 5),
}
"""What tables call the figures of many strokes, and their decimals."""


def statistics(name: str, row: Row) -> Table:
    """Distribution of each figure over a file of many strokes."""
    table = _table(
        f"{name}: {row['count']} strokes",
        "figure",
        *("least", "5 %", "median", "95 %", "largest", "spread"),
    )
    for key, (title, digits) in FIGURES.items():
        if key.startswith("surface") and row["statistics"][key] is None:
            continue
        spread = row["statistics"][key] or {"quantiles": {}}
        quantiles = spread["quantiles"]
        values = [spread.get("least"), quantiles.get("0.05"), spread.get("median")]
        values += [quantiles.get("0.95"), spread.get("largest"), spread.get("spread")]
        table.add_row(title, *(number(value, digits) for value in values))
    return table


def worst(name: str, entry: Row) -> Table:
    """The worst strokes of a batch by each figure, the very worst first."""
    table = _table(f"{name}: worst strokes", "figure", "value")
    table.add_column("pair", overflow="fold")
    table.add_column("part", overflow="fold")
    for key, rows in entry["worst"].items():
        title, digits = FIGURES[key]
        if not rows and entry["statistics"][key]:
            table.add_row(title, number(entry["statistics"][key]["median"], digits), "all alike")
        for i, row in enumerate(rows[:WORST]):
            value = number(row["value"], digits)
            table.add_row("" if i else title, value, row["id"], row["part"])
    return table


def failures(name: str, rows: Sequence[Row]) -> Table:
    """Why pairs of a batch were not drawn, the commonest reason first."""
    table = _table(f"{name}: not drawn", "pairs", "first")
    table.add_column("reason", overflow="fold")
    for row in rows[:REASONS]:
        table.add_row(str(row["count"]), row["first"], row["reason"])
    if len(rows) > REASONS:
        rest = sum(row["count"] for row in rows[REASONS:])
        table.add_row(str(rest), "", f"{len(rows) - REASONS} more reasons")
    return table


def paper(comparison: Row) -> Table:
    """One of the paper's tables, its wave heights beside ours."""
    table = _table(f"Table {comparison['table']} of the paper: {comparison['title']}, mm", "stroke")
    table.add_column("from", overflow="fold")
    for title in ("paper", "ours", "ours - paper"):
        table.add_column(title, justify="right", no_wrap=True)
    for row in comparison["rows"]:
        table.add_row(
            row["name"],
            row["stroke"],
            number(row["paper"], 3),
            number(row["ours"], 3),
            _NOTHING if row["difference"] is None else f"{row['difference']:+.3f}",
        )
    return table


def _table(title: str, first: str, *others: str) -> Table:
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    table.add_column(first, overflow="fold")
    for name in others:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def plain(items: Sequence[Table | str], width: int) -> str:
    """Render tables and lines of text, `width` columns wide, without any terminal codes."""
    sink = io.StringIO()
    console = Console(file=sink, width=width, color_system=None, force_terminal=False, emoji=False)
    for item in items:
        if isinstance(item, Table):
            # rich would fold a title to the table's width.
            title, item.title = item.title, None
            if title:
                console.print(title, highlight=False, markup=False)
        console.print(item, highlight=False, markup=False)
    lines = printable(sink.getvalue()).removesuffix("\n").split("\n")
    return "".join(f"{line.rstrip()}\n" for line in lines)

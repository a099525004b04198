"""How hard the tool of a run pressed: a row of the report and its table."""

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from rich.table import Table

from dmpcli.arrays import Floats
from dmpcli.metrics.contact import contact
from dmpcli.records.record import Record
from dmpcli.reporting import tables
from dmpcli.reporting.stroke_measures import Row

THRESHOLD = 0.5
"""N; less is no contact where a run's file does not say what is."""

FORCE = ("fx", "fy", "fz")
"""Columns of the force on the tool, N, base axes."""


def contact_of(run: Record) -> Row | None:
    """Force along the normal while a run drew; None where nothing was felt.

    A force coupling has said it itself. Of other runs the normal is the plane's that the file
    tells, else the direction back along the tool. ``unknown`` is the share of what was drawn
    whose force nobody knows, where there is any.

    Parameters
    ----------
    run : Record
    """
    said, force = run.provenance.facts.get("contact"), force_along_normal(run)
    drawn = None if force is None else force[run.columns["phase"] == "stroke"]
    known = None if drawn is None else np.isfinite(drawn)
    missing = {}
    if known is not None and not known.all():
        missing["unknown"] = float(1.0 - known.mean())
    if isinstance(said, dict):
        return dict(said) | missing
    if drawn is None or known is None or not known.any():
        return None
    return asdict(contact(drawn[known], THRESHOLD)) | missing


def force_along_normal(run: Record) -> Floats | None:
    """Return the force along the normal at each row of a run, shape (n,), N; None if none was felt.

    Pressing is positive.
    """
    if not run.has(*FORCE):
        return None
    normal = _normals(run)
    return None if normal is None else np.asarray(np.sum(run.stack(FORCE) * normal, axis=1))


def table(rows: Sequence[tuple[str, Row]]) -> Table:
    """Return the table of the forces; each run with its name."""
    title = "Force along the normal while drawing, N"
    made = Table(title=title, title_justify="left", box=None, pad_edge=False)
    made.add_column("run", overflow="fold")
    for name in ("mean", "least", "largest", "no contact"):
        made.add_column(name, justify="right", no_wrap=True)
    for name, row in rows:
        forces = (tables.number(row[key], 2) for key in ("mean", "least", "largest"))
        made.add_row(name, *forces, f"{100.0 * row['absent']:.2f} %")
    return made


def coupled_table(rows: Sequence[tuple[str, Row]]) -> Table | None:
    """Return the table of what force couplings held; None where there was none.

    Parameters
    ----------
    rows : sequence of (str, dict)
        As of `table`; those of a coupling have its own figures.
    """
    held = [(name, row) for name, row in rows if "rms_error" in row]
    if not held:
        return None
    title = "What the force coupling held: N, N/mm, s, degrees"
    made = Table(title=title, title_justify="left", box=None, pad_edge=False)
    made.add_column("run", overflow="fold")
    for name in ("contact", "RMS", "limited", "landing", "k", "delay", "lean", "friction"):
        made.add_column(name, justify="right", no_wrap=True)
    for name, row in held:
        lean = row.get("normal_angle")
        made.add_row(
            name,
            f"{100.0 * row['share']:.2f} %",
            tables.number(row["rms_error"], 3),
            f"{100.0 * row['saturated']:.1f} %",
            tables.number(row.get("landing_peak"), 2),
            tables.number(row.get("stiffness"), 2),
            tables.number(row.get("delay"), 3),
            tables.number(None if lean is None else float(np.degrees(lean["mean"])), 1),
            tables.number(row.get("friction"), 2),
        )
    return made


def _normals(run: Record) -> Floats | None:
    """Unit normals on the tool's side, shape (n, 3)."""
    facts, rotation = run.provenance.facts, run.rotation()
    known = dict(facts.get("trajectory") or {}).get("normal")
    if known is None and rotation is None:
        return None
    normals = np.empty((len(run.t), 3))
    normals[:] = known if rotation is None or known is not None else -rotation[:, :, 2]
    for stroke in facts.get("strokes", ()):
        if stroke.get("normal") is not None and "id" in run.columns:
            normals[run.columns["id"] == stroke["id"]] = stroke["normal"]
    return normals

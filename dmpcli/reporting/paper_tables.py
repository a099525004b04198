"""The paper's Tables 1 and 2, its wave heights beside ours, and what literal eq. (7) does."""

from collections.abc import Sequence

from dmpcli.metrics import paper_values
from dmpcli.metrics.paper_values import REPRODUCTION, Experiment
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.stroke_measures import Row

_ALIKE = 0.01
"""Factors of eq. (7) that differ by less than this call for no remark."""

_ROLES = {
    "original axis": ("original", "original DMP, eq. (7) per axis"),
    "original distance": ("original", "original DMP, by distance"),
    "modified": ("modified", "modified DMP"),
}


def comparisons(strokes: Sequence[ReportedStroke]) -> list[Row]:
    """Return the tables that the strokes reproduce.

    Parameters
    ----------
    strokes : sequence of ReportedStroke
        The first demonstration that starts and ends at the paper's points (within 1 mm) counts,
        and every trajectory at the points of Table 1 or 2.

    Returns
    -------
    list of dict
        table, title, rows of ``name, stroke, role, paper, ours, difference``, and notes. Empty
        unless a stroke was taught where the paper's was, and not by a person at a real arm.
    """
    taught = next(
        (
            stroke
            for stroke in strokes
            if stroke.kind == "demonstration"
            and stroke.staged
            and paper_values.experiment_at(stroke.start, stroke.goal) is REPRODUCTION
        ),
        None,
    )
    if taught is None:
        return []
    planned = [stroke for stroke in strokes if stroke.kind == "trajectory"]
    found = []
    for experiment in paper_values.EXPERIMENTS:
        here = [s for s in planned if paper_values.experiment_at(s.start, s.goal) is experiment]
        if here:
            found.append(_comparison(experiment, taught, here))
    return found


def _comparison(
    experiment: Experiment, taught: ReportedStroke, here: Sequence[ReportedStroke]
) -> Row:
    kind = "demonstration, simulated" if taught.simulated else "demonstration"
    rows = [_row(kind, "demonstration", taught, experiment.demonstration)]
    for role, (printed, name) in _ROLES.items():
        rows += [
            _row(name, role, stroke, experiment.printed(printed))
            for stroke in here
            if stroke.role == role
        ]
    return {
        "table": experiment.table,
        "title": experiment.title,
        "rows": rows,
        "notes": _notes(experiment, taught, here),
    }


def _row(name: str, role: str, stroke: ReportedStroke, printed: float) -> Row:
    ours = stroke.wave.mean
    return {
        "name": name,
        "stroke": stroke.label,
        "role": role,
        "paper": printed,
        "ours": ours,
        "difference": None if ours is None else ours - printed,
    }


def _notes(
    experiment: Experiment, taught: ReportedStroke, here: Sequence[ReportedStroke]
) -> list[str]:
    """Say plainly what the literal factor (g - x0) of eq. (7) does to the wave."""
    literal = next((s for s in here if s.role == "original axis"), None)
    if literal is None or literal.wave.mean is None:
        return []
    taught = taught.seen_for(literal)
    old, new = (float(s.goal[1] - s.start[1]) for s in (taught, literal))
    if old == 0.0 or abs(new / old - 1.0) < _ALIKE:
        return []
    if experiment is REPRODUCTION:
        verdict = "The demonstration ended elsewhere; drawn at its own ends the factor is 1."
    else:
        verdict = (
            f"The paper prints {experiment.original:.3f} mm, so its authors cannot have scaled per "
            f"axis; the ratio of the start-goal distances is {literal.length / taught.length:.4f}."
        )
    return [
        f"Eq. (7), read literally, scales each axis by its own g - x0: in y {new:.3f} mm here, "
        f"{old:.3f} mm when taught. That multiplies the wave by {new / old:.3f} and gives "
        f"{literal.wave.mean:.3f} mm. {verdict}"
    ]

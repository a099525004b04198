"""The pre-flight verdict as a small table."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from dmpcli.control.execution_plan import CheckedPlan
from dmpcli.errors import beside
from dmpcli.planning.plan import Plan
from dmpcli.planning.preflight import Check

_HEAD = ("check", "value", "limit", "unit", "at", "")
_MANY = ("stroke", "mm", "s", "ways, s", "nearest to its limit", "value", "limit", "unit", "at", "")
MOST_ROWS = 20
"""Of more strokes than this the table names those that fail or come nearest to a limit."""


def table(judged: Sequence[CheckedPlan]) -> str:
    """Return the verdict: on one stroke a line per check, on several a line per stroke.

    Parameters
    ----------
    judged : sequence of CheckedPlan
        In the order in which they are drawn.
    """
    if len(judged) > 1:
        return _of_many(judged)
    return _of_one(judged[0].plan, judged[0].checks)


def facts(judged: Sequence[CheckedPlan]) -> dict[str, Any]:
    """Return the verdict as JSON values: each stroke with all its checks."""
    strokes = [
        {
            "id": one.plan.id,
            "length_mm": _length(one.plan),
            "duration_s": (one.plan.last - one.plan.lead) * one.plan.period,
            "checks": [{"passed": check.passed} | asdict(check) for check in one.checks],
        }
        for one in judged
    ]
    return {"strokes": strokes}


def _of_one(plan: Plan, checks: Sequence[Check]) -> str:
    count = plan.last - plan.lead + 1
    about = (
        f"stroke: {_length(plan):.3f} mm in {(count - 1) * plan.period:.3f} s, {count} "
        f"set-points every {plan.period:g} s"
    )
    if plan.lead:
        about += f", after an approach of {plan.lead * plan.period:.3f} s"
    if plan.last < len(plan) - 1:
        about += f", before a retract of {(len(plan) - 1 - plan.last) * plan.period:.3f} s"
    lines = _aligned([_HEAD, *(_row(check) for check in checks)], (1, 2))
    failed = sum(not check.passed for check in checks)
    return "\n".join([about, *lines, "refused" if failed else "may be executed"])


def _of_many(judged: Sequence[CheckedPlan]) -> str:
    """One line per stroke: the check that is nearest to its limit."""
    period = judged[0].plan.period
    lengths = [_length(one.plan) for one in judged]
    drawing = sum(one.plan.last - one.plan.lead for one in judged) * period
    total = sum(len(one.plan) for one in judged) * period
    heads = [
        f"{len(judged)} strokes: {sum(lengths):.3f} mm in {drawing:.3f} s; with the ways between "
        f"them {total:.3f} s"
    ]
    shown = list(range(len(judged)))
    if len(judged) > MOST_ROWS:
        nearest = sorted(shown, key=lambda i: -max(map(_share, judged[i].checks)))
        shown = sorted(nearest[:MOST_ROWS])
        heads.append(f"the {MOST_ROWS} of them that fail or come nearest to a limit:")
    rows = [_MANY, *(_stroke_row(judged[i], lengths[i]) for i in shown)]
    failed = sum(one.failure is not None for one in judged)
    end = f"refused: {failed} of {len(judged)}" if failed else "may be executed"
    return "\n".join([*heads, *_aligned(rows, (1, 2, 3, 5, 6)), end])


def _stroke_row(one: CheckedPlan, length: float) -> tuple[str, ...]:
    plan, worst = one.plan, max(one.checks, key=_share)
    drawing = plan.last - plan.lead
    quantity, value, limit, unit, where, verdict = _row(worst)
    ways = (len(plan) - drawing) * plan.period
    times = f"{length:.3f}", f"{drawing * plan.period:.3f}", f"{ways:.3f}"
    return plan.id, *times, quantity, value, limit, unit, where, verdict


def _share(check: Check) -> float:
    """How much of its limit a quantity takes; infinite where it fails one of zero."""
    if check.limit > 0.0:
        return check.value / check.limit if check.value == check.value else np.inf
    return 0.0 if check.passed else np.inf


def _length(plan: Plan) -> float:
    stroke = plan.position[plan.lead : plan.last + 1]
    return float(np.linalg.norm(np.diff(stroke, axis=0), axis=1).sum())


def _aligned(rows: Sequence[tuple[str, ...]], numbers: tuple[int, ...]) -> list[str]:
    """Lines of a table; the columns of numbers stand to the right."""
    width = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  ".join(
            cell.rjust(w) if i in numbers else cell.ljust(w)
            for i, (cell, w) in enumerate(zip(row, width, strict=True))
        ).rstrip()
        for row in rows
    ]


def _row(check: Check) -> tuple[str, ...]:
    where = check.place if check.t is None else f"{check.t:.3f} s (row {check.row})"
    verdict = "ok" if check.passed else "TOO MUCH"
    return (
        check.quantity,
        beside(check.value, check.limit, ".5g"),
        f"{check.limit:.5g}",
        check.unit,
        where,
        verdict,
    )

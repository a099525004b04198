"""The pre-flight verdict as a small table."""

from collections.abc import Sequence

import numpy as np

from dmpcli.streaming.plan import Plan
from dmpcli.streaming.preflight import Check

_HEAD = ("check", "value", "limit", "unit", "at", "")


def table(plan: Plan, checks: Sequence[Check]) -> str:
    """Return the verdict, one line per check, with what the stroke is above them.

    Parameters
    ----------
    plan : Plan
    checks : sequence of Check
    """
    stroke = plan.position[plan.lead :]
    length = float(np.linalg.norm(np.diff(stroke, axis=0), axis=1).sum())
    about = (
        f"stroke: {length:.3f} mm in {(len(stroke) - 1) * plan.period:.3f} s, {len(stroke)} "
        f"set-points every {plan.period:g} s"
    )
    if plan.lead:
        about += f", after an approach of {plan.lead * plan.period:.3f} s"
    rows = [_HEAD, *(_row(check) for check in checks)]
    width = [max(len(row[i]) for row in rows) for i in range(len(_HEAD))]
    lines = [
        "  ".join(
            cell.rjust(w) if i in (1, 2) else cell.ljust(w)
            for i, (cell, w) in enumerate(zip(row, width, strict=True))
        ).rstrip()
        for row in rows
    ]
    failed = sum(not check.passed for check in checks)
    return "\n".join([about, *lines, "refused" if failed else "may be executed"])


def _row(check: Check) -> tuple[str, ...]:
    where = "" if check.t is None else f"{check.t:.3f} s (row {check.row})"
    verdict = "ok" if check.passed else "TOO MUCH"
    return (
        check.quantity,
        f"{check.value:.5g}",
        f"{check.limit:.5g}",
        check.unit,
        where,
        verdict,
    )

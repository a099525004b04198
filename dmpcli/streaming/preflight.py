"""What can be judged before an arm moves, on arrays alone."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from dmpcli import rotations
from dmpcli.arrays import Floats
from dmpcli.errors import RefusedError
from dmpcli.streaming.limits import Limits
from dmpcli.streaming.plan import Plan, Stroke

# A stroke that begins or ends slower than this share of the acceleration limit times the servo
# period is at rest, 9 mm/s and 0.06 rad/s by default: the arm takes up such a step in velocity
# within one period at a fifth of its acceleration. A hand's tremor is less, a stroke that was cut
# out of a longer motion is more.
REST_SHARE = 0.2


_ENDS = (("start", 1, 0, ("in", "from")), ("end", -1, -1, ("out", "to")))


@dataclass(frozen=True)
class Check:
    """One quantity against its limit.

    Attributes
    ----------
    quantity, unit : str
    value, limit : float
    t : float or None
        Where along the trajectory, s; None where the place says nothing.
    row : int or None
        Row of the file, counted from 1.
    remedy : str
    """

    quantity: str
    value: float
    limit: float
    unit: str
    t: float | None
    row: int | None
    remedy: str

    @property
    def passed(self) -> bool:
        """Whether the limit is kept; a value that is not a number keeps none."""
        return bool(self.value <= self.limit)

    def __str__(self) -> str:
        where = "" if self.t is None else f" at t = {self.t:.3f} s (row {self.row})"
        return (
            f"{self.quantity} {self.value:.5g} {self.unit}{where} is over the limit of "
            f"{self.limit:.5g} {self.unit}; {self.remedy}"
        )


def refuse_any(checks: Iterable[Check]) -> None:
    """Raise for the first check that failed.

    Raises
    ------
    RefusedError
    """
    for check in checks:
        if not check.passed:
            raise RefusedError(str(check))


def at_rest(stroke: Stroke, speed: float, period: float, limits: Limits) -> list[Check]:
    """Check that the stroke begins and ends at rest, by its end samples.

    Parameters
    ----------
    stroke : Stroke
    speed : float
        Factor on the file's own speed.
    period : float
        Servo period, s.
    limits : Limits
    """
    remedy = "generalize it again with --ease-{} S, which brings it {} rest on the same path"
    linear, angular = limits.acceleration, limits.rotation_acceleration
    checks = []
    for name, order, end, words in _ENDS:
        rows = slice(None, None, order)
        t = stroke.t[rows][:3]
        where = (
            float(stroke.t[end] - stroke.t[0]),
            stroke.first_row + (0 if end == 0 else len(stroke.t) - 1),
            remedy.format(*words),
        )
        v = _end_velocity(t, stroke.position[rows][:3]) * speed
        checks.append(
            Check(f"speed at the {name}", v, REST_SHARE * linear * period, "mm/s", *where)
        )
        if stroke.rotation is not None:
            R = stroke.rotation[rows][:3]
            w = _end_velocity(t, rotations.log(R @ R[0].T)) * speed
            checks.append(
                Check(f"rotation at the {name}", w, REST_SHARE * angular * period, "rad/s", *where)
            )
    return checks


def _end_velocity(t: Floats, y: Floats) -> float:
    """Magnitude of dy/dt at the first sample, by the parabola through the first three."""
    h1 = t[1] - t[0]
    first = (y[1] - y[0]) / h1
    if len(t) == 2:
        return float(np.linalg.norm(first))
    h2 = t[2] - t[1]
    second = (y[2] - y[1]) / h2
    return float(np.linalg.norm(first - h1 * (second - first) / (h1 + h2)))


def near_start(distance: float, angle: float, tolerance: float, max_angle: float) -> list[Check]:
    """Check that the arm stands at the stroke's start.

    Parameters
    ----------
    distance, angle : float
        Between the actual pose and the stroke's first, mm and rad.
    tolerance, max_angle : float
        mm and rad.
    """
    remedy = "move the arm there, or let it go straight there with --approach MM_PER_S"
    return [
        Check("distance from the arm to the start", distance, tolerance, "mm", None, None, remedy),
        Check("angle from the arm to the start", angle, max_angle, "rad", None, None, remedy),
    ]


def within_limits(plan: Plan, stroke: Stroke, limits: Limits) -> list[Check]:
    """Peaks of the set-points' derivatives at the servo period, and the workspace.

    Parameters
    ----------
    plan : Plan
    stroke : Stroke
        Names the rows.
    limits : Limits
    """
    names = ("speed", "acceleration", "jerk")
    allowed = (
        (limits.speed, limits.acceleration, limits.jerk),
        (limits.rotation_speed, limits.rotation_acceleration, limits.rotation_jerk),
    )
    checks = []
    for order, derivative in enumerate(plan.derivatives(), start=1):
        size = np.linalg.norm(derivative, axis=-1)
        for kind, (word, unit) in enumerate((("", "mm/s"), ("rotation ", "rad/s"))):
            at = int(np.argmax(size[:, kind])) if len(size) else 0
            value = float(size[at, kind]) if len(size) else 0.0
            limit = allowed[kind][order - 1]
            checks.append(
                Check(
                    f"{word}{names[order - 1]}",
                    value,
                    limit,
                    unit + ("", "²", "³")[order - 1],
                    *_where(plan, stroke, min(at, len(plan) - 1)),
                    _slower(
                        value,
                        limit,
                        order,
                        f"--max-{word.strip() + '-' if word else ''}{names[order - 1]}",
                    ),
                )
            )
    return checks + _inside(plan, stroke, limits)


def _slower(value: float, limit: float, order: int, option: str) -> str:
    # The n-th derivative goes with the n-th power of the speed.
    factor = np.floor(100.0 * (limit / value) ** (1.0 / order)) / 100.0 if value > limit else 1.0
    slower = f"slow it down to {factor:g} times its speed with --speed, or " if factor > 0 else ""
    return f"{slower}raise {option} if the arm may"


def _inside(plan: Plan, stroke: Stroke, limits: Limits) -> list[Check]:
    if limits.workspace is None:
        return []
    low, high = np.array(limits.workspace[::2]), np.array(limits.workspace[1::2])
    outside = np.maximum(np.maximum(low - plan.position, plan.position - high), 0.0)
    at = np.argmax(outside, axis=0)
    return [
        Check(
            f"distance outside the workspace in {axis}",
            float(outside[at[i], i]),
            0.0,
            "mm",
            *_where(plan, stroke, int(at[i])),
            f"move the stroke, or widen --workspace ({axis} {low[i]:g} to {high[i]:g} mm)",
        )
        for i, axis in enumerate("xyz")
    ]


def _where(plan: Plan, stroke: Stroke, index: int) -> tuple[float, int]:
    t = float(plan.t[index])
    nearest = int(np.searchsorted(stroke.t - stroke.t[0], t - 1e-9))
    return t, stroke.first_row + min(nearest, len(stroke.t) - 1)

"""What can be judged before an arm moves, on arrays alone."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import beside
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import Plan
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import StrokeTrajectory

if TYPE_CHECKING:  # loaded where an arm's joints are judged
    from dmpcli.kinematics.path import Followed, Peak
    from dmpcli.kinematics.reachability import Reach

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
    place : str
        Where, if not on the stroke.
    """

    quantity: str
    value: float
    limit: float
    unit: str
    t: float | None
    row: int | None
    remedy: str
    place: str = ""

    @property
    def passed(self) -> bool:
        """Whether the limit is kept; a value that is not a number keeps none."""
        return bool(self.value <= self.limit)

    def __str__(self) -> str:
        where = self.place if self.t is None else f"at t = {self.t:.3f} s (row {self.row})"
        where = f" {where}" if where else ""
        value = beside(self.value, self.limit, ".5g")
        return (
            f"{self.quantity} {value} {self.unit}{where} is over the limit of "
            f"{self.limit:.5g} {self.unit}; {self.remedy}"
        )


def at_rest(stroke: StrokeTrajectory, speed: float, period: float, limits: Limits) -> list[Check]:
    """Check that the stroke begins and ends at rest, by its end samples.

    Parameters
    ----------
    stroke : StrokeTrajectory
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


def within_limits(plan: Plan, stroke: StrokeTrajectory, limits: Limits) -> list[Check]:
    """Peaks of the set-points' derivatives at the servo period, and the workspace.

    The peaks are those of the stroke, unless one on the ways to it and off it is over a limit: ways
    are as fast as they may be, and would hide how near to its limits the stroke comes.

    Parameters
    ----------
    plan : Plan
    stroke : StrokeTrajectory
        Names the rows.
    limits : Limits
    """
    names = ("speed", "acceleration", "jerk")
    allowed = (
        (limits.speed, limits.acceleration, limits.jerk),
        (limits.rotation_speed, limits.rotation_acceleration, limits.rotation_jerk),
    )
    checks = []
    for order, size in enumerate(plan.sizes, start=1):
        for kind, (word, unit) in enumerate((("", "mm/s"), ("rotation ", "rad/s"))):
            limit = allowed[kind][order - 1]
            at = _peak(size[:, kind], plan.lead, plan.last + order - 1, limit)
            value = float(size[at, kind]) if len(size) else 0.0
            t, row, place = _where(plan, stroke, min(at, len(plan) - 1))
            checks.append(
                Check(
                    f"{word}{names[order - 1]}",
                    value,
                    limit,
                    unit + ("", "²", "³")[order - 1],
                    t,
                    row,
                    _slower(
                        value,
                        limit,
                        order,
                        f"--max-{word.strip() + '-' if word else ''}{names[order - 1]}",
                    ),
                    place,
                )
            )
    return checks + _inside(plan, stroke, limits)


def by_joints(
    plan: Plan, stroke: StrokeTrajectory, reach: "Reach", start: Floats | None
) -> tuple[list[Check], Floats | None]:
    """Reach, joint angles and joint speeds of a plan; an arm that misses a pose has no others.

    Parameters
    ----------
    plan : Plan
    stroke : StrokeTrajectory
        Names the rows.
    reach : Reach
    start : array, shape (6,), or None
        Joint angles before, rad; None for the best.

    Returns
    -------
    list of Check
    array, shape (6,), or None
        Joint angles after; None where the arm does not get there.
    """
    followed = reach.follow(plan.position[None], plan.rotation[None], plan.period, start)
    after = followed.joints[0, -1] if followed.missing.passed[0] else None
    return _by_joints(plan, stroke, followed), after


def _by_joints(plan: Plan, stroke: StrokeTrajectory, followed: "Followed") -> list[Check]:
    def check(quantity: str, unit: str, peak: "Peak", remedy: str) -> Check:
        value, limit = float(peak.value[0]), float(peak.limit[0])
        if unit != "mm":
            value, limit = float(np.degrees(value)), float(np.degrees(limit))
        t, row, place = _where(plan, stroke, int(peak.sample[0]))
        return Check(quantity, value, limit, unit, t, row, remedy, place)

    away = "move the stroke nearer to the arm's base or further from its axis, or check --tool"
    reach = check("distance out of the arm's reach", "mm", followed.missing, away)
    if not reach.passed:
        return [reach]
    angle, speed = followed.angle, followed.speed
    from dmpcli.kinematics.reachability import singular

    near = "".join(f"it is {clause}; " for clause in singular(followed.nearness[0]))
    if followed.jumps[0]:
        slower = "no --speed helps, for it jumps: "
    else:
        slower = _slow_down(speed.limit[0] / max(speed.value[0], speed.limit[0]))
    return [
        reach,
        check(
            f"joint {angle.joint[0] + 1} from the middle of its range",
            "°",
            angle,
            "turn or move the stroke, or start the arm in another configuration",
        ),
        check(
            f"speed of joint {speed.joint[0] + 1}",
            "°/s",
            speed,
            f"{near}{slower}move or turn the stroke",
        ),
    ]


def _peak(size: Floats, first: int, end: int, limit: float) -> int:
    """Number of the largest value of a stroke, or of all where that is over the limit."""
    if not size.max(initial=0.0) <= limit:
        return int(np.argmax(size))
    return first + int(np.argmax(size[first:end])) if end > first else 0


def _slower(value: float, limit: float, order: int, option: str) -> str:
    # The n-th derivative goes with the n-th power of the speed.
    share = (limit / value) ** (1.0 / order) if value > limit else 1.0
    return f"{_slow_down(share)}raise {option} if the arm may"


def _slow_down(share: float) -> str:
    factor = np.floor(100.0 * share) / 100.0
    return f"slow it down to {factor:g} times its speed with --speed, or " if factor > 0 else ""


def _inside(plan: Plan, stroke: StrokeTrajectory, limits: Limits) -> list[Check]:
    if limits.workspace is None:
        return []
    low, high = np.array(limits.workspace[::2]), np.array(limits.workspace[1::2])
    outside = np.maximum(np.maximum(low - plan.position, plan.position - high), 0.0)
    checks = []
    for i, axis in enumerate("xyz"):
        at = int(np.argmax(outside[:, i]))
        t, row, place = _where(plan, stroke, at)
        other = ", lower --clearance" if plan.phase_at(at) in ("transfer", "retract") else ""
        remedy = (
            f"move the stroke{other}, or widen --workspace ({axis} {low[i]:g} to {high[i]:g} mm)"
        )
        quantity = f"distance outside the workspace in {axis}"
        value = float(outside[at, i])
        checks.append(Check(quantity, value, 0.0, "mm", t, row, remedy, place))
    return checks


def _where(
    plan: Plan, stroke: StrokeTrajectory, index: int
) -> tuple[float | None, int | None, str]:
    """Return time and row on the stroke, or the way that leads to it or off it."""
    if not plan.draws_at(index):
        return None, None, f"in the {plan.phase_at(index)}"
    t = float(plan.t[index])
    nearest = int(np.searchsorted(stroke.t - stroke.t[0], t - 1e-9))
    return t, stroke.first_row + min(nearest, len(stroke.t) - 1), ""

"""A plan whose goal moves: each goal's whole course is made and judged before the arm is on it.

What a moved goal adds is exact and known in advance (`dmpcli.dmp.goal_step`). So a goal is taken by
making the plan anew from a set-point ahead to its end, and by the checks that a plan passes before
an arm moves: whatever happens afterwards, what is left of the plan in force has been judged.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.goal_step import GoalFilter, response, settling
from dmpcli.errors import beside
from dmpcli.kinematics.path import Peak
from dmpcli.kinematics.reachability import Reach
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import Plan

SETTLED = 0.01
"""How near to the goal the last set-point but one lies, mm."""

LONGEST_AFTER = 60.0
"""For so long a moved goal may draw a stroke out, s."""

SLICE = 250
"""Set-points whose joints are judged in one cycle: 4 ms of one core."""

_ALLOWED = ("speed", "acceleration", "jerk")
_UNITS = ("", "²", "³")
_ROUNDING = 1e-9
_SAME = 1e-3  # rad


@dataclass(frozen=True)
class GoalCourse:
    """A plan with what its moved goal adds to it.

    Attributes
    ----------
    plan : Plan
        As the arm draws it.
    shift : array, shape (3,)
        By which the goal has moved from the first plan's, mm.
    states : array, shape (n, 2, 3)
        Of the filter at each set-point: what is added, mm, and V.
    joints : array, shape (n, 6), or None
        rad, where an arm is judged.
    start : int
        The last set-point that it shares with the course before.
    """

    plan: Plan
    shift: Floats
    states: Floats
    joints: Floats | None = None
    start: int = 0

    @property
    def goal(self) -> Floats:
        """Where the stroke ends, shape (3,), mm."""
        there: Floats = self.plan.position[self.plan.last]
        return there


def first(plan: Plan, joints: Floats | None = None) -> GoalCourse:
    """Return the course of a plan whose goal has not moved."""
    return GoalCourse(plan, np.zeros(3), np.zeros((len(plan), 2, 3)), joints)


def slices(now: GoalCourse, index: float, filter_: GoalFilter) -> int:
    """Cycles that judging the joints of a new course may take, from this set-point on.

    Parameters
    ----------
    now : GoalCourse
        In force.
    index : float
        The set-point at which the arm is, counted in periods of the plan.
    filter_ : GoalFilter
        Its slower mode tells how far a moved goal may draw the plan out.

    Returns
    -------
    int
        At least 1; of `SLICE` set-points each.
    """
    more = np.log(1e3 / SETTLED) * 2.0 * filter_.slowest / filter_.period
    return 1 + int((len(now.plan) - index + more) // SLICE)


def moved(
    base: Plan, now: GoalCourse, filter_: GoalFilter, shift: Floats, start: int
) -> GoalCourse | None:
    """Make the course to a goal, not yet judged.

    Parameters
    ----------
    base : Plan
        To the goal as it was planned.
    now : GoalCourse
        In force.
    filter_ : GoalFilter
    shift : array, shape (3,)
        By which the goal has moved from the base plan's, mm.
    start : int
        The goal drives the stroke from this set-point on: it is the last one that stays.

    Returns
    -------
    GoalCourse or None
        None where the stroke would be drawn out for too long.
    """
    last, state = base.last, now.states[start]
    left = max(settling(filter_, state, shift, SETTLED), 1)
    if start + left - last > LONGEST_AFTER / base.period:
        return None
    end = max(start + left, last)
    states = np.concatenate([now.states[: start + 1], response(filter_, state, shift, end - start)])
    # On the last set-point exactly: what is left out is less than `SETTLED`.
    states[end] = shift, np.zeros(3)
    after = len(base) - 1 - last
    states = np.concatenate([states, np.repeat(states[-1:], after, axis=0)])
    plan = _drawn_out(base, end - last)
    position = plan.position + states[:, 0]
    position[: start + 1] = now.plan.position[: start + 1]
    return GoalCourse(replace(plan, position=position), shift, states, None, start)


def _drawn_out(base: Plan, more: int) -> Plan:
    """Return a plan that waits for so many set-points at its stroke's end."""
    last = base.last

    def held(values: Floats) -> Floats:
        waits = np.repeat(values[last : last + 1], more, axis=0)
        return np.concatenate([values[: last + 1], waits, values[last + 1 :]])

    return replace(
        base,
        t=held(base.t),
        position=held(base.position),
        rotation=held(base.rotation),
        normal=None if base.normal is None else held(base.normal),
        force=None if base.force is None else held(base.force),
        last=last + more,
        legs=tuple((phase, at + more if at > last else at) for phase, at in base.legs),
        events=tuple(
            (at + more if at > last - _ROUNDING else at, event) for at, event in base.events
        ),
    )


def judged(
    course: GoalCourse, before: GoalCourse, limits: Limits, reach: Reach | None
) -> Iterator[str | GoalCourse]:
    """Judge what is new of a course, a slice of its joints at a time.

    Parameters
    ----------
    course : GoalCourse
        Of `moved`.
    before : GoalCourse
        The one in force when it was made.
    limits : Limits
    reach : Reach or None
        The arm whose joints are judged too.

    Yields
    ------
    str or GoalCourse
        Empty while there is more to judge; why it must not be drawn; or last, the course with its
        joints.
    """
    why = _by_limits(course.plan, course.start, limits)
    if why:
        yield why
        return
    if reach is None or before.joints is None:
        yield course
        return
    plan, begun = course.plan, course.start
    joints = [before.joints[: begun + 1]]
    for at in range(begun, len(plan) - 1, SLICE):
        if at > begun:
            yield ""
        rows = slice(at, min(at + SLICE, len(plan) - 1) + 1)
        standing = joints[-1][-1]
        followed = reach.follow(
            plan.position[None, rows], plan.rotation[None, rows], plan.period, standing
        )
        for name, unit, peak in (
            ("out of the arm's reach", "mm", followed.missing),
            ("from the middle of a joint's range", "°", followed.angle),
            ("by a joint", "°/s", followed.speed),
        ):
            if not peak.passed[0]:
                yield _missed(name, unit, peak)
                return
        found = followed.joints[0]
        # Where it stands the arm has these joints, and no others of the same pose.
        if not np.abs(found[0] - standing).max() < _SAME:
            yield "another configuration of the arm's joints"
            return
        joints.append(found[1:])
    yield replace(course, joints=np.concatenate(joints))


def _by_limits(plan: Plan, start: int, limits: Limits) -> str:
    """Say which limit of the tool's the plan breaks from a set-point on; empty where none."""
    position = plan.position[max(start - 2, 0) :]
    # Before the first set-point the arm stands there.
    position = np.concatenate([np.repeat(position[:1], max(2 - start, 0), axis=0), position])
    allowed = (limits.speed, limits.acceleration, limits.jerk)
    differences = np.diff(position, axis=0) / plan.period
    # The last set-point is held, as in `Plan.derivatives`.
    for order, (name, most) in enumerate(zip(_ALLOWED, allowed, strict=True)):
        if order:
            differences = np.diff(np.pad(differences, ((0, 1), (0, 0))), axis=0) / plan.period
        size = float(np.sqrt(np.vecdot(differences, differences).max(initial=0.0)))
        if not size <= most * (1.0 + _ROUNDING):
            unit = f"mm/s{_UNITS[order]}"
            return f"{name} {beside(size, most, '.4g')} {unit}, over {most:g} {unit}"
    if limits.workspace is not None:
        low, high = np.array(limits.workspace[::2]), np.array(limits.workspace[1::2])
        outside = np.maximum(low - position, position - high).max(initial=0.0)
        if outside > 0.0:
            return f"{outside:.3g} mm outside the workspace"
    return ""


def _missed(name: str, unit: str, peak: Peak) -> str:
    value, limit = float(peak.value[0]), float(peak.limit[0])
    if unit == "mm":
        return f"{value:.3g} mm {name}"
    value, limit = float(np.degrees(value)), float(np.degrees(limit))
    said = beside(value, limit, ".4g")
    return (
        f"{said} {unit} {name} {int(peak.joint[0]) + 1}, over {beside(limit, value, '.4g')} {unit}"
    )

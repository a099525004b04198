"""The goal of a stroke while it is drawn: which goals are taken, and what the plan becomes.

A goal is taken where the whole course to it keeps every limit that the plan was checked against;
one that would break any is refused and told, and the arm goes on to the last one that was taken.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.goal_step import GoalFilter
from dmpcli.errors import InputError, RefusedError, beside
from dmpcli.instruments.goal_sources import BACK, GoalNews, GoalSource
from dmpcli.kinematics.reachability import Reach
from dmpcli.planning import goal_course
from dmpcli.planning.goal_course import GoalCourse
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import Plan
from dmpcli.spatial.trajectory import StrokeTrajectory

LONGEST = 30_000
"""Set-points of a stroke whose goal may move: a plan is made anew within a cycle."""

OFF_PLANE = 0.5
"""So far off the stroke's plane a goal is taken for one on it, mm; it is carried there."""

# Normals that differ by less are those of one plane.
_FLAT = 1e-4
# A goal that has moved by less has not, mm.
_SAME = 1e-6
_WHAT = "--goal-from"


@dataclass(frozen=True)
class GoalEvent:
    """What became of a goal, or of its sender.

    Attributes
    ----------
    t : float
        s since the first set-point.
    kind, detail : str
        ``taken``, or why not.
    goal : tuple of float or None
        mm.
    """

    t: float
    kind: str
    detail: str = ""
    goal: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class GoalOptions:
    """What a goal that moves is held against.

    Attributes
    ----------
    limits : Limits
    reach : Reach or None
        The arm whose joints are judged too.
    range : float
        How far from the planned goal it may move, mm.
    tell : callable
        Told what a person should know now, each kind once.
    """

    limits: Limits
    reach: Reach | None = None
    range: float = 200.0
    tell: Callable[[str], None] = lambda _: None


class GoalFollower:
    """Follows the goal of one stroke.

    Parameters
    ----------
    source : GoalSource
    plan : Plan
        Checked; of one stroke.
    filter_ : GoalFilter
    normal : array, shape (3,)
        Unit normal of the stroke's plane.
    options : GoalOptions

    Attributes
    ----------
    course : GoalCourse
        In force.
    taken : list of GoalEvent
    told : list of GoalEvent
        Everything else that happened, each kind once.
    """

    def __init__(
        self,
        source: GoalSource,
        plan: Plan,
        filter_: GoalFilter,
        normal: Floats,
        options: GoalOptions,
    ) -> None:
        if len(plan) > LONGEST:
            raise InputError(
                f"{_WHAT}: the stroke has {len(plan)} set-points, and the goal of one with more "
                f"than {LONGEST} cannot move; draw it faster, or with a longer --period"
            )
        self._source, self._base, self._filter = source, plan, filter_
        self._normal, self._options = normal, options
        joints = None
        if options.reach is not None:
            # As the checks before the motion have followed them.
            followed = options.reach.follow(plan.position[None], plan.rotation[None], plan.period)
            joints = followed.joints[0]
        self.course = goal_course.first(plan, joints)
        self.taken: list[GoalEvent] = []
        self.told: list[GoalEvent] = []
        self._refused: Counter[str] = Counter()
        self._wanted: Floats | None = None
        self._proposed = plan.position[plan.last]
        self._judged: Iterator[str | GoalCourse] | None = None

    def begin(self, joints: Floats | None) -> None:
        """Say what the joints are before the first set-point, shape (6,), rad."""
        plan, reach = self._base, self._options.reach
        if reach is not None and joints is not None and len(joints) == 6:
            followed = reach.follow(plan.position[None], plan.rotation[None], plan.period, joints)
            self.course = goal_course.first(plan, followed.joints[0])

    @property
    def goal(self) -> Floats:
        """The goal that is followed, shape (3,), mm."""
        return self.course.goal

    def step(self, now: float, index: float) -> Plan | None:
        """Take in what is new before a set-point is sent.

        Parameters
        ----------
        now : float
            s since the first set-point of the run.
        index : float
            Number of the set-point that is sent next.

        Returns
        -------
        Plan or None
            The plan from now on, the same up to this set-point; None where it stays as it is.
        """
        plan = self.course.plan
        elapsed = (index - plan.lead) * plan.period
        for news in self._source.take(now, elapsed):
            self._hear(now, news)
        if self._judged is None and self._wanted is not None:
            self._propose(now, index)
        if self._judged is None:
            return None
        found = next(self._judged)
        if found == "":
            return None
        self._judged = None
        if isinstance(found, str):
            self._refuse(now, self._proposed, "over a limit", found)
            return None
        if index > found.start:
            # Set-points were owed meanwhile; it is proposed anew, unless a newer one has come.
            self._wanted = self._proposed if self._wanted is None else self._wanted
            return None
        self.course = found
        self.taken.append(GoalEvent(now, "taken", "", _three(found.goal)))
        return found.plan

    def _hear(self, now: float, news: GoalNews) -> None:
        if news.position is None:
            self._note(now, news.kind, news.detail, status=news.status)
        else:
            self._wanted = news.position

    def _propose(self, now: float, index: float) -> None:
        """Begin to judge the newest goal, unless there is nothing to judge."""
        course, options = self.course, self._options
        wanted, self._wanted = self._wanted, None
        assert wanted is not None
        way = wanted - self._base.position[self._base.last]
        off = float(way @ self._normal)
        shift = way - off * self._normal
        if abs(off) > OFF_PLANE:
            self._refuse(now, wanted, "off the plane", f"{off:+.2f} mm along its normal")
            return
        if np.abs(shift - course.shift).max() <= _SAME:
            return
        distance = float(np.linalg.norm(shift))
        if distance > options.range:
            self._refuse(
                now,
                wanted,
                "too far",
                f"{beside(distance, options.range, '.1f')} mm from the planned goal, over "
                f"{options.range:g} (goal_range)",
            )
            return
        wait = 0
        if options.reach is not None:
            wait = goal_course.slices(course, index, self._filter)
        start = max(int(index) + wait, course.plan.lead)
        if start >= course.plan.last:
            self._refuse(now, wanted, "too late", "the stroke is at its end")
            return
        made = goal_course.moved(self._base, course, self._filter, shift, start)
        if made is None:
            after = f"over {goal_course.LONGEST_AFTER:g} s after the planned end"
            self._refuse(now, wanted, "too late", after)
            return
        self._proposed = wanted
        self._judged = goal_course.judged(made, course, options.limits, options.reach)

    def _refuse(self, now: float, goal: Floats, kind: str, detail: str) -> None:
        self._note(now, kind, detail, _three(goal))

    def _note(
        self,
        now: float,
        kind: str,
        detail: str,
        goal: tuple[float, float, float] | None = None,
        status: bool = False,
    ) -> None:
        if not status:
            self._refused[kind] += 1
        if any(one.kind == kind for one in self.told):
            return
        self.told.append(GoalEvent(now, kind, detail, goal))
        at = "" if goal is None else " ({:.1f}, {:.1f}, {:.1f})".format(*goal)
        more = f": {detail}" if detail else ""
        after = "" if kind == BACK else "; the arm goes on to the last goal that was taken"
        self._options.tell(f"goal{at} from {self._source.name} at {now:.2f} s: {kind}{more}{after}")

    def facts(self) -> dict[str, Any]:
        """Return what a run file says of its goals."""
        return {
            "goals": {
                "planned": list(_three(self._base.position[self._base.last])),
                "last": list(_three(self.goal)),
                "taken": [
                    {"t": round(one.t, 6), "goal": list(one.goal or ())} for one in self.taken
                ],
                "not_taken": dict(self._refused),
                "told": [
                    {"t": round(one.t, 6), "what": one.kind, "detail": one.detail}
                    for one in self.told
                ],
            }
        }

    def said(self) -> str:
        """Say in one line what became of the goals."""
        parts = [f"{count} × {kind}" for kind, count in self._refused.items()]
        more = f" ({', '.join(parts)})" if parts else ""
        count = len(self.taken)
        if not count:
            return f"no goal was taken from {self._source.name}{more}: drawn as planned"
        at = "({:.2f}, {:.2f}, {:.2f}) mm".format(*_three(self.goal))
        return f"{count} goals taken from {self._source.name}{more}; the last one is {at}"


def _three(point: Floats) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return x, y, z


def plane_of(stroke: StrokeTrajectory) -> Floats:
    """Return the unit normal of a stroke's plane, shape (3,).

    Raises
    ------
    InputError
        The file says of no plane.
    RefusedError
        It lies on a surface that is none.
    """
    if stroke.facts.get("model") == "original":
        raise InputError(
            f"{_WHAT}: the original model scales the stroke by its goal, which then cannot move; "
            "fit a modified one"
        )
    if stroke.normal is None:
        known = stroke.facts.get("normal")
        if known is None:
            raise InputError(
                f"{_WHAT}: stroke {stroke.id} does not say which plane it lies on; make it anew "
                "with generalize"
            )
        normal = np.asarray(known, dtype=float)
        made: Floats = normal / np.linalg.norm(normal)
        return made
    normals = stroke.normal
    if np.abs(normals - normals[0]).max() > _FLAT:
        raise RefusedError(
            f"{_WHAT}: stroke {stroke.id} lies on a curved surface; a goal moves on planes only"
        )
    one: Floats = normals[0]
    return one


def filter_of(facts: Mapping[str, Any], speed: float, period: float) -> GoalFilter:
    """Return the transformation system of a stroke, by what its file states.

    Parameters
    ----------
    facts : mapping
        Of the trajectory.
    speed : float
        At which it is drawn; tau is scaled by 1/speed.
    period : float
        s.

    Raises
    ------
    InputError
        It does not state k, d and tau; they differ between axes; or a goal would be reached too
        late by them.
    """
    try:
        k, d, tau = facts["k"][:3], facts["d"][:3], float(facts["tau"])
        same = len(set(k)) == 1 and len(set(d)) == 1
        made = GoalFilter(float(k[0]), float(d[0]), tau / speed, period)
    except (KeyError, TypeError, ValueError, IndexError):
        raise InputError(
            f"{_WHAT}: the trajectory does not state k, d and tau, by which a moved goal is "
            "followed; make it anew with generalize"
        ) from None
    if not same or not (made.k > 0.0 and made.d > 0.0 and made.tau > 0.0):
        raise InputError(f"{_WHAT}: k and d must be positive, and the same of x, y and z")
    if made.slowest > goal_course.LONGEST_AFTER / 10.0:
        raise InputError(
            f"{_WHAT}: by its k, d and tau the stroke follows its goal within {made.slowest:.3g} s "
            "only; fit it with a larger --damping, or draw it faster"
        )
    return made

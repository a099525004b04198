"""Many strokes in one run: leave the work, cross over it through the air, come down on the next.

Every way is made of straight pieces from rest to rest. Off a stroke's end and onto a stroke's start
the tool moves along the surface normal there, with the stroke's orientation. Between these two it
rises to a height that is common to the whole tour, crosses at that height, turning by the shortest
rotation, and sinks. Height is measured along one direction that leads away from the work at the
ends of every stroke: base z where it does, else the mean of the normals.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError, RefusedError
from dmpcli.planning import plan as planning
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import Phase, Plan, PlanSegment
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.trajectory import StrokeTrajectory

LONGEST_TOUR = 2_000_000
"""Set-points of a tour, about 0.3 GB; more must be drawn in several runs."""

LEAN = 0.5
"""Cosine of the largest angle between a normal and the direction of height: 60 degrees."""


@dataclass(frozen=True)
class TransferOptions:
    """How the tool moves between strokes.

    Attributes
    ----------
    clearance : float
        Distance from the work in the air, mm.
    transfer, retract, landing : float
        Peak speeds through the air, off the work and onto it, mm/s.
    settling : int
        Set-points held where a way ends, so that the arm has arrived behind its look-ahead.
    spare : float
        Distance that a force coupling may add to a retract, mm.
    """

    clearance: float
    transfer: float
    retract: float
    landing: float
    settling: int = 0
    spare: float = 0.0


@dataclass(frozen=True)
class Height:
    """The height at which the tool crosses over the work.

    Attributes
    ----------
    up : array, shape (3,)
        Unit vector.
    level : float
        mm along it.
    """

    up: Floats
    level: float

    def over(self, position: Floats, level: float | None = None) -> Floats:
        """Return the point at this height, or at another, over a point, shape (3,), mm."""
        level = self.level if level is None else level
        above: Floats = position + (level - position @ self.up) * self.up
        return above


def off(stroke: StrokeTrajectory, held: Floats, end: int) -> Floats:
    """Unit vector off the work at one end of a stroke.

    The surface's normal; where the stroke states none, back along the tool.

    Parameters
    ----------
    stroke : StrokeTrajectory
    held : array, shape (3, 3)
        Orientation where the stroke states none.
    end : int
        0 or -1.
    """
    if stroke.normal is not None:
        return np.asarray(stroke.normal[end])
    R = held if stroke.rotation is None else stroke.rotation[end]
    return np.asarray(-R[:, 2])


def height(
    strokes: Sequence[StrokeTrajectory],
    held: Floats,
    clearance: float,
    ends: tuple[int, ...] = (0, -1),
) -> Height:
    """Find a height at which the tool may go from any stroke to any other.

    Parameters
    ----------
    strokes : sequence of StrokeTrajectory
        All points of all of them lie below it, by the clearance at least.
    held : array, shape (3, 3)
        Orientation where a stroke states none.
    clearance : float
        mm.
    ends : tuple of int
        Ends of a stroke that a way leads to or off: 0, -1.

    Raises
    ------
    RefusedError
        There is none: the strokes lie on faces that look different ways.
    """
    ways = np.array([off(stroke, held, end) for stroke in strokes for end in ends])
    up = np.array([0.0, 0.0, 1.0])
    if (ways @ up).min() < LEAN:
        mean = ways.sum(axis=0)
        length = float(np.linalg.norm(mean))
        up = mean / length if length > 0.0 else up
    leaning = ways @ up
    if leaning.min() < LEAN:
        worst = strokes[int(np.argmin(leaning)) // len(ends)].id
        raise RefusedError(
            f"stroke {worst}: faces another side of the work than the others, and no one way "
            "through the air leads to all; draw each side in a run of its own with --id"
        )
    top = max(float((stroke.position @ up).max()) for stroke in strokes)
    return Height(up, top + clearance)


def plans(
    strokes: Sequence[StrokeTrajectory],
    period: float,
    speed: float,
    limits: Limits,
    start: Pose,
    near: bool,
    ways: TransferOptions,
    approach: float | None = None,
    leave: bool = True,
) -> Iterator[Plan]:
    """Plan the strokes one after another, each with the way to it and off it.

    Each plan begins where the one before it ends, at rest in the air; the first one where the arm
    stands.

    Parameters
    ----------
    strokes : sequence of StrokeTrajectory
        In the order in which they are drawn.
    period : float
        Servo period, s.
    speed : float
        1 as planned, 0.5 at half the speed. Below 1 it slows the ways down too; above 1 it does
        not quicken them.
    limits : Limits
        All ways stay inside them.
    start : Pose
        The actual one.
    near : bool
        Whether the arm stands at the first stroke's start and is led straight to it; otherwise it
        rises from where it stands, along the direction of height.
    ways : TransferOptions
    approach : float, optional
        Peak speed of the way to the first stroke, if it is less than that of the others, mm/s.
    leave : bool
        Whether the tool leaves the work after each stroke; a single one may end where it ends.

    Raises
    ------
    InputError
        There would be more than `LONGEST_TOUR` set-points.
    RefusedError
        No height is free of the work.
    """
    over = height(strokes, start.rotation, ways.clearance, (0, -1) if leave else (0,))
    travel = _Travel(over, period, limits, ways, min(speed, 1.0))
    first = replace(travel, ways=_slowed(ways, approach))
    here, count = start, 0
    for number, stroke in enumerate(strokes):
        sampled = planning.sample(stroke, period, speed, start.rotation)
        if number > 0:
            before = travel.to(here, sampled)
        else:
            before = first.led(here, sampled) if near else first.to(here, sampled)
        after = travel.off(sampled) if leave else []
        made = planning.joined(sampled, before, after, period, stroke.rotation is not None)
        count += len(made)
        if count > LONGEST_TOUR:
            raise InputError(
                f"the strokes up to {stroke.id} take over {LONGEST_TOUR} set-points of {period:g} "
                "s; draw them in several runs, each with some --id"
            )
        yield made
        here = Pose(made.position[-1], made.rotation[-1])


def _slowed(ways: TransferOptions, approach: float | None) -> TransferOptions:
    if approach is None:
        return ways
    return replace(ways, transfer=min(ways.transfer, approach), landing=min(ways.landing, approach))


@dataclass(frozen=True)
class _Travel:
    """The ways of one tour."""

    height: Height
    period: float
    limits: Limits
    ways: TransferOptions
    slow: float

    def led(self, here: Pose, stroke: StrokeTrajectory) -> list[PlanSegment]:
        """Straight to a start that the arm stands at, but for a small gap."""
        return [self._leg("approach", here, stroke.pose(0), self.ways.landing)]

    def to(self, here: Pose, stroke: StrokeTrajectory) -> list[PlanSegment]:
        """Rise, cross, sink, land."""
        goal, speed, over = stroke.pose(0), self.ways.transfer, self.height
        hover = self._hover(stroke, goal, 0)
        # An arm that stands higher crosses where it is.
        level = max(over.level, float(here.position @ over.up))
        risen = replace(here, position=over.over(here.position, level))
        above = replace(hover, position=over.over(hover.position, level))
        return [
            self._leg("transfer", here, risen, speed),
            self._leg("transfer", risen, above, speed),
            self._leg("transfer", above, hover, speed),
            self._leg("approach", hover, goal, self.ways.landing),
        ]

    def off(self, stroke: StrokeTrajectory) -> list[PlanSegment]:
        """Wait for the arm at the stroke's end, then leave the work along the normal."""
        end = stroke.pose(-1)
        hover = self._hover(stroke, end, -1)
        way = self._leg("retract", end, hover, self.ways.retract, self.ways.spare)
        return [_held("retract", end, self.ways.settling), way, _held("retract", hover, 1)]

    def _hover(self, stroke: StrokeTrajectory, at: Pose, end: int) -> Pose:
        """Off the work at one end of a stroke."""
        return Pose(at.position + self.ways.clearance * off(stroke, at.rotation, end), at.rotation)

    def _leg(
        self, phase: Phase, here: Pose, goal: Pose, speed: float, spare: float = 0.0
    ) -> PlanSegment:
        way = planning.straight(
            phase, here, goal, self.period, self.limits, self.slow * speed, spare
        )
        if not len(way.position):
            return way
        held = _held(phase, goal, self.ways.settling)
        return PlanSegment(
            phase,
            np.concatenate([way.position, held.position]),
            np.concatenate([way.rotation, held.rotation]),
        )


def _held(phase: Phase, pose: Pose, count: int) -> PlanSegment:
    return PlanSegment(
        phase,
        np.repeat(pose.position[None], count, axis=0),
        np.repeat(pose.rotation[None], count, axis=0),
    )

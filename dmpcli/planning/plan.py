"""From a trajectory's samples to one set-point per servo period, with the ways to it and off it."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.planning.limits import Limits
from dmpcli.planning.spline import between, spline, window
from dmpcli.spatial import rotations
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.trajectory import StrokeTrajectory

Phase = Literal["approach", "stroke", "retract", "transfer", "stop"]

# Below these the arm stands at the start: a thousandth of a millimetre, and of a degree or so.
_AT_START = 1e-3
_AT_START_ANGLE = 2e-5
# More set-points than this are a mistake: more than an hour at a period of 20 ms.
LONGEST = 200_000
_WAYS = {
    "approach": ("the way to its start", "raise --approach or lead_speed"),
    "retract": ("a retract", "raise --retract-speed"),
    "transfer": ("a transfer", "raise --transfer-speed or --approach"),
    "stroke": ("the stroke", "raise --speed, or shorten the trajectory"),
}
"""What takes too many set-points, and what helps."""


@dataclass(frozen=True)
class PlanSegment:
    """Set-points of one way to or from a stroke.

    Attributes
    ----------
    phase : {'approach', 'retract', 'transfer'}
    position : array, shape (n, 3)
        mm.
    rotation : array, shape (n, 3, 3)
    """

    phase: Phase
    position: Floats
    rotation: Floats


@dataclass(frozen=True)
class Plan:
    """Set-points at the servo period: the way to the stroke, the stroke, and the way off.

    Attributes
    ----------
    period : float
        s.
    t : array, shape (n,)
        Time along the trajectory file, s; it stands still on the ways to and from the stroke.
    position : array, shape (n, 3)
        mm.
    rotation : array, shape (n, 3, 3)
    normal : array, shape (n, 3), or None
    lead, last : int
        Numbers of the stroke's first and last set-points.
    oriented : bool
        Whether the orientation is the file's own.
    id : str
        The stroke's.
    legs : tuple of (str, int)
        Phases in order, each with the number of its first set-point.
    events : tuple of (float, OutputEvent)
        What is switched, by the number of the set-point or between two.
    force : array, shape (n,), or None
        Set-point of the force along the normal, N; 0 where the tool is lifted.
    """

    period: float
    t: Floats
    position: Floats
    rotation: Floats
    normal: Floats | None
    lead: int
    last: int
    oriented: bool
    id: str
    legs: tuple[tuple[Phase, int], ...]
    events: tuple[tuple[float, OutputEvent], ...] = ()
    force: Floats | None = None

    def __len__(self) -> int:
        return len(self.t)

    def at(self, index: float) -> Pose:
        """Pose at a set-point's number, or between two: then on a C² curve.

        The curve is made anew around the number, in a time that does not depend on the plan's
        length: the loop asks for it when it has to come to rest.
        """
        i = round(index)
        if abs(index - i) < 1e-9:
            i = min(i, len(self) - 1)
            return Pose(self.position[i], self.rotation[i])
        near, share = window(index, len(self))
        return Pose(*_unflat(between(_flat(self.position[near], self.rotation[near]), share)))

    def time_at(self, index: float) -> float:
        """Time along the trajectory file at a set-point's number or between two, s."""
        i = min(int(index), len(self) - 1)
        following = min(i + 1, len(self) - 1)
        return float(self.t[i] + (index - i) * (self.t[following] - self.t[i]))

    def normal_at(self, index: float) -> Floats:
        """Unit normal at the set-point nearest to a number."""
        if self.normal is None:
            raise ValueError("this plan has no normal")
        normal: Floats = self.normal[min(round(index), len(self) - 1)]
        return normal

    def phase_at(self, index: float) -> Phase:
        """Leg on which a set-point lies, or the stroke."""
        numbers = [first for _, first in self.legs]
        return self.legs[max(bisect_right(numbers, index) - 1, 0)][0]

    def draws_at(self, index: float) -> bool:
        """Whether a set-point lies on the stroke."""
        return self.lead <= index <= self.last

    @cached_property
    def sizes(self) -> tuple[Floats, Floats, Floats]:
        """Magnitudes of the `derivatives`, shape (n - 1, 2), (n, 2), (n + 1, 2)."""
        # Column by column in memory: the loop looks for maxima of each when it has to brake.
        velocity, acceleration, jerk = (
            np.asfortranarray(np.linalg.norm(d, axis=-1)) for d in self.derivatives()
        )
        return velocity, acceleration, jerk

    def derivatives(self) -> tuple[Floats, Floats, Floats]:
        """Velocity, acceleration and jerk of the set-points as the arm receives them.

        Differences at the servo period, the set-points held before and after.

        Returns
        -------
        velocity, acceleration, jerk : array, shape (n - 1, 2, 3), (n, 2, 3), (n + 1, 2, 3)
            Axis 1: translation in mm/s, mm/s², mm/s³; rotation in rad/s, rad/s², rad/s³, base
            axes. ``acceleration[i]`` is at set-point i, ``jerk[i]`` between i - 1 and i.
        """
        turn = rotations.log(self.rotation[1:] @ np.swapaxes(self.rotation[:-1], -1, -2))
        velocity = np.stack([np.diff(self.position, axis=0), turn], axis=1) / self.period
        rest = ((1, 1), (0, 0), (0, 0))
        acceleration = np.diff(np.pad(velocity, rest), axis=0) / self.period
        jerk = np.diff(np.pad(acceleration, rest), axis=0) / self.period
        return velocity, acceleration, jerk


def make(
    stroke: StrokeTrajectory,
    period: float,
    speed: float,
    limits: Limits,
    start: Pose,
    approach: float,
) -> Plan:
    """Plan a stroke from where the arm stands, straight to its start.

    Parameters
    ----------
    stroke : StrokeTrajectory
    period : float
        Servo period, s.
    speed : float
        1 as planned, 0.5 at half the speed: tau scaled by 1/speed, the same path.
    limits : Limits
        The approach stays inside them.
    start : Pose
        The actual one.
    approach : float
        Peak speed of the straight way to the stroke's start, mm/s.

    Raises
    ------
    InputError
        There would be more than `LONGEST` set-points.
    """
    sampled = sample(stroke, period, speed, start.rotation)
    way = straight("approach", start, sampled.pose(0), period, limits, approach)
    return joined(sampled, [way], [], period, stroke.rotation is not None)


def sample(stroke: StrokeTrajectory, period: float, speed: float, held: Floats) -> StrokeTrajectory:
    """Return a stroke at the servo period, from t = 0, with an orientation.

    Parameters
    ----------
    stroke : StrokeTrajectory
    period : float
        Servo period, s.
    speed : float
        1 as planned, 0.5 at half the speed; `t` stays time along the file.
    held : array, shape (3, 3)
        Orientation where the stroke states none.

    Raises
    ------
    InputError
        There would be more than `LONGEST` set-points.
    """
    held = np.broadcast_to(held, (len(stroke.t), 3, 3))
    rotation = held if stroke.rotation is None else stroke.rotation
    step = period * speed
    cycles = _cycles(float(stroke.t[-1] - stroke.t[0]) / step - 1e-9, period, "stroke")
    t = np.minimum(stroke.t[0] + np.arange(cycles + 1) * step, stroke.t[-1])
    position, turned = _resample(stroke.t, stroke.position, rotation, t)
    normal = None if stroke.normal is None else _unit(_linear(stroke.t, stroke.normal, t))
    force = None if stroke.force is None else _pressed(stroke.t, stroke.force, t)
    begun = float(stroke.t[0])
    events = tuple(replace(event, t=event.t - begun) for event in stroke.events)
    moved = replace(stroke, t=t - begun, position=position, rotation=turned)
    return replace(moved, normal=normal, events=events, force=force)


def joined(
    sampled: StrokeTrajectory,
    before: Sequence[PlanSegment],
    after: Sequence[PlanSegment],
    period: float,
    oriented: bool,
) -> Plan:
    """Put a stroke and the ways to it and off it together.

    Parameters
    ----------
    sampled : StrokeTrajectory
        At the servo period, with an orientation.
    before, after : sequence of PlanSegment
        An empty leg is none.
    period : float
        Servo period, s.
    oriented : bool
        Whether the orientation is the file's own.
    """
    if sampled.rotation is None:
        raise ValueError("a sampled stroke has an orientation")
    drawn = PlanSegment("stroke", sampled.position, sampled.rotation)
    parts = [leg for leg in (*before, drawn, *after) if len(leg.position)]
    numbers = np.cumsum([0, *(len(leg.position) for leg in parts)]).tolist()
    lead = sum(len(leg.position) for leg in before)
    tail = sum(len(leg.position) for leg in after)

    def held(values: Floats) -> Floats:
        """Repeat the ends over the ways."""
        ends = np.repeat(values[:1], lead, axis=0), np.repeat(values[-1:], tail, axis=0)
        return np.concatenate([ends[0], values, ends[1]])

    return Plan(
        period,
        held(sampled.t),
        np.concatenate([leg.position for leg in parts]),
        np.concatenate([leg.rotation for leg in parts]),
        None if sampled.normal is None else held(sampled.normal),
        lead,
        lead + len(sampled.t) - 1,
        oriented,
        sampled.id,
        tuple((leg.phase, first) for leg, first in zip(parts, numbers, strict=False)),
        tuple(
            (lead + float(np.interp(event.t, sampled.t, np.arange(len(sampled.t)))), event)
            for event in sampled.events
        ),
        None if sampled.force is None else held(sampled.force),
    )


def straight(
    phase: Phase,
    start: Pose,
    goal: Pose,
    period: float,
    limits: Limits,
    speed: float,
    spare: float = 0.0,
) -> PlanSegment:
    """Move straight from one pose to another at minimum jerk, by the shortest rotation.

    Parameters
    ----------
    phase : str
    start, goal : Pose
        `goal` itself is left out. Poses that are the same give an empty leg.
    period : float
        Servo period, s.
    limits : Limits
        Kept on the way.
    speed : float
        Peak speed, mm/s.
    spare : float
        Slow enough to be this much longer, mm: for what a force coupling adds on the same way.

    Raises
    ------
    InputError
        There would be more than `LONGEST` set-points.
    """
    distance, angle = start.apart(goal)
    if distance < _AT_START and angle < _AT_START_ANGLE:
        return PlanSegment(phase, np.empty((0, 3)), np.empty((0, 3, 3)))
    distance += spare
    # Peaks of u = 10 s³ - 15 s⁴ + 6 s⁵: u' 1.875, u'' 5.7735, u''' 60.
    duration = max(
        1.875 * distance / min(speed, limits.speed),
        1.875 * angle / limits.rotation_speed,
        np.sqrt(5.7735 * max(distance / limits.acceleration, angle / limits.rotation_acceleration)),
        np.cbrt(60.0 * max(distance / limits.jerk, angle / limits.rotation_jerk)),
    )
    cycles = _cycles(float(duration) / period, period, phase)
    s = np.arange(cycles) / cycles
    u = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    turn = rotations.log(goal.rotation @ start.rotation.T)
    return PlanSegment(
        phase,
        start.position + u[:, None] * (goal.position - start.position),
        rotations.exp(u[:, None] * turn) @ start.rotation,
    )


def _cycles(cycles: float, period: float, phase: Phase) -> int:
    if not cycles <= LONGEST:
        what, remedy = _WAYS[phase]
        raise InputError(
            f"{what} would take {cycles * period:.3g} s, over {LONGEST} set-points of {period:g} "
            f"s; {remedy}, or the limits"
        )
    return int(np.ceil(cycles))


def _resample(t: Floats, position: Floats, R: Floats, at: Floats) -> tuple[Floats, Floats]:
    if len(t) == len(at) and np.allclose(t, at, rtol=0.0, atol=1e-9):
        return position, np.asarray(R)
    return _unflat(spline(t, _flat(position, R))(at))


def _flat(position: Floats, R: Floats) -> Floats:
    """Positions and quaternions of one sign along the path, shape (n, 7)."""
    q = rotations.to_quaternion(R)
    flips = np.where(np.sum(q[1:] * q[:-1], axis=-1) < 0, -1.0, 1.0)
    q[1:] *= np.cumprod(flips)[:, None]
    return np.hstack([position, q])


def _unflat(y: Floats) -> tuple[Floats, Floats]:
    return y[..., :3], rotations.from_quaternion(y[..., 3:])


def _pressed(t: Floats, force: Floats, at: Floats) -> Floats:
    """Force set-points at other times: between two that press linear, elsewhere the tool lifts."""
    presses = np.interp(at, t, (force > 0.0).astype(float)) > 1.0 - 1e-9
    pressed: Floats = np.where(presses, np.interp(at, t, force), 0.0)
    return pressed


def _linear(t: Floats, y: Floats, at: Floats) -> Floats:
    return np.column_stack([np.interp(at, t, column) for column in y.T])


def _unit(v: Floats) -> Floats:
    unit: Floats = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return unit

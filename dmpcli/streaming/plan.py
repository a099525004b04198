"""From a trajectory's samples to one set-point per servo period, the way to its start included."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmpcli import rotations
from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.streaming.limits import Limits
from dmpcli.streaming.spline import Spline, spline

# Below these the arm stands at the start: a thousandth of a millimetre, and of a degree or so.
_AT_START = 1e-3
_AT_START_ANGLE = 2e-5
# More set-points than this are a mistake: more than an hour at a period of 20 ms.
LONGEST = 200_000


@dataclass(frozen=True)
class Stroke:
    """One trajectory as its file says it.

    Attributes
    ----------
    id : str
    t : array, shape (n,)
        Strictly increasing, s.
    position : array, shape (n, 3)
        mm, base frame.
    rotation : array, shape (n, 3, 3), or None
        None holds the arm's orientation at the start.
    normal : array, shape (n, 3), or None
        Unit normal of the surface, to the tool's side.
    first_row : int
        Row of the file that holds the first sample, counted from 1.
    """

    id: str
    t: Floats
    position: Floats
    rotation: Floats | None = None
    normal: Floats | None = None
    first_row: int = 1


@dataclass(frozen=True)
class Plan:
    """Set-points at the servo period: the approach, then the stroke.

    Attributes
    ----------
    period : float
        s.
    t : array, shape (n,)
        Time along the trajectory file, s; 0 during the approach.
    position : array, shape (n, 3)
        mm.
    rotation : array, shape (n, 3, 3)
    normal : array, shape (n, 3), or None
    lead : int
        Number of the stroke's first set-point.
    oriented : bool
        Whether the orientation is the file's own.
    """

    period: float
    t: Floats
    position: Floats
    rotation: Floats
    normal: Floats | None
    lead: int
    oriented: bool

    def __len__(self) -> int:
        return len(self.t)

    @cached_property
    def _curve(self) -> Spline:
        return spline(np.arange(len(self), dtype=float), _flat(self.position, self.rotation))

    def at(self, index: float) -> tuple[Floats, Floats]:
        """Position and rotation at a set-point's number, or between two: then on a C² curve."""
        i = round(index)
        if abs(index - i) < 1e-9:
            i = min(i, len(self) - 1)
            return self.position[i], self.rotation[i]
        return _unflat(self._curve(np.array(index)))

    def time_at(self, index: float) -> float:
        """Time along the trajectory file at a set-point's number or between two, s."""
        return float(np.interp(index, np.arange(len(self)), self.t))

    def normal_at(self, index: float) -> Floats:
        """Unit normal at the set-point nearest to a number."""
        if self.normal is None:
            raise ValueError("this plan has no normal")
        normal: Floats = self.normal[min(round(index), len(self) - 1)]
        return normal

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
    stroke: Stroke,
    period: float,
    speed: float,
    limits: Limits,
    start: tuple[Floats, Floats],
    approach: float,
) -> Plan:
    """Plan a stroke from where the arm stands.

    Parameters
    ----------
    stroke : Stroke
    period : float
        Servo period, s.
    speed : float
        1 as planned, 0.5 at half the speed: tau scaled by 1/speed, the same path.
    limits : Limits
        The approach stays inside them.
    start : tuple of array, shape (3,) and (3, 3)
        Actual pose, mm.
    approach : float
        Peak speed of the straight way to the stroke's start, mm/s.

    Raises
    ------
    InputError
        There would be more than `LONGEST` set-points.
    """
    held = np.broadcast_to(start[1], (len(stroke.t), 3, 3))
    rotation = held if stroke.rotation is None else stroke.rotation
    step = period * speed
    cycles = _cycles(float(stroke.t[-1] - stroke.t[0]) / step - 1e-9, period, "the stroke")
    t = np.minimum(stroke.t[0] + np.arange(cycles + 1) * step, stroke.t[-1])
    position, turned = _resample(stroke.t, stroke.position, rotation, t)
    normal = None if stroke.normal is None else _unit(_linear(stroke.t, stroke.normal, t))

    way, turn = _approach(start, (position[0], turned[0]), period, limits, approach)
    lead = len(way)
    if normal is not None:
        normal = np.concatenate([np.broadcast_to(normal[0], (lead, 3)), normal])
    return Plan(
        period,
        np.concatenate([np.full(lead, t[0]), t]) - stroke.t[0],
        np.concatenate([way, position]),
        np.concatenate([turn, turned]),
        normal,
        lead,
        stroke.rotation is not None,
    )


def gap(start: tuple[Floats, Floats], goal: tuple[Floats, Floats]) -> tuple[float, float]:
    """Distance and angle between two poses, mm and rad."""
    turn = rotations.log(goal[1] @ start[1].T)
    return float(np.linalg.norm(goal[0] - start[0])), float(np.linalg.norm(turn))


def _approach(
    start: tuple[Floats, Floats],
    goal: tuple[Floats, Floats],
    period: float,
    limits: Limits,
    approach: float,
) -> tuple[Floats, Floats]:
    """Straight, minimum-jerk move from one pose to another, the last pose left out."""
    distance, angle = gap(start, goal)
    if distance < _AT_START and angle < _AT_START_ANGLE:
        return np.empty((0, 3)), np.empty((0, 3, 3))
    # Peaks of u = 10 s³ - 15 s⁴ + 6 s⁵: u' 1.875, u'' 5.7735, u''' 60.
    duration = max(
        1.875 * distance / min(approach, limits.speed),
        1.875 * angle / limits.rotation_speed,
        np.sqrt(5.7735 * max(distance / limits.acceleration, angle / limits.rotation_acceleration)),
        np.cbrt(60.0 * max(distance / limits.jerk, angle / limits.rotation_jerk)),
    )
    cycles = _cycles(float(duration) / period, period, "the way to its start")
    s = np.arange(cycles) / cycles
    u = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    turn = rotations.log(goal[1] @ start[1].T)
    return (
        start[0] + u[:, None] * (goal[0] - start[0]),
        rotations.exp(u[:, None] * turn) @ start[1],
    )


def _cycles(cycles: float, period: float, what: str) -> int:
    if not cycles <= LONGEST:
        raise InputError(
            f"{what} would take {cycles * period:.3g} s, over {LONGEST} set-points of {period:g} "
            "s; raise --speed, --approach or the limits, or shorten the trajectory"
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


def _linear(t: Floats, y: Floats, at: Floats) -> Floats:
    return np.column_stack([np.interp(at, t, column) for column in y.T])


def _unit(v: Floats) -> Floats:
    unit: Floats = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return unit

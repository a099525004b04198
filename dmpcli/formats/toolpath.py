"""A stroke as the moves of a machine: fewer samples, speeds, blends, and ways to and from it.

Between two kept samples the machine moves in a straight line and evenly; what is left out lies
within a tolerance of where the line is at the same time, so that the speed is kept with the path.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.formats.motion import Motion, MotionStroke
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.rotations import exp, interpolate, log
from dmpcli.spatial.wrench import Tool

STANDS, TURNS = 1e-6, 1e-8
"""A leg shorter than this, mm, that turns by less than this, rad, is a pause."""

_SAME_TIME = 1e-6
"""Something that is switched within so many seconds of a sample is switched at it."""

TURN_ALONE = 0.2
"""A leg that turns by more than this, rad/mm, is timed: its speed in mm/s means little."""

LEAST_BLEND = 0.01
"""A smaller radius, mm, is none."""

_SHARE = 0.45
"""Of the shorter neighbouring leg: blends of two corners may not meet."""


@dataclass(frozen=True)
class ProgramOptions:
    """How strokes become programs.

    Attributes
    ----------
    tolerance : float
        Within which samples are left out, mm; 0 keeps all.
    blend : float
        Radius of rounded corners, mm, as far as the legs are long enough.
    lift : float
        How far off the work a program comes and goes, mm.
    travel : float
        Speed there, mm/s.
    acceleration : float
        mm/s².
    lines : int
        Most lines in one routine.
    tilt : float
        How far the tool may lean from straight down in a format without orientation, rad.
    tool : Tool, optional
    payload : bool
        Whether the tool's weight is known.
    """

    tolerance: float = 0.005
    blend: float = 1.0
    lift: float = 20.0
    travel: float = 50.0
    acceleration: float = 1000.0
    lines: int = 1000
    tilt: float = np.radians(5.0)
    tool: Tool | None = None
    payload: bool = False


@dataclass(frozen=True)
class Toolpath:
    """One stroke as moves.

    Attributes
    ----------
    id : str
    t : array, shape (n,)
        s.
    position : array, shape (n, 3)
        As printed, mm.
    rotation : array, shape (n, 3, 3), or None
    before, after : array, shape (3,)
        Where the tool comes from and goes to, mm.
    switches : dict of list
        What is switched at a sample, by its number, in order.
    """

    id: str
    t: Floats
    position: Floats
    rotation: Floats | None
    before: Floats
    after: Floats
    switches: dict[int, list[OutputEvent]] = field(default_factory=dict)

    @property
    def seconds(self) -> Floats:
        """Of each leg, shape (n - 1,), s."""
        return np.asarray(np.diff(self.t))

    @property
    def length(self) -> Floats:
        """Of each leg, shape (n - 1,), mm."""
        return np.asarray(np.linalg.norm(np.diff(self.position, axis=0), axis=1))

    @property
    def turn(self) -> Floats:
        """By how much each leg turns the tool, shape (n - 1,), rad."""
        if self.rotation is None:
            return np.zeros(len(self.t) - 1)
        step = np.swapaxes(self.rotation[:-1], 1, 2) @ self.rotation[1:]
        return np.asarray(np.linalg.norm(log(step), axis=1))

    def blends(self, most: float) -> Floats:
        """Radius at the end of each leg, shape (n - 1,), mm; 0 at the last one and at pauses."""
        length = np.append(self.length, 0.0)
        radius = np.minimum(most, _SHARE * np.minimum(length[:-1], length[1:]))
        return np.where(radius < LEAST_BLEND, 0.0, radius)


@dataclass(frozen=True)
class ProgramLeg:
    """One move of a stroke: to where, and how fast by one of three ways.

    Attributes
    ----------
    index : int
        Of the sample that it leads to.
    speed : float or None
        mm/s.
    seconds : float
    pause : bool
        Nothing moves for so many seconds.
    turn : float
        rad.
    blend : float
        mm.
    """

    index: int
    speed: float | None
    seconds: float
    pause: bool
    turn: float
    blend: float


def legs(path: Toolpath, blend: float) -> Iterator[ProgramLeg]:
    """Yield the moves of a stroke, from its first sample on."""
    length, turn, seconds = path.length, path.turn, path.seconds
    pause = (length < STANDS) & (turn < TURNS)
    timed = turn > TURN_ALONE * length
    columns = (length, turn, seconds, pause, timed, path.blends(blend))
    for i, (s, w, dt, still, by_time, r) in enumerate(
        zip(*(column.tolist() for column in columns), strict=True)
    ):
        yield ProgramLeg(i + 1, None if by_time or still else s / dt, dt, still, w, r)


def toolpaths(motion: Motion, options: ProgramOptions, digits: int) -> list[Toolpath]:
    """Return the strokes of a motion as moves, with positions of so many digits after the point.

    Parameters
    ----------
    motion : Motion
    options : ProgramOptions
        Samples are thinned to within its `tolerance`; ways to and from the work are its `lift` off
        the ends, along the surface's normal, else against the tool's axis, else along base z.
    digits : int
        Of positions in mm. Rounded here, so that lengths are those of the printed moves.

    Returns
    -------
    list of Toolpath
        Samples at which something is switched are kept.
    """
    paths = []
    for stroke in motion.strokes:
        one, corners = with_places(stroke)
        kept = thinned(one, options.tolerance, [row for row, _ in corners])
        position = np.round(one.position[kept], digits) + 0.0
        rotation = None if one.rotation is None else np.asarray(one.rotation)[kept]
        ends = [position[i] + options.lift * _off(one, i) for i in (0, -1)]
        switches: dict[int, list[OutputEvent]] = {}
        for row, event in corners:
            switches.setdefault(int(np.searchsorted(kept, row)), []).append(event)
        before, after = ends
        path = Toolpath(one.id, one.t[kept], position, rotation, before, after, switches)
        paths.append(path)
    return paths


def with_places(one: MotionStroke) -> tuple[MotionStroke, list[tuple[int, OutputEvent]]]:
    """Return a stroke that has a sample wherever something is switched, and which sample it is."""
    places = np.clip([event.t for event in one.events], one.t[0], one.t[-1])
    near = np.abs(one.t[:, None] - places).min(axis=0, initial=np.inf) < _SAME_TIME
    new = np.unique(places[~near])
    if len(new):
        t = np.sort(np.concatenate([one.t, new]))
        rotation, normal = one.rotation, one.normal
        if normal is not None and len(normal) > 1:
            normal = normal[np.clip(np.searchsorted(one.t, t), 0, len(one) - 1)]
        one = replace(
            one,
            t=t,
            position=np.column_stack([np.interp(t, one.t, axis) for axis in one.position.T]),
            rotation=None if rotation is None else interpolate(one.t, np.asarray(rotation), t),
            normal=normal,
        )
    rows = [int(np.abs(one.t - place).argmin()) for place in places]
    return one, list(zip(rows, one.events, strict=True))


def _off(one: MotionStroke, i: int) -> Floats:
    """Direction off the work at a sample: the surface's normal, else against the tool's axis."""
    if one.normal is not None:
        return np.asarray(one.normal[i if len(one.normal) > 1 else 0])
    if one.rotation is not None:
        return np.asarray(-one.rotation[i, :, 2])
    return np.array([0.0, 0.0, 1.0])


def thinned(one: MotionStroke, tolerance: float, corners: Sequence[int] = ()) -> Integers:
    """Return which samples stay, first and last among them.

    Douglas and Peucker's way, with the distance to where the straight motion is at the same time.
    A turn counts as the way of a point 50 mm off: 0.005 mm are then 0.006°.

    Parameters
    ----------
    one : MotionStroke
    tolerance : float
        mm.
    corners : sequence of int
        Samples that stay too.
    """
    n = len(one)
    if tolerance <= 0.0 or n < 3:
        return np.arange(n)
    keep = np.zeros(n, dtype=bool)
    keep[[0, -1, *corners]] = True
    ends = np.flatnonzero(keep)
    first, last = ends[:-1], ends[1:]
    # All spans of one halving together: a few long arrays instead of many short ones.
    while True:
        long = last - first > 1
        first, last = first[long], last[long]
        if not len(first):
            return np.flatnonzero(keep)
        within = last - first - 1
        begin = np.cumsum(within) - within
        row = np.arange(within.sum()) + np.repeat(first + 1 - begin, within)
        off = _lost(one, np.repeat(first, within), row, np.repeat(last, within))
        most = np.maximum.reduceat(off, begin)
        at_most = np.flatnonzero(off == np.repeat(most, within))
        middle = row[at_most[np.searchsorted(at_most, begin)]]
        split = most > tolerance
        first, middle, last = first[split], middle[split], last[split]
        keep[middle] = True
        first, last = np.concatenate([first, middle]), np.concatenate([middle, last])


def _lost(one: MotionStroke, first: Integers, row: Integers, last: Integers) -> Floats:
    """How far samples lie off the even motion between two others, shape (n,), mm."""
    share = ((one.t[row] - one.t[first]) / (one.t[last] - one.t[first]))[:, None]
    p = one.position
    off = np.linalg.norm(p[row] - (p[first] + share * (p[last] - p[first])), axis=1)
    if one.rotation is None:
        return np.asarray(off)
    R = np.asarray(one.rotation)
    begun = np.swapaxes(R[first], 1, 2)
    straight = R[first] @ exp(share * log(begun @ R[last]))
    lost = log(np.swapaxes(straight, 1, 2) @ R[row])
    return np.asarray(np.maximum(off, _ARM * np.linalg.norm(lost, axis=1)))


_ARM = 50.0

GRAVITY = 9.80665
"""Standard gravity, m/s²: controllers take a mass, tool files hold a weight."""


def centre_on_flange(tool: Tool) -> Floats:
    """Centre of mass of what hangs on the sensor, in flange axes, shape (3,), mm."""
    return np.asarray(tool.sensor_position + tool.sensor_rotation @ tool.centre)


def parts(count: int, most: int) -> Iterator[range]:
    """Yield the numbers of `count` things in groups of at most so many."""
    for first in range(0, count, most):
        yield range(first, min(first + most, count))

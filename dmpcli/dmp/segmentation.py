"""Parts of a recording: idle ends, pauses, approach and retract, and cutting at them.

Rest is told from motion by means over 0.1 s, against what noise explains of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.dmp.noise import Noise
from dmpcli.dmp.smoothing import IDLE_MARGIN, REST_SPEED
from dmpcli.spatial.trajectory import Trajectory

# Means over so long, s, and standard deviations of theirs by which a tool has left its place.
_MEAN = 0.1
_LEFT = 4.0
# A departure lasts so many means: noise comes back.
_LASTS = 2
# Shortest pause, s, and steps at the speed of rest that a tool may creep in it: what a joint jumps.
_PAUSE = 0.3
_JUMP = 3.0
# Points along the path on which approach and retract are looked for.
_POINTS = 300
# How far, by its chord, a straight motion bends at most.
_BEND = 0.1
# An approach rises off the stroke's plane by so much: mm, by the stroke's extent, by its thickness,
# and by the noise; lower ones are soft landings.
_RISE, _RISE_BY_EXTENT, _RISE_BY_THICKNESS, _RISE_BY_NOISE = 5.0, 0.02, 3.0, 10.0
# Sine of the least angle between an approach and the plane, and across of the tool's axis.
_STEEP = 0.7
# Extent across the stroke, by that along it, from which on it tells its plane.
_FLAT = 0.02
# Window about the end of an approach, by its length (and so many times as wide on its side), and
# part of its peak speed that is a rest.
_ABOUT, _PAST = 0.1, 2
_SLOW = 0.2
# Cosine of the least turn at a corner.
_CORNER = 0.7

Span = tuple[float, float]


@dataclass(frozen=True)
class Segments:
    """Parts of a recording, s from its first sample.

    Attributes
    ----------
    moving : (float, float)
        Between the idle ends.
    pauses : tuple of (float, float)
        Rests inside of it.
    approach, retract : (float, float) or None
        Motions towards and away from the surface that belong to no stroke.
    """

    moving: Span
    pauses: tuple[Span, ...]
    approach: Span | None
    retract: Span | None


def segment(stroke: Trajectory, noise: Noise) -> Segments:
    """Find the parts of an even recording.

    Parameters
    ----------
    stroke : Trajectory
        Even, from t = 0.
    noise : Noise
        Of its positions.

    Returns
    -------
    Segments
    """
    motion = _motion(stroke, noise)
    core = _core(motion)
    part = _moving(motion, core)
    pauses = [_sharp(stroke, motion, noise, pause) for pause in _pauses(motion, core)]
    head, tail = _strays(stroke, motion, part)
    t = stroke.t
    end = float(t[part.stop - 1])
    return Segments(
        (float(t[part.start]), end),
        tuple((float(t[a]), float(t[b])) for a, b in pauses),
        None if head is None else (float(t[part.start]), float(t[head])),
        None if tail is None else (float(t[tail]), end),
    )


def moving_part(stroke: Trajectory, noise: Noise) -> slice:
    """Samples of an even stroke between the idle ends, `IDLE_MARGIN` of it added at both."""
    motion = _motion(stroke, noise)
    return _moving(motion, _core(motion))


def cut(
    stroke: Trajectory,
    start: float | None = None,
    until: float | None = None,
    pauses: Sequence[Span] = (),
) -> Trajectory:
    """Cut an even stroke, and close up its pauses.

    Parameters
    ----------
    stroke : Trajectory
        Even, from t = 0.
    start, until : float, optional
        s.
    pauses : sequence of (float, float)
        s; of each the first sample is kept.

    Returns
    -------
    Stroke
        On the same grid, from t = 0. Samples are left out, none is moved: at a joint the stroke
        jumps by no more than the tool moved in the pause.
    """
    t = stroke.t
    step = float(t[-1]) / (len(t) - 1)
    # Half a step of rounding: a time that was told names its sample.
    kept = np.ones(len(t), dtype=bool)
    if start is not None:
        kept &= t >= start - 0.5 * step
    if until is not None:
        kept &= t <= until + 0.5 * step
    for begin, end in pauses:
        kept &= (t <= begin + 0.5 * step) | (t > end + 0.5 * step)
    if kept.all():
        return stroke
    count = int(kept.sum())
    return Trajectory(
        np.linspace(0.0, step * max(count - 1, 0), count),
        stroke.position[kept],
        None if stroke.rotation is None else stroke.rotation[kept],
        contact_force=None if stroke.contact_force is None else stroke.contact_force[kept],
    )


@dataclass(frozen=True)
class _Motion:
    """Sliding means of a recording.

    Attributes
    ----------
    position : array, shape (T, 3)
        Means over 0.1 s, shorter at the ends, mm.
    speed : array, shape (T,)
        Of the means, mm/s.
    step : float
        s.
    width : int
        Samples of a mean.
    sigma : float
        Standard deviation of a mean along the noisiest axis, mm.
    """

    position: Floats
    speed: Floats
    step: float
    width: int
    sigma: float

    @property
    def reversed(self) -> "_Motion":
        return _Motion(self.position[::-1], self.speed[::-1], self.step, self.width, self.sigma)


def _motion(stroke: Trajectory, noise: Noise) -> _Motion:
    count = len(stroke.t)
    step = float(stroke.t[-1]) / (count - 1)
    half = min(int(0.5 * _MEAN / step), (count - 1) // 4)
    position = stroke.position
    if half > 0 and noise.largest > 0.0:
        sums = np.concatenate([np.zeros((1, 3)), np.cumsum(position - position[0], axis=0)])
        at = np.arange(count)
        low, high = np.maximum(at - half, 0), np.minimum(at + half + 1, count)
        position = position[0] + (sums[high] - sums[low]) / (high - low)[:, None]
    else:
        half = 0
    speed = np.linalg.norm(np.gradient(position, step, axis=0), axis=1)
    width = 2 * half + 1
    return _Motion(position, speed, step, width, noise.largest / float(np.sqrt(width)))


def _core(motion: _Motion) -> tuple[int, int]:
    """First and last sample that certainly move; the whole where nothing does."""
    count = len(motion.speed)
    fast = np.flatnonzero(motion.speed > REST_SPEED * motion.speed.max())
    if len(fast) == 0:
        return 0, count - 1
    first = max(int(fast[0]), _departure(motion))
    last = min(int(fast[-1]), count - 1 - _departure(motion.reversed))
    return (first, last) if first < last else (0, count - 1)


def _moving(motion: _Motion, core: tuple[int, int]) -> slice:
    first, last = core
    margin = int(np.ceil(IDLE_MARGIN * (last - first)))
    return slice(max(0, first - margin), min(len(motion.speed), last + 1 + margin))


def _departure(motion: _Motion) -> int:
    """First sample from which on the tool stays off its resting place."""
    if motion.sigma == 0.0:
        return 0
    position, far = motion.position, _LEFT * motion.sigma
    lasts = _LASTS * motion.width
    place = position[motion.width // 2]
    departed = 0
    for _ in range(8):
        off = np.sum((position - place) ** 2, axis=1) > far * far
        run = _first_run(off, lasts)
        if run is None or run == departed:
            break
        departed = run
        if departed > 0:
            # Two means of the recording's first samples are less noisy than one.
            place = position[: departed : motion.width].mean(axis=0)
    return departed


def _first_run(flags: Booleans, length: int) -> int | None:
    """First of `length` flags in a row, None without one."""
    for begin, end in zip(*_runs(flags), strict=True):
        if end - begin >= length:
            return int(begin)
    return None


def _runs(flags: Booleans) -> tuple[list[int], list[int]]:
    """Begins and ends (exclusive) of the runs of True."""
    edges = np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))
    return np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist()


def _pauses(motion: _Motion, core: tuple[int, int]) -> list[tuple[int, int]]:
    """First and last samples of the rests inside the core."""
    count, (first, last) = len(motion.speed), core
    lag = max(1, round(0.5 * _PAUSE / motion.step))
    if count <= 2 * lag:
        return []
    position, peak = motion.position, float(np.quantile(motion.speed, 0.95))
    hidden = max(_LEFT * motion.sigma, REST_SPEED * peak * _JUMP * motion.step)
    shortest = max(_PAUSE, 4.0 * hidden / (0.1 * peak) if peak > 0.0 else _PAUSE)
    net = np.linalg.norm(position[2 * lag :] - position[: -2 * lag], axis=1)
    still = np.zeros(count, dtype=bool)
    still[lag:-lag] = net <= max(1.2 * _LEFT * motion.sigma, REST_SPEED * peak * _PAUSE)
    found: list[tuple[int, int]] = []
    for begin, end in zip(*_runs(still), strict=True):
        if end <= first or begin >= last or (found and begin <= found[-1][1]):
            continue
        a, b = _stay(motion, begin, end, hidden)
        if a > first and b < last and (b - a) * motion.step >= shortest:
            found.append((a, b))
    return found


def _stay(motion: _Motion, begin: int, end: int, hidden: float) -> tuple[int, int]:
    """First and last sample of the stay at the place of samples [begin, end).

    A turn to and fro has no net way either, but leaves its place at once.
    """
    position, lasts = motion.position, _LASTS * motion.width
    middle, low, high = (begin + end) // 2, begin, end
    # Looked for near by first: a long recording may have many turns.
    reach = 2 * (end - begin) + 4 * lasts + round(2.0 * _PAUSE / motion.step)
    for _ in range(3):
        place = position[low:high].mean(axis=0)
        while True:
            first, stop = max(0, middle - reach), min(len(position), middle + reach)
            off = np.sum((position[first:stop] - place) ** 2, axis=1) > hidden**2
            after = _first_run(off[middle - first :], lasts)
            before = _first_run(off[middle - first :: -1], lasts)
            high = stop if after is None else middle + after
            low = first if before is None else middle - before + 1
            if (high < stop or stop == len(position)) and (low > first or first == 0):
                break
            reach *= 2
        if high <= low:
            return begin, begin
    return low, high - 1


def _sharp(
    stroke: Trajectory, motion: _Motion, noise: Noise, pause: tuple[int, int]
) -> tuple[int, int]:
    """Pause whose ends are told by samples: a mean moves before its middle does."""
    a, b = pause
    place = motion.position[a : b + 1].mean(axis=0)
    half, least = motion.width // 2, REST_SPEED * float(motion.speed.max()) * motion.step
    far = max(_LEFT * noise.largest, least)
    off = np.sum((stroke.position - place) ** 2, axis=1) > far * far
    before, after = off[max(0, a - half) : a][::-1], off[b + 1 : b + 1 + half]
    a -= int(np.argmax(before)) if before.any() else len(before)
    b += int(np.argmax(after)) if after.any() else len(after)
    return a, b


def _strays(stroke: Trajectory, motion: _Motion, part: slice) -> tuple[int | None, int | None]:
    """Last sample of an approach and first of a retract; None without them."""
    position = motion.position[part]
    tool = None if stroke.rotation is None else stroke.rotation[part][:, :, 2]
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))])
    if way[-1] == 0.0:
        return None, None
    at = np.searchsorted(way, np.linspace(0.0, way[-1], _POINTS)).clip(0, len(way) - 1)
    points = position[at]
    axis = None if tool is None else np.mean(tool, axis=0)
    head, tail = _straight(points), _POINTS - 1 - _straight(points[::-1])
    for first, last in ((head, tail), (head, None), (None, tail)):
        low = 0 if first is None else first
        high = _POINTS - 1 if last is None else last
        if high - low < _POINTS // 20:
            continue
        main = points[low : high + 1]
        normal = _normal(main, axis)
        if normal is None:
            continue
        heads = first is None or _is_stray(points[: low + 1], main, normal, motion.sigma)
        tails = last is None or _is_stray(points[high:][::-1], main, normal, motion.sigma)
        if not (heads and tails):
            continue
        ends = (
            None if first is None else _end(motion, part, at, first, False),
            None if last is None else _end(motion, part, at, last, True),
        )
        if (first is None or ends[0] is not None) and (last is None or ends[1] is not None):
            return ends
    return None, None


def _straight(points: Floats) -> int:
    """Last of the points that lie along a straight line from the first."""
    low, high = 2, len(points) - 1
    while low < high:
        middle = (low + high + 1) // 2
        if _bend(points[: middle + 1]) <= _BEND:
            low = middle
        else:
            high = middle - 1
    return low


def _bend(points: Floats) -> float:
    """Largest distance from the chord by the chord's length."""
    chord = points[-1] - points[0]
    length = float(np.linalg.norm(chord))
    if length == 0.0:
        return np.inf
    off = points - points[0]
    along = off @ chord / length
    across = np.sum(off**2, axis=1) - along**2
    return float(np.sqrt(max(0.0, float(across.max())))) / length


def _normal(main: Floats, tool: Floats | None) -> Floats | None:
    """Normal of the plane in which the main part lies; of a straight one, the tool's axis."""
    centred = main - main.mean(axis=0)
    squares, axes = np.linalg.eigh(centred.T @ centred)
    if squares[1] > _FLAT**2 * squares[2]:
        return np.asarray(axes[:, 0])
    if tool is None:
        return None
    across = tool - (tool @ axes[:, 2]) * axes[:, 2]
    length = float(np.linalg.norm(across))
    return None if length < _STEEP * np.linalg.norm(tool) else np.asarray(across / length)


def _is_stray(points: Floats, main: Floats, normal: Floats, sigma: float) -> bool:
    """Whether points that end on the main part come in steeply from far off its plane."""
    chord = points[0] - points[-1]
    if abs(float(chord @ normal)) < _STEEP * float(np.linalg.norm(chord)):
        return False
    middle = main.mean(axis=0)
    height = np.sort((main - middle) @ normal)
    outer = len(height) // 50
    low, high = float(height[outer]), float(height[-1 - outer])
    rise = float((points[0] - middle) @ normal)
    rise = rise - high if rise > 0.0 else low - rise
    # The same in every frame, as a box about the stroke would not be.
    radius = float(np.sqrt(np.max(np.sum((main - middle) ** 2, axis=1))))
    least = max(
        _RISE,
        _RISE_BY_EXTENT * 2.0 * radius,
        _RISE_BY_THICKNESS * (high - low),
        _RISE_BY_NOISE * sigma,
    )
    return rise >= least


def _end(motion: _Motion, part: slice, at: Floats, point: int, reverse: bool) -> int | None:
    """Sample at which an approach (a retract, reversed) meets the stroke: a rest, or a corner."""
    size = max(2, int(np.ceil(_ABOUT * (_POINTS - 1 - point if reverse else point))))
    # A straight line that may bend a little reaches past the corner.
    back, on = (size, _PAST * size) if reverse else (_PAST * size, size)
    low, high = max(0, point - back), min(_POINTS - 1, point + on)
    a, b = part.start + int(at[low]), part.start + int(at[high])
    stray = slice(b, part.stop) if reverse else slice(part.start, a + 1)
    speed, position = motion.speed[a : b + 1].copy(), motion.position
    # Where the window reaches the recording's other end, the rest there is not a meeting.
    about = part.start + int(at[point]) - a
    if reverse and low == 0:
        speed[: int(np.argmax(speed[: about + 1]))] = np.inf
    elif not reverse and high == _POINTS - 1:
        speed[about + int(np.argmax(speed[about:])) + 1 :] = np.inf
    slowest = int(np.argmin(speed))
    if len(motion.speed[stray]) and speed[slowest] <= _SLOW * motion.speed[stray].max():
        return int(a + slowest)
    # The corner lies farthest from the chord of the window.
    chord = position[b] - position[a]
    off = position[a : b + 1] - position[a]
    along = off @ chord / max(float(chord @ chord), 1e-300)
    corner = a + int(np.argmax(np.sum((off - along[:, None] * chord) ** 2, axis=1)))
    before, after = position[corner] - position[a], position[b] - position[corner]
    lengths = float(np.linalg.norm(before) * np.linalg.norm(after))
    return corner if lengths > 0.0 and float(before @ after) <= _CORNER * lengths else None

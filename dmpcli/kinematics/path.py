"""Whether an arm can follow paths: reach, joint limits, joint speeds, and no jump on the way.

Each of the eight branches of the inverse kinematics is followed along the path by continuity: to
the next sample, a branch goes on as the solution nearest to it. That is nearly always the solution
of the same number; where a path runs through a singularity it may be another one. Joint angles are
unwrapped on the way, and turned by whole turns as a whole so that they fit best between the limits.

Without a start configuration the arm may begin in any branch: of those that reach all of the path
the one with the largest margin is taken, where the margin is the smallest share, over joints and
samples, of half the joint's range that is left to its nearer limit, or of its speed that is left.
With one, the arm begins in the branch and turn nearest to it.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.kinematics import inverse
from dmpcli.kinematics.inverse import BRANCHES, IN_LINE
from dmpcli.kinematics.models import Arm

JUMP = 0.35
"""A joint jumps where it would turn further than this from one sample to the next, rad, too fast,
and `_ALONE` times as far as before and after: a motion that is only fast has fast neighbours."""

_ALONE = 4.0

# Rounding of what was planned to the limit.
_SLACK = 1e-6
# Samples of paths that are solved together: some 200 MB.
_TOGETHER = 20_000
_TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Peak:
    """Where along each of B paths a quantity is worst against its limit.

    Attributes
    ----------
    value, limit : array, shape (B,)
    sample, joint : array of int, shape (B,)
        From 0; for what lies between two samples the later one.
    """

    value: Floats
    limit: Floats
    sample: Integers
    joint: Integers

    @property
    def passed(self) -> Booleans:
        """Whether the limit is kept, shape (B,); a value that is not a number keeps none."""
        return np.abs(self.value) <= np.abs(self.limit) * (1.0 + _SLACK)


@dataclass(frozen=True)
class Followed:
    """How an arm follows B paths of T samples.

    Attributes
    ----------
    joints : array, shape (B, T, 6)
        rad, continuous; NaN where the path is out of reach anywhere.
    missing : Peak
        By how much the arm misses the worst pose, mm, against 0; its joint means nothing.
    angle : Peak
        Angle from the middle of the joint's range, against half of it, rad.
    speed : Peak
        rad/s.
    leap : Peak
        Turn from one sample to the next that stands alone, against `JUMP`, rad.
    nearness : array, shape (B, 3)
        Smallest of each measure of `inverse.SINGULARITIES` at the two samples of the worst speed.
    margin : array, shape (B,)
        As above; NaN where the path is out of reach.
    """

    joints: Floats
    missing: Peak
    angle: Peak
    speed: Peak
    leap: Peak
    nearness: Floats
    margin: Floats

    @property
    def passed(self) -> Booleans:
        """Whether the arm can follow, shape (B,)."""
        return self.missing.passed & self.angle.passed & self.speed.passed

    @property
    def jumps(self) -> Booleans:
        """Whether a joint would jump between two samples, shape (B,)."""
        return ~self.leap.passed & ~self.speed.passed


def follow(
    arm: Arm, position: Floats, rotation: Floats, period: float, start: Floats | None = None
) -> Followed:
    """Follow paths of the flange.

    Parameters
    ----------
    arm : Arm
    position : array, shape (B, T, 3)
        mm, base frame.
    rotation : array, shape (B, T, 3, 3)
    period : float
        Between two samples, s.
    start : array, shape (6,) or (B, 6), optional
        Joint angles at the beginning or shortly before, rad.

    Returns
    -------
    Followed
    """
    count, samples = position.shape[:2]
    if start is not None:
        start = np.broadcast_to(start, (count, 6))
    together = max(1, _TOGETHER // samples)
    parts = [
        _follow(
            arm,
            position[i : i + together],
            rotation[i : i + together],
            period,
            None if start is None else start[i : i + together],
        )
        for i in range(0, count, together)
    ]
    return _joined(parts)


def _follow(
    arm: Arm, position: Floats, rotation: Floats, period: float, start: Floats | None
) -> Followed:
    count = len(position)
    q, missing = _solved(arm, position, rotation, start)
    index = _continued(q)
    if index is not None:
        q = np.take_along_axis(q, index[..., None], axis=2)
        missing = np.take_along_axis(missing, index, axis=2)
    _unwrap(q)
    lost = missing.max(axis=1)  # (B, 8), 0 where a branch reaches all of the path
    middle, half = arm.limits.mean(axis=1), np.diff(arm.limits, axis=1)[:, 0] / 2.0
    if start is not None:
        home = start[:, None]
        turns = np.round((home - q[:, 0]) / _TURN)
    else:
        turns = np.round((middle - (q.min(axis=1) + q.max(axis=1)) / 2.0) / _TURN)
    q += _TURN * turns[:, None]
    angle = np.abs(q - middle)  # (B, T, 8, 6)
    step = np.abs(np.diff(q, axis=1))
    margin = np.minimum(
        1.0 - (angle.max(axis=1) / half).max(axis=-1),
        1.0 - (step.max(axis=1, initial=0.0) / (period * arm.speeds)).max(axis=-1),
    )
    # Best last: what reaches nothing by what it misses, what reaches by its margin.
    unreached = -1e12 - lost
    if start is None:
        merit = np.where(lost > 0.0, unreached, margin)
    else:
        away = ((q[:, 0] - home) ** 2).sum(axis=-1)
        merit = np.where(np.isnan(away), unreached, -away)
    best = np.argmax(merit, axis=1)
    row = np.arange(count)
    q, angle, step = q[row, :, best], angle[row, :, best], step[row, :, best]
    missing, lost, margin = missing[row, :, best], lost[row, best], margin[row, best]
    speed = _peak(step / period, arm.speeds)
    shift = 1 if step.shape[1] else 0
    speed = Peak(speed.value, speed.limit, speed.sample + shift, speed.joint)
    beside = np.pad(step, ((0, 0), (1, 1), (0, 0)))
    alone = step > _ALONE * np.maximum(beside[:, :-2], beside[:, 2:])
    leap = _peak(np.where(alone, step, 0.0), np.full(6, JUMP))
    nowhere = np.zeros(count, dtype=np.int64)
    near = np.minimum(
        inverse.singularity(arm, q[row, speed.sample]),
        inverse.singularity(arm, q[row, np.maximum(speed.sample - 1, 0)]),
    )
    return Followed(
        q,
        Peak(lost, np.zeros(count), missing.argmax(axis=1), nowhere),
        _peak(angle, half),
        speed,
        Peak(leap.value, leap.limit, leap.sample + shift, leap.joint),
        near,
        np.where(lost > 0.0, np.nan, margin),
    )


def _solved(
    arm: Arm, position: Floats, rotation: Floats, start: Floats | None
) -> tuple[Floats, Floats]:
    """All solutions at all samples; where joint 6 is free it stays as at the sample before."""
    q, missing = inverse.solve(arm, position, rotation)
    free = np.abs(np.sin(q[..., 4] + arm.offset[4])) < 2.0 * IN_LINE
    pairs, samples = np.nonzero(free.any(axis=-1))
    if not len(pairs):
        return q, missing
    number = np.arange(free.shape[1])[:, None]
    before = np.maximum.accumulate(np.where(free, -1, number), axis=1)
    sixth = np.take_along_axis(q[..., 5], np.maximum(before, 0), axis=1)
    if start is not None:
        sixth = np.where(before < 0, start[:, None, None, 5], sixth)
    at = pairs, samples
    q[at], missing[at] = inverse.solve(arm, position[at], rotation[at], sixth[at])
    return q, missing


def _continued(q: Floats) -> Integers | None:
    """Number of the solution that each branch has become, shape (B, T, 8); None where none change.

    Parameters
    ----------
    q : array, shape (B, T, 8, 6)
    """
    moved = np.abs(_wrapped(np.diff(q, axis=1))).max(axis=-1)
    ends = np.isnan(q[:, 1:, :, 0]) & ~np.isnan(q[:, :-1, :, 0])
    pairs, samples = np.nonzero(((moved > JUMP) | ends).any(axis=-1))
    own = np.arange(BRANCHES)
    between = np.abs(_wrapped(q[pairs, samples + 1][:, None] - q[pairs, samples][:, :, None]))
    distance = np.nan_to_num(between.max(axis=-1), nan=np.inf)  # from branch (axis 1) to branch
    nearest = distance.argmin(axis=-1)
    # To go on in another branch with a jump, where one's own ends, would hide that it ends.
    hidden = np.isinf(distance[:, own, own]) & (distance.min(axis=-1) > JUMP)
    onward = np.where(hidden, own, nearest)
    if (onward == own).all():
        return None
    index = np.tile(own, (*q.shape[:2], 1))
    index[pairs, samples + 1] = onward
    # Composed from the first sample on, over twice as many samples each time.
    reach = 1
    while reach < q.shape[1]:
        index[:, reach:] = np.take_along_axis(index[:, reach:], index[:, :-reach], axis=2)
        reach *= 2
    return index


def _unwrap(q: Floats) -> None:
    """Take whole turns out of the steps along axis 1, in place."""
    turns = np.cumsum(np.round(np.diff(q, axis=1) / _TURN), axis=1)
    q[:, 1:] -= _TURN * turns


def _peak(values: Floats, limit: Floats) -> Peak:
    """Worst share of a limit over samples and joints, of values of shape (B, T, 6); 0 without T."""
    count = len(values)
    if not values.shape[1]:
        values = np.zeros((count, 1, 6))
    share = np.nan_to_num((values / limit).reshape(count, -1), nan=np.inf)
    sample, joint = np.unravel_index(share.argmax(axis=1), values.shape[1:])
    return Peak(values[np.arange(count), sample, joint], limit[joint], sample, joint)


def _wrapped(angles: Floats) -> Floats:
    return angles - _TURN * np.round(angles / _TURN)


def _joined(parts: list[Followed]) -> Followed:
    def peak(name: str) -> Peak:
        peaks = [getattr(part, name) for part in parts]
        return Peak(
            *(
                np.concatenate([getattr(p, field) for p in peaks])
                for field in ("value", "limit", "sample", "joint")
            )
        )

    def array(name: str) -> Floats:
        return np.concatenate([getattr(part, name) for part in parts])

    return Followed(
        array("joints"),
        peak("missing"),
        peak("angle"),
        peak("speed"),
        peak("leap"),
        array("nearness"),
        array("margin"),
    )

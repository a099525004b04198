"""From a recording to a smooth stroke, and what was found on the way.

Even time first; then the parts of the recording; then cutting; the spline last, on what is left.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import noise, segmentation, spline_smoothing, time_base
from dmpcli.dmp.segmentation import Span
from dmpcli.dmp.spline_smoothing import SmoothSpline
from dmpcli.dmp.time_base import continuous_quaternions
from dmpcli.errors import InputError
from dmpcli.spatial import recording_gaps, rotations
from dmpcli.spatial.trajectory import Trajectory

# Fewer samples are no stroke.
FEWEST = 10


@dataclass(frozen=True)
class Preprocessed:
    """A smooth stroke, and what was found in its recording.

    Times of `gaps`, `pauses`, `approach`, `retract` are those of the recording, s from its first
    sample; all others count from the stroke's own start.

    Attributes
    ----------
    raw : Trajectory
        Even samples, cut and trimmed, from t = 0; not smoothed. What a skill is judged by.
    position : SmoothSpline
        mm, over [0, duration].
    quaternion : SmoothSpline or None
        Components (x, y, z, w), not of unit length; `rotation` divides the length out.
    trimmed : (float, float)
        Idle time cut off before and after, s.
    gaps, pauses : tuple of (float, float)
        Missing samples that were filled; rests inside the stroke, cut out or not.
    approach, retract : (float, float) or None
        Motions that belong to no stroke; the first ends, the second begins where to cut.
    cut_pauses : bool
        Whether the pauses were cut out.
    merged : int
        Samples that were averaged away with others of their burst.
    resampled : bool
        Whether uneven steps were interpolated.
    force : SmoothSpline or None
        On the tool, base axes, N; None where none is to be learned.
    """

    raw: Trajectory
    position: SmoothSpline
    quaternion: SmoothSpline | None
    trimmed: Span
    gaps: tuple[Span, ...]
    pauses: tuple[Span, ...]
    approach: Span | None
    retract: Span | None
    cut_pauses: bool
    merged: int
    resampled: bool
    force: SmoothSpline | None = None

    @property
    def duration(self) -> float:
        """Of the smooth stroke, s."""
        return self.raw.duration

    @property
    def cutoff(self) -> float | None:
        """Hz; None where the spline interpolates the samples."""
        return self.position.cutoff

    @property
    def sigma(self) -> float:
        """Noise, root mean square per axis, mm."""
        return self.position.noise.typical

    @property
    def half_rate(self) -> float:
        """Half the sampling rate, Hz: what shares of the band in `Noise` are of."""
        return 0.5 * (len(self.raw.t) - 1) / self.duration

    @property
    def rotation(self) -> Callable[[Floats], Floats] | None:
        """Smoothed rotations (S, 3, 3) at times (S,), s; None without orientation."""
        if self.quaternion is None:
            return None
        spline = self.quaternion
        return lambda t: rotations.from_quaternion(spline(t))

    @property
    def intervals(self) -> int:
        """Pieces of the band that the stroke fills: its highest frequency is so many / (2 T)."""
        # Where intervals were halved, at a corner, it fills more.
        return self.position.finest if self.position.intervals else len(self.raw.t) - 1

    @property
    def smoothed_noise(self) -> float:
        """Noise that smoothing leaves in the positions, root mean square per axis, mm."""
        return self.position.smoothed_noise

    @property
    def smoothed_angular_noise(self) -> float:
        """Noise that smoothing leaves in the orientation, root mean square per axis, rad."""
        # A small turn about an axis is twice its component of the unit quaternion.
        return 0.0 if self.quaternion is None else 2.0 * self.quaternion.smoothed_noise


def preprocess(
    stroke: Trajectory,
    *,
    cutoff: float | None = None,
    trim: bool = True,
    start: float | None = None,
    until: float | None = None,
    cut_pauses: bool = False,
) -> Preprocessed:
    """Bring a recording to an even grid, cut it, and smooth it by its noise.

    Parameters
    ----------
    stroke : Trajectory
        As recorded.
    cutoff : float, optional
        Hz, instead of the one that follows from the noise.
    trim : bool
        Whether idle ends are cut off.
    start, until : float, optional
        s from the first sample; what lies before and after is cut off.
    cut_pauses : bool
        Whether rests inside the stroke are cut out.

    Returns
    -------
    Preprocessed

    Raises
    ------
    InputError
        The tool does not move, or fewer than ten samples are left.
    """
    _check_moves(stroke.position)
    began = float(stroke.t[0])
    stroke = _of(stroke, recording_gaps.inside(stroke.t, start, until))
    _check_moves(stroke.position)
    base = time_base.even(stroke)
    # Times from the recording's first sample; an averaged burst begins a little later.
    begin = base.origin - began
    whole = base.stroke
    sigma = noise.estimate(whole.position)
    found = segmentation.segment(whole, sigma)
    low = 0.0 if start is None else max(0.0, start - begin)
    high = whole.duration if until is None else min(whole.duration, until - begin)
    part = segmentation.cut(whole, low, high)
    asked = start is not None or until is not None
    strays = found
    if asked:
        _check_enough(part, start, until)
        _check_moves(part.position)
        # What was cut off as it was told is not told again.
        strays = segmentation.segment(part, sigma)
    # The offset of its first sample, which a cut on the grid may shift by less than a step.
    step = whole.duration / (len(whole.t) - 1)
    low = step * int(np.ceil(low / step - 0.5)) if asked else 0.0
    first, last = 0.0, part.duration
    if trim and part is whole:
        first, last = found.moving
    elif trim:
        inside = segmentation.moving_part(part, sigma)
        first, last = float(part.t[inside.start]), float(part.t[inside.stop - 1])
    pauses = tuple(
        (max(a - low, first), min(b - low, last))
        for a, b in found.pauses
        if b - low > first and a - low < last
    )
    raw = segmentation.cut(part, first, last, pauses if cut_pauses else ())
    _check_moves(raw.position)
    if raw is not whole:
        sigma = noise.estimate(raw.position)
    position = spline_smoothing.smooth(raw.position, raw.duration, sigma, cutoff, base.resampled)
    quaternion = None
    if raw.rotation is not None:
        q = continuous_quaternions(raw.rotation)
        quaternion = spline_smoothing.smooth(
            q, raw.duration, noise.estimate(q, held=True), cutoff, base.resampled
        )
    force = None
    if raw.contact_force is not None:
        f = raw.contact_force
        force = spline_smoothing.smooth(
            f, raw.duration, noise.estimate(f, held=True), cutoff, base.resampled
        )
    return Preprocessed(
        raw,
        position,
        quaternion,
        (first, part.duration - last),
        tuple((a - began, b - began) for a, b in base.gaps),
        tuple(_later(span, begin + low) for span in pauses),
        None if strays.approach is None else _later(strays.approach, begin + low),
        None if strays.retract is None else _later(strays.retract, begin + low),
        cut_pauses,
        base.merged,
        base.resampled,
        force,
    )


def _of(stroke: Trajectory, part: slice) -> Trajectory:
    if part == slice(0, len(stroke.t)):
        return stroke
    rotation, force = stroke.rotation, stroke.contact_force
    return Trajectory(
        stroke.t[part],
        stroke.position[part],
        None if rotation is None else rotation[part],
        contact_force=None if force is None else force[part],
    )


def _later(span: Span, by: float) -> Span:
    return span[0] + by, span[1] + by


def _check_moves(position: Floats) -> None:
    if len(position) < 2 or not np.any(np.ptp(position, axis=0) > 0.0):
        raise InputError("the tool does not move; record a stroke")


def _check_enough(part: Trajectory, start: float | None, until: float | None) -> None:
    if len(part.t) < FEWEST:
        span = " ".join(
            f"{word} {value:g} s"
            for word, value in (("from", start), ("until", until))
            if value is not None
        )
        raise InputError(f"{span}: {len(part.t)} samples are left, at least {FEWEST} are needed")

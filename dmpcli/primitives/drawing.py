"""Drawing a skill at many pairs of differing durations: charts, timing, roll-out."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.primitives.generalization import Amplitude, Orientation, Pairs, curves, roll_out
from dmpcli.primitives.retiming import Timing, timing
from dmpcli.primitives.skill import Skill
from dmpcli.surfaces.plane import pair_charts


@dataclass(frozen=True)
class Style:
    """How strokes are drawn.

    Attributes
    ----------
    rate : float
        Samples per second, Hz.
    amplitude, orientation
        See `roll_out`.
    ease_in, ease_out : float
        See `timing`, s.
    """

    rate: float = 50.0
    amplitude: Amplitude = "keep"
    orientation: Orientation = "keep"
    ease_in: float = 0.0
    ease_out: float = 0.0


@dataclass(frozen=True)
class Stroke:
    """One drawn stroke.

    Attributes
    ----------
    timing : Timing
        T samples.
    position : array, shape (T, 3)
        mm.
    euler : array, shape (T, 3), or None
        Unwrapped X-Y-Z Euler angles, rad.
    normal : array, shape (3,)
        Unit normal of its plane.
    """

    timing: Timing
    position: Floats
    euler: Floats | None
    normal: Floats


def draw(
    skill: Skill, pairs: Pairs, duration: Floats, normal: Floats, style: Style
) -> list[Stroke]:
    """Draw a skill at every pair; pairs of one duration are one matrix product.

    Parameters
    ----------
    skill : Skill
    pairs : Pairs
        B pairs that `admit` lets pass.
    duration : array, shape (B,)
        Of each stroke without easing, s.
    normal : array, shape (3,)
        See `pair_charts`.
    style : Style

    Returns
    -------
    list of Stroke
        In the order of the pairs.

    Raises
    ------
    InputError
        The skill's own numbers overflow.
    """
    strokes: list[Stroke | None] = [None] * len(pairs)
    for seconds in np.unique(duration):
        rows = np.flatnonzero(duration == seconds)
        some = pairs[rows]
        when = timing(
            float(seconds),
            style.rate,
            skill.duration,
            skill.spring.tau,
            style.ease_in,
            style.ease_out,
        )
        charts = pair_charts(some.start, some.goal, normal, skill.closed)
        with np.errstate(over="ignore", invalid="ignore"):
            drawn = roll_out(
                skill, curves(skill, when.stroke), some, charts, style.amplitude, style.orientation
            )
        if not np.isfinite(drawn.position).all():
            raise InputError("the skill's numbers give no finite stroke; fit it again")
        for i, row in enumerate(rows):
            euler = None if drawn.euler is None else drawn.euler[i]
            strokes[row] = Stroke(when, drawn.position[i], euler, drawn.normal[i])
    return [stroke for stroke in strokes if stroke is not None]

"""The time law that several demonstrations of one path have in common.

What is averaged is when each of them is at a place, not where each of them is at a time: so all are
slow in the mean where all were slow, at a corner for instance, and no demonstration has to run
faster there than n times its own speed.
"""

from collections.abc import Sequence

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.arc_length import TimeLaw, monotone
from dmpcli.dmp.path_registration import Correspondence
from dmpcli.dmp.pauses import step

# A rest that is left out takes the slowing down before it and the speeding up after it along, so
# far on each side, as a part of the length.
_BESIDE = 0.06
# Within this part of that nothing is left of it.
_WHOLLY = 0.4
# Nodes of the common law at least, and of each demonstration for a first guess at most, about.
_NODES = 400
_COARSE = 300
# Nodes nearer in time than this part of the whole are one.
_TINY = 1e-9


def running_on(law: TimeLaw, places: Sequence[float]) -> TimeLaw:
    """A law whose hand does not slow down at some places: with the speed it has beside them.

    Parameters
    ----------
    law : TimeLaw
    places : sequence of float
        Parts of the length, from 0 to 1.

    Returns
    -------
    Law
        Of the same places; its times are shorter where it was slow.
    """
    if not places:
        return law
    share = law.s / law.length
    steps = np.diff(law.t)
    speed = np.array(law.speed)
    for place in places:
        beside = np.clip([place - _BESIDE, place + _BESIDE], 0.0, 1.0)
        usual = float(np.mean(np.interp(beside, share, law.speed)))
        if usual <= 0.0:
            continue
        out = np.clip((np.abs(share - place) / _BESIDE - _WHOLLY) / (1.0 - _WHOLLY), 0.0, 1.0)
        near = 1.0 - step(out)
        middle = 0.5 * (near[:-1] + near[1:])
        steps = (1.0 - middle) * steps + middle * np.diff(law.s) / usual
        weight = (1.0 - near) * usual + near * speed
        speed = np.where(weight > 0.0, usual * speed / np.where(weight > 0.0, weight, 1.0), usual)
    return monotone(np.append(0.0, np.cumsum(steps)), law.s, speed)


def mean_law(
    laws: Sequence[TimeLaw], correspondences: Sequence[Correspondence], samples: int
) -> TimeLaw:
    """Place by time, in the mean.

    Parameters
    ----------
    laws : sequence of TimeLaw
        Arc length by time of each demonstration.
    correspondences : sequence of Correspondence
        Of each.
    samples : int
        Of the common grid; the law has as many nodes, or more.

    Returns
    -------
    Law
        From 0 to 1 (parts of the length), over the mean of the durations, s.
    """
    shares = [law.s[:: max(1, len(law.s) // _COARSE)] / law.length for law in laws]
    coarse = [c.inverse(share) for c, share in zip(correspondences, shares, strict=True)]
    places = np.unique(np.concatenate([*coarse, [0.0, 1.0]]))
    # A first guess is enough to have the nodes even in time, and dense where all are slow.
    about = [
        np.interp(law.length * c(places), law.s, law.t) / law.duration
        for law, c in zip(laws, correspondences, strict=True)
    ]
    even = np.linspace(0.0, 1.0, max(samples, _NODES))
    places = np.interp(even, np.mean(about, axis=0), places)
    when, slowness = _when(laws, correspondences, places)
    when[0], when[-1] = 0.0, 1.0
    rising = np.concatenate([[True], (np.diff(when) > _TINY) & (np.diff(places) > 0.0)])
    rising[-1] = True
    if rising.sum() > 2 and when[rising][-2] > 1.0 - _TINY:
        rising[np.flatnonzero(rising)[-2]] = False
    duration = float(np.mean([law.duration for law in laws]))
    speed = np.where(np.isfinite(slowness) & (slowness > 0.0), 1.0 / slowness, 0.0)
    return monotone(duration * when[rising], places[rising], speed[rising] / duration)


def _when(
    laws: Sequence[TimeLaw], correspondences: Sequence[Correspondence], places: Floats
) -> tuple[Floats, Floats]:
    """Mean share of the duration at which the demonstrations are at a place, and its derivative."""
    when, slowness = np.zeros_like(places), np.zeros_like(places)
    for law, correspondence in zip(laws, correspondences, strict=True):
        t = law.time(law.length * correspondence(places))
        _, speed = law.place(t)
        when += t / law.duration
        with np.errstate(divide="ignore"):
            slowness += law.length * correspondence.slope(places) / (speed * law.duration)
    return when / len(laws), slowness / len(laws)

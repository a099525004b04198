"""Strokes whose timing is their own: their speed is held, or they are split at a border."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from dmpcli.arrays import Integers
from dmpcli.dmp.drawn_strokes import DrawnBlock, GeneralizeOptions
from dmpcli.dmp.pieces import LEAST_LENGTH, Path, Span, inside, retimed
from dmpcli.dmp.skill import Skill
from dmpcli.dmp.time_scaling import Timing
from dmpcli.surfaces.surface import LEAVES, Status

# Samples of a path whose speed is to be held: per second of the demonstration, and at least.
_FINE, _LEAST_FINE = 50.0, 1201
_FINE_AT_ONCE = 300_000

Redraw = Callable[[Integers, Timing, GeneralizeOptions], DrawnBlock]
"""Draws some of the pairs, by their rows, with another timing and style."""


def applied(
    block: DrawnBlock, skill: Skill, style: GeneralizeOptions, redraw: Redraw
) -> Iterator[DrawnBlock]:
    """Draw strokes once more, each by its own timing, where the style asks for that.

    Parameters
    ----------
    block : DrawnBlock
        As drawn by the skill's timing.
    skill : Skill
    style : GeneralizeOptions
    redraw : callable

    Yields
    ------
    Block
        The given one, or one for each of its strokes; those that are refused are as they were.
    """
    if style.pace is None and style.on_border != "split":
        yield block
        return
    size = max(1, _FINE_AT_ONCE // _fine(skill)) if style.pace is not None else len(block)
    for first in range(0, len(block), size):
        some = block.some(np.arange(first, min(first + size, len(block))))
        for i, path in enumerate(_paths(some, skill, style, redraw)):
            one = some.some(np.array([i]))
            spans = _spans(one, style)
            left = bool(one.status[0] in LEAVES)
            if not spans or (style.pace is None and not left):
                yield one
            else:
                yield _again(one, spans, path, skill, style, redraw)


def _again(
    one: DrawnBlock,
    spans: list[Span],
    path: Path | None,
    skill: Skill,
    style: GeneralizeOptions,
    redraw: Redraw,
) -> DrawnBlock:
    when, tau = one.timing, skill.spring.tau
    eases = (style.ease_in, style.ease_out)
    stroke, cuts = retimed(spans, when.stroke, path, style.pace, style.rate, when.tau / tau, eases)
    t = np.arange(len(stroke)) / style.rate
    # Without a border in the way all of the time is the stroke's.
    own = tau * float(t[-1]) / skill.duration if spans == [_whole(when)] else when.tau
    again = redraw(one.rows, Timing(t, stroke, own), style)
    clear = not any(np.any(again.outside[0, a:b]) for a, b in cuts)
    if style.on_border == "split" and one.status[0] in LEAVES and clear:
        return replace(again, cuts=tuple(cuts))
    return again


def _whole(when: Timing) -> Span:
    return float(when.stroke[0]), float(when.stroke[-1])


def _spans(one: DrawnBlock, style: GeneralizeOptions) -> list[Span]:
    """Parts of a stroke that are drawn; none of one that is refused."""
    status = one.status[0]
    if status == Status.DRAWN:
        return [_whole(one.timing)]
    if status not in LEAVES or style.on_border not in ("clip", "split"):
        return []
    outside = np.broadcast_to(one.outside[0], one.position.shape[1:2])
    if style.on_border == "split":
        return inside(one.timing.stroke, one.position[0], outside, LEAST_LENGTH)
    return inside(one.timing.stroke, one.position[0], outside, 0.0)[:1] if not outside[0] else []


def _fine(skill: Skill) -> int:
    return max(_LEAST_FINE, 1 + round(_FINE * skill.duration))


def _paths(
    block: DrawnBlock, skill: Skill, style: GeneralizeOptions, redraw: Redraw
) -> list[Path | None]:
    """Strokes with their samples close together, where their speed is to be held."""
    if style.pace is None:
        return [None] * len(block)
    stroke = np.linspace(0.0, skill.duration, _fine(skill))
    bare = replace(style, keep_off=None, inclination=None)
    drawn = redraw(block.rows, Timing(stroke, stroke, skill.spring.tau), bare)
    return [Path(stroke, position) for position in drawn.position]

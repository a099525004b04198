"""Drawing a skill at many pairs of differing durations: charts, timing, roll-out."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.dmp import own_timing
from dmpcli.dmp.contact_heights import ContactHeights, pressed
from dmpcli.dmp.drawn_strokes import DrawnBlock, DrawnStroke, GeneralizeOptions
from dmpcli.dmp.rollout import Pairs, Trajectories, curves, roll_out
from dmpcli.dmp.sides import taught_side, turned_over
from dmpcli.dmp.skill import Skill
from dmpcli.dmp.time_scaling import Timing, timing
from dmpcli.errors import InputError
from dmpcli.surfaces.plane import Plane, pair_charts
from dmpcli.surfaces.surface import Charts, Status, Surface


def draw(
    skill: Skill, pairs: Pairs, duration: Floats, surface: Surface | None, style: GeneralizeOptions
) -> list[DrawnStroke]:
    """Draw a skill at every pair.

    Parameters
    ----------
    skill, pairs, duration, surface, style
        As in `draw_blocks`.

    Returns
    -------
    list of Stroke
        In the order of the pairs.

    Raises
    ------
    InputError
        The skill's own numbers overflow.
    """
    strokes: list[DrawnStroke] = [None] * len(pairs)  # type: ignore[list-item]
    for block in draw_blocks(skill, pairs, duration, surface, style):
        for i, row in enumerate(block.rows):
            strokes[row] = block.stroke(i)
    return strokes


def draw_blocks(
    skill: Skill, pairs: Pairs, duration: Floats, surface: Surface | None, style: GeneralizeOptions
) -> Iterator[DrawnBlock]:
    """Draw a skill at every pair; pairs of one duration are drawn together.

    Parameters
    ----------
    skill : Skill
    pairs : Pairs
        B pairs that `admit` lets pass.
    duration : array, shape (B,)
        Of each stroke without easing, s.
    surface : Surface or None
        What to draw on; a plane's normal is on the tool's side. Without one each pair has its own
        plane, parallel to the demonstration's.
    style : GeneralizeOptions

    Yields
    ------
    Block
        By rising duration.

    Raises
    ------
    InputError
        The skill's own numbers overflow.
    """
    if style.compiled:
        from dmpcli.surfaces.mesh import Mesh

        surface = surface.with_kernels if isinstance(surface, Mesh) else surface
    over = turned_over(skill, pairs, surface)
    for seconds in np.unique(duration):
        when = timing(
            float(seconds),
            style.rate,
            skill.duration,
            skill.spring.tau,
            style.ease_in,
            style.ease_out,
        )
        for other in np.unique(over[duration == seconds]):
            rows = np.flatnonzero((duration == seconds) & (over == other))
            seen = skill.turned_over() if other else skill
            heights = style.heights_over if other else style.heights
            yield from own_timing.applied(
                _drawn(seen, rows, pairs[rows], when, surface, style, heights),
                seen,
                style,
                _redraw(seen, pairs, surface, heights),
            )


def _redraw(
    skill: Skill, pairs: Pairs, surface: Surface | None, heights: ContactHeights | None
) -> own_timing.Redraw:
    def redraw(rows: Integers, when: Timing, style: GeneralizeOptions) -> DrawnBlock:
        return _drawn(skill, rows, pairs[rows], when, surface, style, heights)

    return redraw


def seen_from(
    skill: Skill, style: GeneralizeOptions, pairs: Pairs, surface: Surface | None
) -> tuple[Skill, ContactHeights | None]:
    """Return a skill and its heights as the pairs see them: turned over where all of them do.

    Parameters
    ----------
    skill : Skill
    style : GeneralizeOptions
        Has the heights of either side.
    pairs : Pairs
        In the base frame.
    surface : Surface or None
        Without one no pair sees a skill turned over.
    """
    over = turned_over(skill, pairs, surface)
    if len(over) and over.all():
        return skill.turned_over(), style.heights_over
    return skill, style.heights


def _drawn(
    skill: Skill,
    rows: Integers,
    pairs: Pairs,
    when: Timing,
    surface: Surface | None,
    style: GeneralizeOptions,
    heights: ContactHeights | None,
) -> DrawnBlock:
    charts = None if skill.model == "original" else charts_of(skill, pairs, surface, style.turn)
    shared = curves(skill, when.stroke, heights)
    with np.errstate(over="ignore", invalid="ignore"):
        drawn = roll_out(
            skill,
            shared,
            pairs,
            charts,
            style.amplitude,
            style.orientation if style.inclination is None else "surface",
            style.size,
            style.inclination,
            style.compiled,
        )
    lift, count = drawn.lift, len(pairs)
    asked: float | Floats | None = style.force
    if asked is None:
        asked = skill.taught_force(when.stroke)
        if asked is not None and heights is not None and heights.offset > 0.0:
            asked = 0.0  # nothing presses at a stand-off
    force = pressed(shared[4], asked, heights)
    if not _finite(drawn):
        raise InputError("the skill's numbers give no finite stroke; fit it again")
    if lift is not None:
        outside, status = lift.outside, lift.status
        if style.on_border == "split" and lift.unsound is not None:
            outside = outside | lift.unsound
        if style.keep_off is not None:
            outside, status = style.keep_off.marked(drawn.position, outside, status)
        return DrawnBlock(
            rows,
            when,
            drawn.position,
            drawn.euler,
            lift.normal,
            status,
            outside,
            lift.unfolded,
            force=force,
        )
    flat = surface is None or isinstance(surface, Plane)
    normal = surface.normal if isinstance(surface, Plane) else skill.frame.normal
    none = np.zeros(count, dtype=bool)
    return DrawnBlock(
        rows,
        when,
        drawn.position,
        drawn.euler,
        np.broadcast_to(normal, (count, 1, 3)) if flat else None,
        np.full(count, Status.DRAWN),
        none[:, None],
        none,
        force=force,
    )


def _finite(drawn: Trajectories) -> bool:
    """Tell whether all positions are finite, but for those of strokes that cannot be drawn."""
    with np.errstate(over="ignore", invalid="ignore"):
        # A sum of finite numbers of this size is finite: one pass, and no array of answers.
        if np.isfinite(drawn.position.sum()):
            return True
    finite = np.isfinite(drawn.position).all(axis=(1, 2))
    lift = drawn.lift
    return bool((finite if lift is None else finite | (lift.status != Status.DRAWN)).all())


def charts_of(skill: Skill, pairs: Pairs, surface: Surface | None, turn: float = 0.0) -> Charts:
    """Charts that a skill is drawn in at these pairs; see `draw`.

    Parameters
    ----------
    skill, pairs, surface
        As in `draw_blocks`.
    turn : float
        Of a closed stroke's axes about the normal, rad.
    """
    if surface is None:
        charts = pair_charts(pairs.start, pairs.goal, skill.frame.normal, skill.closed)
        if skill.closed and turn:
            charts = replace(charts, axes=charts.axes @ _about_normal(turn))
        return charts
    closed = skill.frame.axes @ _about_normal(turn) if skill.closed else None
    if isinstance(surface, Plane):
        side: Floats | None = surface.normal
    elif pairs.start_rotation is not None:
        side = -pairs.start_rotation[..., 2]
    else:
        side = taught_side(skill, surface, pairs.start)
    return surface.charts(pairs.start, pairs.goal, side, closed)


def _about_normal(turn: float) -> Floats:
    """Rotation about a chart's third axis; exactly none for no turn."""
    c, s = (1.0, 0.0) if turn == 0.0 else (np.cos(turn), np.sin(turn))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

"""Drawing a skill at many pairs of differing durations: charts, timing, roll-out."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.errors import InputError
from dmpcli.primitives import own_timing
from dmpcli.primitives.choices import Amplitude, OnBorder, Orientation
from dmpcli.primitives.contact_heights import ContactHeights
from dmpcli.primitives.generalization import (
    Pairs,
    Trajectories,
    curves,
    roll_out,
)
from dmpcli.primitives.inclination import Inclination
from dmpcli.primitives.retiming import Timing, timing
from dmpcli.primitives.sides import taught_side, turned_over
from dmpcli.primitives.skill import Skill
from dmpcli.primitives.tool_speed import Pace
from dmpcli.surfaces.keep_off import KeepOff
from dmpcli.surfaces.plane import Plane, pair_charts
from dmpcli.surfaces.protocol import Charts, Status, Surface


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
    heights, heights_over : ContactHeights or None
        What is drawn of w over a named surface; of a skill whose side was guessed, also seen from
        the other side.
    size : float
        Of closed strokes, beside the demonstrated one.
    turn : float
        Of closed strokes about the normal at their start, rad.
    allow_stretch : bool
        Whether start and goal may lie at any distance, however it distorts the stroke.
    inclination : Inclination or None
        How the tool leans, from the surface's normal; it then turns with the surface.
    pace : Pace or None
        How fast the tool goes along the path; None keeps the skill's own timing.
    keep_off : KeepOff or None
        Where on the surface no stroke may be.
    on_border : {'fail', 'clip', 'skip', 'split'}
        What becomes of a stroke that leaves the surface, or comes where it may not be.
    """

    rate: float = 50.0
    amplitude: Amplitude = "keep"
    orientation: Orientation = "keep"
    ease_in: float = 0.0
    ease_out: float = 0.0
    heights: ContactHeights | None = None
    heights_over: ContactHeights | None = None
    size: float = 1.0
    turn: float = 0.0
    allow_stretch: bool = False
    inclination: Inclination | None = None
    pace: Pace | None = None
    keep_off: KeepOff | None = None
    on_border: OnBorder = "fail"


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
    normal : array, shape (1 or T, 3), or None
        Unit normals: one for a plane, else one per sample; None for the original model on a
        curved surface, which it does not know.
    status : Status
        Whether it could be drawn; positions mean nothing where it could not.
    outside : array of bool, shape (1 or T,)
        Samples beyond the surface's border.
    unfolded : bool
        Whether it crosses a sharp crease, where a tool cannot follow the surface.
    cuts : tuple of (int, int)
        Of a stroke that is split: where each piece begins, and where what follows it begins.
    """

    timing: Timing
    position: Floats
    euler: Floats | None
    normal: Floats | None
    status: Status
    outside: Booleans
    unfolded: bool
    cuts: tuple[tuple[int, int], ...] = ()

    def above(self, goal: Floats, height: float) -> Floats:
        """Return the point (3,) at a height over the goal, along the last normal, mm."""
        if self.normal is None or height == 0.0:
            return goal
        return np.asarray(goal + height * self.normal[-1])

    def until_border(self) -> "Stroke":
        """Return the part before the first sample beyond the border; at least one sample."""
        inside = np.broadcast_to(~self.outside, len(self.position))
        count = max(1, int(np.argmin(inside)) if not inside.all() else len(inside))
        return self._part(0, count)

    def pieces(self) -> list["Stroke"]:
        """Return the pieces of a stroke that is split, each from its own t = 0 on."""
        found = []
        for first, end in self.cuts:
            piece = self._part(first, end)
            t = self.timing.t[: end - first]
            found.append(replace(piece, timing=replace(piece.timing, t=t)))
        return found

    def _part(self, first: int, end: int) -> "Stroke":
        t = replace(self.timing, t=self.timing.t[first:end], stroke=self.timing.stroke[first:end])
        euler = None if self.euler is None else self.euler[first:end]
        normal, outside = self.normal, self.outside
        if normal is not None and len(normal) > 1:
            normal = normal[first:end]
        if len(outside) > 1:
            outside = outside[first:end]
        return Stroke(t, self.position[first:end], euler, normal, Status.DRAWN, outside, False)


@dataclass(frozen=True)
class Block:
    """Strokes of one duration, drawn together.

    Attributes
    ----------
    rows : array of int, shape (B,)
        Which of the pairs they belong to.
    timing : Timing
        T samples.
    position : array, shape (B, T, 3)
        mm.
    euler : array, shape (B, T, 3), or None
        Unwrapped X-Y-Z Euler angles, rad.
    normal : array, shape (B, 1 or T, 3), or None
        As in `Stroke`.
    status : array of int, shape (B,)
        `Status`.
    outside : array of bool, shape (B, 1 or T)
    unfolded : array of bool, shape (B,)
    cuts : tuple of (int, int)
        Of all its strokes; see `Stroke`.
    """

    rows: Integers
    timing: Timing
    position: Floats
    euler: Floats | None
    normal: Floats | None
    status: Integers
    outside: Booleans
    unfolded: Booleans
    cuts: tuple[tuple[int, int], ...] = ()

    def __len__(self) -> int:
        return len(self.rows)

    def stroke(self, i: int) -> Stroke:
        """Return the stroke of the i-th row."""
        return Stroke(
            self.timing,
            self.position[i],
            None if self.euler is None else self.euler[i],
            None if self.normal is None else self.normal[i],
            Status(self.status[i]),
            self.outside[i],
            bool(self.unfolded[i]),
            self.cuts,
        )

    def some(self, of: Integers) -> "Block":
        """Return some of the strokes."""
        return replace(
            self,
            rows=self.rows[of],
            position=self.position[of],
            euler=None if self.euler is None else self.euler[of],
            normal=None if self.normal is None else self.normal[of],
            status=self.status[of],
            outside=self.outside[of],
            unfolded=self.unfolded[of],
        )


def draw(
    skill: Skill, pairs: Pairs, duration: Floats, surface: Surface | None, style: Style
) -> list[Stroke]:
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
    strokes: list[Stroke] = [None] * len(pairs)  # type: ignore[list-item]
    for block in draw_blocks(skill, pairs, duration, surface, style):
        for i, row in enumerate(block.rows):
            strokes[row] = block.stroke(i)
    return strokes


def draw_blocks(
    skill: Skill, pairs: Pairs, duration: Floats, surface: Surface | None, style: Style
) -> Iterator[Block]:
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
    style : Style

    Yields
    ------
    Block
        By rising duration.

    Raises
    ------
    InputError
        The skill's own numbers overflow.
    """
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
    def redraw(rows: Integers, when: Timing, style: Style) -> Block:
        return _drawn(skill, rows, pairs[rows], when, surface, style, heights)

    return redraw


def seen_from(
    skill: Skill, style: Style, pairs: Pairs, surface: Surface | None
) -> tuple[Skill, ContactHeights | None]:
    """Return a skill and its heights as the pairs see them: turned over where all of them do."""
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
    style: Style,
    heights: ContactHeights | None,
) -> Block:
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
        )
    lift, count = drawn.lift, len(pairs)
    if not _finite(drawn):
        raise InputError("the skill's numbers give no finite stroke; fit it again")
    if lift is not None:
        outside, status = lift.outside, lift.status
        if style.on_border == "split" and lift.unsound is not None:
            outside = outside | lift.unsound
        if style.keep_off is not None:
            outside, status = style.keep_off.marked(drawn.position, outside, status)
        return Block(
            rows, when, drawn.position, drawn.euler, lift.normal, status, outside, lift.unfolded
        )
    flat = surface is None or isinstance(surface, Plane)
    normal = surface.normal if isinstance(surface, Plane) else skill.frame.normal
    none = np.zeros(count, dtype=bool)
    return Block(
        rows,
        when,
        drawn.position,
        drawn.euler,
        np.broadcast_to(normal, (count, 1, 3)) if flat else None,
        np.full(count, Status.DRAWN),
        none[:, None],
        none,
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

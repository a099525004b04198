"""Strokes as drawn, one or many together, and how they are to be drawn."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.dmp.contact_heights import ContactHeights
from dmpcli.dmp.inclination import Inclination
from dmpcli.dmp.options import Amplitude, Orientation
from dmpcli.dmp.time_scaling import Timing
from dmpcli.dmp.tool_speed import Pace
from dmpcli.surfaces.keep_off import KeepOff
from dmpcli.surfaces.surface import Status

OnBorder = Literal["fail", "clip", "skip", "split"]


@dataclass(frozen=True)
class GeneralizeOptions:
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
    force : float or None
        With which the tool shall press along the normal where it is in contact, N.
    compiled : bool
        Whether by compiled kernels: quicker, and the same but for rounding.
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
    force: float | None = None
    compiled: bool = False


@dataclass(frozen=True)
class DrawnStroke:
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
    force : array, shape (T,), or None
        Set-point of the force along the normal, N, 0 where the tool is lifted; None asks for none.
    """

    timing: Timing
    position: Floats
    euler: Floats | None
    normal: Floats | None
    status: Status
    outside: Booleans
    unfolded: bool
    cuts: tuple[tuple[int, int], ...] = ()
    force: Floats | None = None

    def above(self, goal: Floats, height: float) -> Floats:
        """Return the point (3,) at a height over the goal, along the last normal, mm."""
        if self.normal is None or height == 0.0:
            return goal
        return np.asarray(goal + height * self.normal[-1])

    def until_border(self) -> "DrawnStroke":
        """Return the part before the first sample beyond the border; at least one sample."""
        inside = np.broadcast_to(~self.outside, len(self.position))
        count = max(1, int(np.argmin(inside)) if not inside.all() else len(inside))
        return self._part(0, count)

    def pieces(self) -> list["DrawnStroke"]:
        """Return the pieces of a stroke that is split, each from its own t = 0 on."""
        found = []
        for first, end in self.cuts:
            piece = self._part(first, end)
            t = self.timing.t[: end - first]
            found.append(replace(piece, timing=replace(piece.timing, t=t)))
        return found

    def _part(self, first: int, end: int) -> "DrawnStroke":
        t = replace(self.timing, t=self.timing.t[first:end], stroke=self.timing.stroke[first:end])
        euler = None if self.euler is None else self.euler[first:end]
        normal, outside = self.normal, self.outside
        if normal is not None and len(normal) > 1:
            normal = normal[first:end]
        if len(outside) > 1:
            outside = outside[first:end]
        force = None if self.force is None else self.force[first:end]
        made = DrawnStroke(t, self.position[first:end], euler, normal, Status.DRAWN, outside, False)
        return replace(made, force=force)


@dataclass(frozen=True)
class DrawnBlock:
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
        As in `DrawnStroke`.
    status : array of int, shape (B,)
        `Status`.
    outside : array of bool, shape (B, 1 or T)
    unfolded : array of bool, shape (B,)
    cuts : tuple of (int, int)
        Of all its strokes; see `DrawnStroke`.
    force : array, shape (T,), or None
        Of all its strokes: w is the same at every pair.
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
    force: Floats | None = None

    def __len__(self) -> int:
        return len(self.rows)

    def stroke(self, i: int) -> DrawnStroke:
        """Return the stroke of the i-th row."""
        return DrawnStroke(
            self.timing,
            self.position[i],
            None if self.euler is None else self.euler[i],
            None if self.normal is None else self.normal[i],
            Status(self.status[i]),
            self.outside[i],
            bool(self.unfolded[i]),
            self.cuts,
            self.force,
        )

    def some(self, of: Integers) -> "DrawnBlock":
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

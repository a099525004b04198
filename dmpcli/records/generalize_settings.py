"""The settings of ``generalize``, with the ranges that make sense."""

import math
from typing import Annotated

from pydantic import Field

from dmpcli.primitives.drawn_strokes import Style
from dmpcli.primitives.generalization import Amplitude, Orientation
from dmpcli.records.process_settings import ProcessSettings

NotNegative = Annotated[float, Field(ge=0, le=86_400)]


class GeneralizeSettings(ProcessSettings):
    """How to draw a skill at new pairs; what a process asks for beside is in `ProcessSettings`.

    Attributes
    ----------
    duration : float or None
        Of the stroke without easing, s; None takes the demonstration's.
    rate : float
        Samples per second, Hz.
    amplitude, orientation
        See `roll_out`.
    ease_in, ease_out : float
        Soft start and end, s.
    snap_tol : float
        How far start and goal may lie off the given surface, mm.
    contact : float or None
        How near to a named surface the pen touches, mm; see `contact_heights`.
    offset : float
        Shift off a named surface, mm.
    scale, turn : float
        Of closed strokes: size beside the demonstrated one, and angle about the normal, degrees.
    allow_stretch : bool
        Whether start and goal may lie at any distance, however it distorts the stroke.
    """

    duration: Annotated[float, Field(ge=0.001, le=86_400)] | None = None
    rate: Annotated[float, Field(ge=0.001, le=10_000)] = 50.0
    amplitude: Amplitude = "keep"
    orientation: Orientation = "keep"
    ease_in: NotNegative = 0.0
    ease_out: NotNegative = 0.0
    snap_tol: NotNegative = 1.0
    contact: NotNegative | None = None
    offset: Annotated[float, Field(ge=-1000, le=1000)] = 0.0
    scale: Annotated[float, Field(ge=0.001, le=1000)] = 1.0
    turn: Annotated[float, Field(ge=-360, le=360)] = 0.0
    allow_stretch: bool = False

    def style(self) -> Style:
        """Return the settings as the mathematics takes them; heights are for the skill to tell."""
        return Style(
            self.rate,
            self.amplitude,
            self.orientation,
            self.ease_in,
            self.ease_out,
            size=self.scale,
            turn=math.radians(self.turn),
            allow_stretch=self.allow_stretch,
        )

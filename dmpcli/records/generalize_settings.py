"""The settings of ``generalize``, with the ranges that make sense."""

from typing import Annotated

from pydantic import Field

from dmpcli.primitives.drawing import Style
from dmpcli.primitives.generalization import Amplitude, Orientation
from dmpcli.records.settings import Settings

NotNegative = Annotated[float, Field(ge=0, le=86_400)]


class GeneralizeSettings(Settings):
    """How to draw a skill at new pairs.

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
    """

    duration: Annotated[float, Field(ge=0.001, le=86_400)] | None = None
    rate: Annotated[float, Field(ge=0.001, le=10_000)] = 50.0
    amplitude: Amplitude = "keep"
    orientation: Orientation = "keep"
    ease_in: NotNegative = 0.0
    ease_out: NotNegative = 0.0
    snap_tol: NotNegative = 1.0

    def style(self) -> Style:
        """Return the settings as the mathematics takes them."""
        return Style(self.rate, self.amplitude, self.orientation, self.ease_in, self.ease_out)

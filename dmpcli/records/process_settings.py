"""The part of ``generalize``'s settings that says how the process wants its tool."""

import math
from typing import Annotated, Any

from pydantic import Field

from dmpcli.primitives.inclination import Inclination
from dmpcli.primitives.tool_speed import ACCELERATION, Pace
from dmpcli.records.settings import Settings

Leaning = Annotated[float, Field(ge=-80, le=80)]
Positive = Annotated[float, Field(ge=1e-3, le=1e6)]


class ProcessSettings(Settings):
    """What a process asks of its strokes; None, where it does not.

    Attributes
    ----------
    lead, tilt : float or None
        See `Inclination`, degrees.
    border_margin : float or None
        Between stroke and border, along the surface, mm.
    copies : int or None
        Of each stroke, side by side.
    spacing : float or None
        Of neighbouring copies, along v, mm.
    tool_speed, tool_acceleration : float or None
        See `Pace`, mm/s and mm/s².
    """

    lead: Leaning | None = None
    tilt: Leaning | None = None
    border_margin: Annotated[float, Field(gt=0, le=1e5)] | None = None
    copies: Annotated[int, Field(ge=1, le=10_000)] | None = None
    spacing: Annotated[float, Field(ge=-1e5, le=1e5)] | None = None
    tool_speed: Positive | None = None
    tool_acceleration: Positive | None = None

    @property
    def inclination(self) -> Inclination | None:
        """How the tool leans; None leaves it as the skill has it."""
        if self.lead is None and self.tilt is None:
            return None
        return Inclination(math.radians(self.lead or 0.0), math.radians(self.tilt or 0.0))

    @property
    def pace(self) -> Pace | None:
        """How fast the tool goes; None keeps the skill's own timing."""
        if self.tool_speed is None:
            return None
        return Pace(self.tool_speed, self.tool_acceleration or ACCELERATION)

    @classmethod
    def asked(cls, options: dict[str, Any]) -> dict[str, Any]:
        """Return options without those of the process that nobody asked for."""
        ours = set(ProcessSettings.model_fields)
        return {k: v for k, v in options.items() if v is not None or k not in ours}

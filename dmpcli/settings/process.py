"""The part of ``generalize``'s settings that says how the process wants its tool."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from annotated_types import Ge, Gt, Le

from dmpcli.dmp.options import ACCELERATION
from dmpcli.settings.model import Option, Settings, settings_of

if TYPE_CHECKING:
    from dmpcli.dmp.inclination import Inclination
    from dmpcli.dmp.tool_speed import Pace

Leaning = Annotated[float, Ge(-80), Le(80)]
Positive = Annotated[float, Ge(1e-3), Le(1e6)]


@dataclass(frozen=True, kw_only=True)
class ProcessSettings(Settings):
    """What a process asks of its strokes; None, where it does not.

    Of the leaning see `Inclination`, of speed and acceleration `Pace`.
    """

    lead: Annotated[
        Leaning | None,
        Option("Lean the tool off the normal, forward along its travel.", "°", unset="as taught"),
    ] = None
    tilt: Annotated[
        Leaning | None,
        Option("Lean the tool off the normal, across the stroke: to +v.", "°", unset="as taught"),
    ] = None
    border_margin: Annotated[
        float | None,
        Gt(0),
        Le(1e5),
        Option("How far off a mesh's border a stroke must stay, along it.", "mm", unset="none"),
    ] = None
    copies: Annotated[
        int | None, Ge(1), Le(10_000), Option("Draw each stroke N times, side by side.", unset="1")
    ] = None
    spacing: Annotated[
        float | None,
        Ge(-1e5),
        Le(1e5),
        Option("Of copies, along v; negative to the other side.", "mm", unset="no copies"),
    ] = None
    tool_speed: Annotated[
        Positive | None,
        Option("Constant along the path, but for ends and corners.", "mm/s", unset="as taught"),
    ] = None
    tool_acceleration: Annotated[
        Positive | None,
        Option("At the ends and in corners at most.", "mm/s²", unset=f"{ACCELERATION:g}"),
    ] = None

    event: Annotated[
        tuple[str, ...] | None,
        Option(
            "Switch an output along the path, again for each; off@..., start, end, lift, touch.",
            metavar="on@12.5mm:DO1",
            unset="none",
        ),
    ] = None

    @property
    def inclination(self) -> "Inclination | None":
        """How the tool leans; None leaves it as the skill has it."""
        from dmpcli.dmp.inclination import Inclination

        if self.lead is None and self.tilt is None:
            return None
        return Inclination(math.radians(self.lead or 0.0), math.radians(self.tilt or 0.0))

    @property
    def pace(self) -> "Pace | None":
        """How fast the tool goes; None keeps the skill's own timing."""
        from dmpcli.dmp.tool_speed import Pace

        if self.tool_speed is None:
            return None
        return Pace(self.tool_speed, self.tool_acceleration or ACCELERATION)

    def as_options(self) -> dict[str, Any]:
        """Return the settings as JSON values, without those of the process that nobody asked."""
        ours = {one.name for one in settings_of(ProcessSettings)}
        return {k: v for k, v in super().as_options().items() if v is not None or k not in ours}

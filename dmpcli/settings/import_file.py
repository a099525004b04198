"""The options of ``import`` beside those of recordings."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Gt, Le

from dmpcli.settings.model import Option, Settings

KINDS = ("table", "svg", "gcode", "urscript", "krl", "rapid", "mcap", "ros2", "lerobot")


@dataclass(frozen=True, kw_only=True)
class ImportOptions(Settings):
    """How drawings and programs become recordings."""

    format: Annotated[
        str | None, Option("What the files are.", choices=KINDS, unset="by content and suffix")
    ] = None
    speed: Annotated[float, Gt(0), Le(2000), Option("Of a drawing's pen.", "mm/s")] = 50.0
    lift: Annotated[
        float, Ge(0), Le(1000), Option("Of the pen between a drawing's paths.", "mm")
    ] = 5.0
    tolerance: Annotated[
        float, Gt(0), Le(10), Option("How far chords may lie off curves and arcs.", "mm")
    ] = 0.05
    rate: Annotated[
        float, Gt(0), Le(10_000), Option("Samples per second of a drawing or program.", "Hz")
    ] = 100.0
    travel_speed: Annotated[
        float, Gt(0), Le(10_000), Option("Of G-code's rapid moves.", "mm/s")
    ] = 50.0

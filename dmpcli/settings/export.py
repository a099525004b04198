"""The options of ``export``."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from annotated_types import Ge, Gt, Le

from dmpcli.settings.model import Option, Settings

WORDS = (
    "csv",
    "tum",
    "joints",
    "ply",
    "obj",
    "gcode",
    "urscript",
    "krl",
    "rapid",
    "mcap",
    "ros2",
    "lerobot",
)


@dataclass(frozen=True, kw_only=True)
class ExportOptions(Settings):
    """What to write of a file, and how a program shall move."""

    format: Annotated[
        str | None, Option("What to write.", choices=WORDS, unset="by the suffix of -o")
    ] = None
    id: Annotated[
        str | None,
        Option("Only this stroke, where a file holds several.", metavar="NAME", unset="all"),
    ] = None
    orientation: Annotated[
        tuple[float, float, float] | None,
        Option("Of the tool, rad, where the file says none.", metavar="RX RY RZ", unset="none"),
    ] = None
    rate: Annotated[
        float | None,
        Gt(0),
        Le(10_000),
        Option("Samples per second, in even times.", "Hz", unset="as in the file"),
    ] = None
    thin: Annotated[
        float, Ge(0), Le(10), Option("Programs: leave out samples within so much.", "mm")
    ] = 0.005
    blend: Annotated[
        float, Ge(0), Le(100), Option("Programs: radius of rounded corners, at most.", "mm")
    ] = 1.0
    lift: Annotated[
        float, Ge(0), Le(1000), Option("Programs: off the work before and after a stroke.", "mm")
    ] = 20.0
    travel_speed: Annotated[
        float, Gt(0), Le(2000), Option("Programs: on the way to and from it.", "mm/s")
    ] = 50.0
    acceleration: Annotated[float, Gt(0), Le(100_000), Option("Programs.", "mm/s²")] = 1000.0
    lines: Annotated[int, Ge(10), Le(100_000), Option("Programs: most lines in one routine.")] = (
        1000
    )
    tilt: Annotated[
        float, Ge(0), Le(180), Option("G-code: how far the tool may lean from straight down.", "°")
    ] = 5.0
    robot_model: Annotated[
        str | None,
        Option("Arm of joint angles: ec66, ur5e.", choices=("ec66", "ur5e"), unset="none"),
    ] = None
    tool: Annotated[
        Path | None,
        Option("Tool file: where the TCP is on the flange, and its weight.", unset="none"),
    ] = None
    task: Annotated[
        str | None, Option("LeRobot: what is done, in words.", unset="by the file's kind")
    ] = None

"""Options that several commands have, and checks of values that need no settings model."""

from typing import Annotated

import typer

from dmpcli.settings.options import choice
from dmpcli.settings.recording import LENGTHS

Point = tuple[float, float, float]

ROBOTS = "mock:, elite://HOST, ur://HOST, ..."
SENSORS = "mock:, netft://HOST, ...; see docs/drivers.md."

SURFACES = "plane.json, cylinder.json, sphere.json, or an STL, OBJ, PLY or OFF"

Robot = Annotated[
    str, typer.Option("--robot", metavar="URL", help=f"The arm: {ROBOTS}; see docs/drivers.md.")
]
Sensor = Annotated[
    str, typer.Option("--sensor", metavar="URL", help=f"The force sensor: {SENSORS}")
]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="No messages.")]
Realtime = Annotated[bool, typer.Option("--realtime", help="Pace the mock by the real clock.")]
AllowMixed = Annotated[
    bool, typer.Option("--allow-mixed", help="Let a real instrument stand beside a mock one.")
]
SurfacePose = Annotated[
    str | None,
    typer.Option(
        metavar="X Y Z RX RY RZ|FILE",
        help="Where the surface's own frame lies in the base frame, mm and rad.",
    ),
]
SurfaceUnit = Annotated[
    str | None,
    typer.Option(
        metavar="|".join(LENGTHS),
        help="Unit of a mesh file.  [default: mm]",
        autocompletion=choice(*LENGTHS),
    ),
]

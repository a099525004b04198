"""Options that several commands have, and checks of values that need no settings model."""

import math
from collections.abc import Sequence
from typing import Annotated

import typer

from dmpcli.errors import InputError
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


def within(option: str, values: Sequence[float], largest: float) -> None:
    """Refuse NaN and infinity, which the option parser lets pass, and numbers beyond all sense.

    Raises
    ------
    InputError
        Names the option and the value.
    """
    for value in values:
        if not math.isfinite(value):
            raise InputError(f"{option}: {value} is not a finite number")
        if abs(value) > largest:
            raise InputError(f"{option}: {value:g} is beyond {largest:g}; check its unit")

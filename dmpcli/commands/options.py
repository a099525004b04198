"""Options that several commands have, and checks of values that need no settings model."""

from collections.abc import Callable
from typing import Annotated

import typer

from dmpcli.settings.options import choice
from dmpcli.settings.recording import LENGTHS

Point = tuple[float, float, float]

ROBOTS = "mock:, elite://HOST, ur://HOST, ..."
SENSORS = "mock:, netft://HOST, ...; see docs/drivers.md."

SURFACES = "plane.json, cylinder.json, sphere.json, or an STL, OBJ, PLY or OFF"

ARMS = ("ec66", "ur5e")
"""Whose joints can be checked; `dmpcli.kinematics.models` has them."""


def urls(role: str) -> Callable[[str], list[str]]:
    """Return what completes the URL of an instrument: the schemes that have a driver here."""

    def complete(incomplete: str) -> list[str]:
        from dmpcli.instruments import registry

        return choice("mock:", *(f"{one}://" for one in registry.schemes(role)))(incomplete)

    return complete


Robot = Annotated[
    str,
    typer.Option(
        "--robot",
        metavar="URL",
        help=f"The arm: {ROBOTS}; see docs/drivers.md.",
        autocompletion=urls("robot"),
    ),
]
Sensor = Annotated[
    str,
    typer.Option(
        "--sensor",
        metavar="URL",
        help=f"The force sensor: {SENSORS}",
        autocompletion=urls("sensor"),
    ),
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

"""Options that several commands have."""

from pathlib import Path
from typing import Annotated

import typer

Point = tuple[float, float, float]
Box = tuple[float, float, float, float, float, float]

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
Workspace = Annotated[
    Box | None, typer.Option(metavar="XMIN XMAX YMIN YMAX ZMIN ZMAX", help="Box to stay in, mm.")
]
FollowingError = Annotated[
    float | None, typer.Option(metavar="MM", help="Stop when the arm strays further.")
]
MaxForce = Annotated[
    float | None, typer.Option(metavar="N", help="Stop at a larger force on the tool.")
]
MaxTorque = Annotated[
    float | None, typer.Option(metavar="N_M", help="Stop at a larger torque about its tip.")
]
Period = Annotated[float | None, typer.Option(metavar="S", help="Servo period, 0.02 s by default.")]
Config = Annotated[
    Path | None, typer.Option(metavar="FILE.toml", help="Its section beats the preset's.")
]
ToolCheck = Annotated[
    float | None,
    typer.Option(metavar="N", help="What the tool file may miss of the reading at rest (1.5)."),
]
DrawnEnd = Annotated[Point | None, typer.Option(metavar="X Y Z", help="Of it, mm.")]
WaveHeight = Annotated[float | None, typer.Option(help="Of the sine, peak to trough, mm.")]
Periods = Annotated[float | None, typer.Option(help="Of the sine.")]
SurfacePose = Annotated[
    str | None,
    typer.Option(
        metavar="X Y Z RX RY RZ|pose.json",
        help="Where the surface's own frame lies in the base frame, mm and rad.",
    ),
]
SurfaceUnit = Annotated[
    str | None, typer.Option(help="Unit of a mesh file: mm (default), cm, m or in.")
]

"""Options of ``generalize`` that say what a process asks of its tool."""

from pathlib import Path
from typing import Annotated

import typer

Lead = Annotated[
    float | None,
    typer.Option(metavar="DEG", help="Lean the tool off the normal, forward along its travel."),
]
Tilt = Annotated[
    float | None,
    typer.Option(metavar="DEG", help="Lean the tool off the normal, across the stroke: to +v."),
]
Margin = Annotated[
    float | None,
    typer.Option(metavar="MM", help="How far off a mesh's border a stroke must stay, along it."),
]
KeepOut = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Closed lines that no stroke enters: x y z [id], mm."),
]
Copies = Annotated[
    int | None, typer.Option(metavar="N", help="Draw each stroke N times, side by side.")
]
Spacing = Annotated[
    float | None,
    typer.Option(metavar="MM", help="Of copies, along v; negative to the other side."),
]
ToolSpeed = Annotated[
    float | None,
    typer.Option(metavar="MM_S", help="Constant along the path, but for ends and corners."),
]
ToolAcceleration = Annotated[
    float | None,
    typer.Option(metavar="MM_S2", help="At the ends and in corners at most (1000)."),
]

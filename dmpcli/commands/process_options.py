"""Options of ``generalize`` that say what a process asks of its tool."""

from pathlib import Path
from typing import Annotated

import typer

KeepOut = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Closed lines that no stroke enters: x y z [id], mm."),
]

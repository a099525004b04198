"""``dmpcli export``: a file of ours in, a file of another program out."""

from pathlib import Path
from typing import Annotated

import typer

from dmpcli.commands.options import Quiet
from dmpcli.messages import on_terminal
from dmpcli.settings.export import ExportOptions
from dmpcli.settings.options import Given, with_options
from dmpcli.settings.recording import RecordingOptions


@with_options
def command(
    *,
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="Demonstration, trajectory, run, folder of a batch, or any recording that fit "
            "reads; - is standard input.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE|DIR",
            help="What to write; {id} in its name makes a file of each stroke; - is stdout.",
            show_default=False,
        ),
    ],
    options: ExportOptions,
    form: RecordingOptions,
    given: Given,
    quiet: Quiet = False,
) -> None:
    """Write a motion as other programs read it: tables, bags, polylines, robot programs."""
    on_terminal(quiet)
    from dmpcli.workflows import export, motions

    layout = form.as_layout()
    chosen = export.check(output, options, given)
    motion, _ = motions.motion_in(file, layout)
    export.export(motion, output, chosen, options)

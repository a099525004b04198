"""``dmpcli import``: files of other programs in, demonstrations out."""

from pathlib import Path
from typing import Annotated

import typer

from dmpcli.commands.options import Quiet
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal
from dmpcli.settings.import_file import ImportOptions
from dmpcli.settings.options import Given, with_options
from dmpcli.settings.recording import RecordingOptions


@with_options
def command(
    *,
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE",
            help="Tables (CSV, Parquet, TUM), MCAP files, folders of ROS 2 bags and of LeRobot "
            "datasets, SVG drawings, G-code, URScript, KRL, RAPID; - is standard input.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Demonstration (Parquet); {name} and {id} in it make a file of each input and "
            "stroke; - is stdout.",
            show_default=False,
        ),
    ],
    options: ImportOptions,
    form: RecordingOptions,
    given: Given,
    quiet: Quiet = False,
) -> None:
    """Make demonstrations of other programs' recordings, drawings and robot programs."""
    on_terminal(quiet)
    from dmpcli.records import file_io
    from dmpcli.workflows import import_file

    layout = form.as_layout()
    if [str(path) for path in files].count(file_io.DASH) > 1:
        raise InputError("-: standard input can be read only once")
    import_file.check(files, output)
    for file in files:
        import_file.import_file(file, output, options, layout, given)

"""``dmpcli fit``: demonstrations in, a skill out."""

from typing import Annotated

import typer

from dmpcli.commands.options import SURFACES, Quiet, SurfacePose, SurfaceUnit
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal, tell
from dmpcli.settings.fit import FitSettings
from dmpcli.settings.options import Given, with_options
from dmpcli.settings.recording import RecordingOptions


@with_options
def command(
    *,
    demonstrations: Annotated[
        list[str],
        typer.Argument(
            metavar="DEMONSTRATION",
            help="Recordings: ours, or any CSV or Parquet with t, x, y, z; - is standard input.",
            show_default=False,
        ),
    ],
    output: Annotated[
        str,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Skill (JSON); - is stdout.", show_default=False
        ),
    ],
    surface: Annotated[
        str | None,
        typer.Option(metavar="FILE", help=f"What the stroke was taught on: {SURFACES}."),
    ] = None,
    surface_pose: SurfacePose = None,
    surface_unit: SurfaceUnit = None,
    settings: FitSettings,
    form: RecordingOptions,
    given: Given,
    quiet: Quiet = False,
) -> None:
    """Learn a skill from one or several demonstrations."""
    on_terminal(quiet)
    from dmpcli.records import file_io, suffixes
    from dmpcli.records.storage import located
    from dmpcli.workflows import surface_input
    from dmpcli.workflows.fit import check_said, learn
    from dmpcli.workflows.fit_messages import summary
    from dmpcli.workflows.recording import recording

    check_said(given, surface is not None)
    surface_at = None if surface is None else located(surface)
    surface_input.check_options(surface_at, surface_pose, surface_unit)
    layout = form.as_layout()
    suffixes.check(output, suffixes.JSON)
    file_io.check_writable(output)
    if demonstrations.count(file_io.DASH) > 1:
        raise InputError("-: standard input can be read only once")
    sources = [file_io.read(path) for path in demonstrations]
    span = settings.start, settings.until
    strokes = [recording(source, layout, settings.force_profile, span) for source in sources]
    named = None
    if surface_at is not None:
        named = surface_input.read(surface_at, surface_pose, surface_unit, summary=True)
    learned, result = learn(sources, strokes, settings, layout, named)
    file_io.write(output, learned.content)
    names = [source.name for source in sources]
    tell(summary(file_io.shown(output, output=True), names, result))

"""``dmpcli report``: by how much do the drawn strokes differ from the taught one."""

from pathlib import Path
from typing import Annotated

import typer

from dmpcli.commands.options import SURFACES, Quiet, SurfacePose, SurfaceUnit
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal
from dmpcli.settings.options import with_options
from dmpcli.settings.recording import RecordingOptions
from dmpcli.settings.report import ReportOptions

_LOADED, _KERNELS = ["dmpcli.workflows.report_jobs"], "dmpcli.workflows.kept_kernels"
"""What processes that measure need."""


@with_options
def command(
    *,
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE",
            help="Demonstrations, trajectories, batch folders, runs and skills, of s3:// too; - is "
            "standard input. The first demonstration is what the others are compared with.",
            show_default=False,
        ),
    ],
    surface: Annotated[
        str | None,
        typer.Option(metavar="FILE", help=f"What the strokes lie on: {SURFACES}."),
    ] = None,
    surface_pose: SurfacePose = None,
    surface_unit: SurfaceUnit = None,
    pairs: Annotated[
        str | None,
        typer.Option(
            metavar="FILE", help="The table that a batch was drawn from, if it names surfaces."
        ),
    ] = None,
    surface_cache: Annotated[
        str | None,
        typer.Option(metavar="DIR", help="Keep prepared meshes of --pairs here for later runs."),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Also write report.html, report.json, CSV and figures here; or s3://BUCKET/NAME.",
        ),
    ] = None,
    view: Annotated[
        bool, typer.Option("--view", help="With -o: write view.html too, a part to be turned.")
    ] = False,
    show: Annotated[
        bool, typer.Option("--open", help="With -o: show the page, or with --view the part.")
    ] = False,
    png: Annotated[
        bool, typer.Option("--png", help="With -o: write the figures as PNG too, beside the SVG.")
    ] = False,
    paper: Annotated[
        bool,
        typer.Option("--paper", help="The paper's tables beside ours, and with -o its figures."),
    ] = False,
    wanted: ReportOptions,
    form: RecordingOptions,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of the tables.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Compare strokes: wave heights, deviation, smoothness, ends, deadlines."""
    on_terminal(quiet)
    if wanted.jobs > 1:
        from dmpcli.batch import process_pool

        process_pool.begin(_LOADED if wanted.kernels == "pure" else [*_LOADED, _KERNELS])
    from dmpcli.records import file_io
    from dmpcli.records.storage import located
    from dmpcli.workflows import surface_input
    from dmpcli.workflows.report import check_output, report

    if files.count("-") > 1:
        raise InputError("-: standard input can be read only once; name the other files")
    target = None if output is None else located(output)
    pairs_at = None if pairs is None else located(pairs)
    surface_at = None if surface is None else located(surface)
    surface_input.check_options(pairs_at or surface_at, surface_pose, surface_unit)
    if surface_cache is not None and pairs is None:
        raise InputError("--surface-cache: belongs to --pairs; leave it out")
    check_output(target)
    if target is None and (view or show):
        raise InputError("--view and --open need the folder of the pages: give -o DIR")
    if show and not isinstance(target, Path):
        raise InputError("--open: shows a page of this machine, and -o names a store; leave it out")
    if view:
        from dmpcli.reporting.turnable import check

        check()
    layout = form.as_layout()
    read = grounds = None
    if pairs_at is not None:
        from dmpcli.workflows.report_sites import SiteGrounds
        from dmpcli.workflows.table_sites import Otherwise

        otherwise = Otherwise(surface, surface_pose, surface_unit)
        grounds = SiteGrounds(pairs_at, otherwise, surface_cache)
    elif surface_at is not None:
        read = surface_input.read(surface_at, surface_pose, surface_unit)
    made = report(files, None, layout, read, target, grounds, paper, view, png, wanted)
    file_io.say(made.json() if as_json else made.text(_width()).encode())
    if show and isinstance(target, Path):
        typer.launch(str((target / ("view.html" if view else "report.html")).resolve()))


def _width() -> int:
    """Columns to print in: the terminal's, and always the same into a file or a pipe."""
    import shutil
    import sys

    from dmpcli.workflows.report import WIDTH

    if sys.stdout is None or not sys.stdout.isatty():
        return WIDTH
    return max(shutil.get_terminal_size().columns, WIDTH)

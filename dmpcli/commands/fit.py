"""``dmpcli fit``: demonstrations in, a skill out."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.commands import recording_options
from dmpcli.commands.options import SURFACES, Config, Point, Quiet, SurfacePose, SurfaceUnit
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal

if TYPE_CHECKING:
    pass


def command(
    demonstrations: Annotated[
        list[Path],
        typer.Argument(
            metavar="DEMONSTRATION...",
            help="Recordings: ours, or any CSV or Parquet with t, x, y, z; - is standard input.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="SKILL", help="Skill file (JSON).", show_default=False
        ),
    ],
    surface: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help=f"What the stroke was taught on: {SURFACES}."),
    ] = None,
    surface_pose: SurfacePose = None,
    surface_unit: SurfaceUnit = None,
    normal: Annotated[
        Point | None,
        typer.Option(metavar="X Y Z", help="Normal of the plane it was taught on, to the tool."),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            metavar="MM", help="RMS to keep. Default: 0.1, or 0.2 % of the stroke's diagonal."
        ),
    ] = None,
    align: Annotated[
        str | None,
        typer.Option(help="Several demonstrations by path (default), by time, or none."),
    ] = None,
    start: Annotated[
        float | None, typer.Option("--from", metavar="S", help="Learn the recording from here on.")
    ] = None,
    until: Annotated[
        float | None, typer.Option(metavar="S", help="Learn the recording up to here.")
    ] = None,
    cut_pauses: Annotated[
        bool | None,
        typer.Option("--cut-pauses", help="Take pauses out.", show_default=False),
    ] = None,
    model: Annotated[
        str | None, typer.Option(help="modified (eq. 9-11) or original (eq. 4-8).")
    ] = None,
    forcing_scale: Annotated[
        str | None,
        typer.Option(help="Original model: (g - x0) per axis, or the start-goal distance."),
    ] = None,
    regression: Annotated[str | None, typer.Option(help="lwr or ridge.")] = None,
    basis: Annotated[
        str | None,
        typer.Option(
            metavar="auto|N", help="Number of Gaussian functions: 80 or as the tolerance asks."
        ),
    ] = None,
    damping: Annotated[float | None, typer.Option(help="d; k = d²/4.")] = None,
    tau: Annotated[
        float | None, typer.Option(help="Time constant in units of the stroke's duration.")
    ] = None,
    alpha_1: Annotated[float | None, typer.Option("--alpha-1", help="Phase constant.")] = None,
    widths: Annotated[
        str | None, typer.Option(help="Width rule of the Gaussians: spacing or power.")
    ] = None,
    cutoff: Annotated[
        float | None,
        typer.Option(help="Smoothing, Hz. Default: by the recording's noise."),
    ] = None,
    trim: Annotated[
        bool | None, typer.Option("--trim/--no-trim", help="Cut off idle ends (default).")
    ] = None,
    preset: Annotated[str, typer.Option(help="default, paper, or a TOML file.")] = "default",
    config: Config = None,
    layout: recording_options.LayoutName = None,
    map_: recording_options.Map = None,
    columns: recording_options.Columns = None,
    body: recording_options.Body = None,
    length_unit: recording_options.LengthUnit = None,
    time_unit: recording_options.TimeUnit = None,
    angle_unit: recording_options.AngleUnit = None,
    rotation: recording_options.Rotation = None,
    sample_rate: recording_options.SampleRate = None,
    repeated_stamps: recording_options.Repeated = None,
    decimal: recording_options.Decimal = None,
    quiet: Quiet = False,
) -> None:
    """Learn a skill from one or several demonstrations."""
    on_terminal(quiet)
    from dmpcli.messages import tell
    from dmpcli.records import streams
    from dmpcli.records.fit_settings import FitSettings
    from dmpcli.records.settings import resolve
    from dmpcli.workflows import surface_input
    from dmpcli.workflows.fit import check_said, learn
    from dmpcli.workflows.fit_messages import summary

    surface_input.check_options(surface, surface_pose, surface_unit)
    check_said(
        {"forcing_scale": forcing_scale, "model": model, "normal": normal}, surface is not None
    )
    settings = resolve(
        FitSettings,
        "fit",
        {
            "model": model,
            "forcing_scale": forcing_scale,
            "regression": regression,
            "basis": _number(basis),
            "tolerance": tolerance,
            "align": align,
            "normal": normal,
            "start": start,
            "until": until,
            "cut_pauses": cut_pauses,
            "damping": damping,
            "tau": tau,
            "alpha_1": alpha_1,
            "widths": widths,
            "cutoff": cutoff,
            "trim": trim,
        },
        preset,
        config,
    )
    form = recording_options.layout_of(
        layout,
        map_,
        columns,
        body=body,
        length=length_unit,
        time=time_unit,
        angle=angle_unit,
        rotation=rotation,
        sample_rate=sample_rate,
        repeated=repeated_stamps,
        decimal=decimal,
    )
    streams.check_writable(output)
    if [str(path) for path in demonstrations].count(streams.DASH) > 1:
        raise InputError("-: standard input can be read only once")
    sources = [streams.read(path) for path in demonstrations]
    strokes = [recording_options.recording(source, form) for source in sources]
    named = None
    if surface is not None:
        named = surface_input.read(surface, surface_pose, surface_unit, summary=True)
    learned, result = learn(sources, strokes, settings, form, named)
    streams.write(output, learned.content)
    names = [source.name for source in sources]
    tell(summary(streams.shown(output, output=True), names, result))


def _number(basis: str | None) -> int | str | None:
    """Return N as a number where it is one; the settings hold its range."""
    if basis is None or basis == "auto":
        return basis
    try:
        return int(basis)
    except ValueError:
        raise InputError(f"--basis {basis}: must be auto, or a number of functions") from None

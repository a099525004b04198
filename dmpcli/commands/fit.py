"""``dmpcli fit``: demonstrations in, a skill out."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.commands import recording_options
from dmpcli.commands.options import SURFACES, Quiet, SurfacePose, SurfaceUnit
from dmpcli.errors import InputError
from dmpcli.settings.fit import FitSettings
from dmpcli.settings.options import Given, with_options
from dmpcli.settings.recording import RecordingOptions

if TYPE_CHECKING:
    from dmpcli.primitives.fit_result import Fit
    from dmpcli.records import skill as skill_file


@with_options
def command(
    *,
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
            "-o", "--output", metavar="FILE", help="Skill (JSON); - is stdout.", show_default=False
        ),
    ],
    surface: Annotated[
        Path | None,
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
    from dmpcli.commands import surface_input
    from dmpcli.commands.fit_messages import cautions, summary
    from dmpcli.commands.messages import about, tell, warn
    from dmpcli.primitives.learning import fit
    from dmpcli.primitives.skill import TaughtSurface
    from dmpcli.records import skill, streams
    from dmpcli.records.record import Provenance

    if "forcing_scale" in given and given.get("model") == "modified":
        raise InputError("--forcing-scale: belongs to --model original; leave it out")
    surface_input.check_options(surface, surface_pose, surface_unit)
    if surface is not None and "normal" in given:
        raise InputError("--surface and --normal both say what the stroke was taught on; give one")
    layout = form.as_layout()
    streams.check_writable(output)
    if [str(path) for path in demonstrations].count(streams.DASH) > 1:
        raise InputError("-: standard input can be read only once")
    sources = [streams.read(path) for path in demonstrations]
    strokes = [recording_options.recording(source, layout, quiet) for source in sources]
    options = settings.as_options()
    if layout is not None:
        options["layout"] = layout.as_options()
    inputs = [{"role": "demonstration", "sha256": s.sha256} for s in sources]
    taught_on, taught = None, None
    if surface is not None:
        named = surface_input.read(surface, surface_pose, surface_unit, quiet, summary=True)
        options |= named.options | {"surface_unit": named.unit}
        inputs += named.inputs
        taught_on, taught = named.surface, TaughtSurface(named.kind, named.facts)
    names = [source.name for source in sources]
    with about(", ".join(names)):
        result = fit(strokes, settings.choices(), taught_on, taught)
    streams.write(
        output,
        skill.encode(
            result.skill,
            _reproductions([source.sha256 for source in sources], result),
            Provenance("fit", options, tuple(inputs)),
        ),
    )
    tell(summary(streams.shown(output, output=True), names, result), quiet)
    for line in cautions(names, result):
        warn(line)


def _reproductions(hashes: list[str], result: "Fit") -> "list[skill_file.Reproduction]":
    from dmpcli.records import skill

    return [
        skill.Reproduction(
            sha256=sha256,
            duration=prepared.stroke.duration,
            rms=r.rms,
            largest=r.largest,
            end=r.end,
            smoothing=prepared.removed,
            wave=r.wave,
            angle=r.angle,
            noise=0.0 if prepared.seen is None else prepared.seen.sigma,
            cutoff=prepared.cutoff,
        )
        for sha256, prepared, r in zip(hashes, result.prepared, result.reproductions, strict=True)
    ]

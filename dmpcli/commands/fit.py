"""``dmpcli fit``: demonstrations in, a skill out."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.commands.options import Config, Quiet
from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.primitives.learning import Fit
    from dmpcli.records.recordings import Layout


POOR = 0.05
"""Share of a stroke's extent beyond which an RMS deviation is worth a warning."""


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
    model: Annotated[
        str | None, typer.Option(help="modified (eq. 9-11) or original (eq. 4-8).")
    ] = None,
    forcing_scale: Annotated[
        str | None,
        typer.Option(help="Original model: (g - x0) per axis, or the start-goal distance."),
    ] = None,
    regression: Annotated[str | None, typer.Option(help="lwr or ridge.")] = None,
    basis: Annotated[int | None, typer.Option(help="N, number of Gaussian functions.")] = None,
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
        typer.Option(help="Low-pass, Hz. Default: the highest that N functions can carry."),
    ] = None,
    trim: Annotated[
        bool | None, typer.Option("--trim/--no-trim", help="Cut off idle ends (default).")
    ] = None,
    preset: Annotated[str, typer.Option(help="default, paper, or a TOML file.")] = "default",
    config: Config = None,
    layout: Annotated[
        str | None, typer.Option(help="Columns and units of a known recorder: ur or tum.")
    ] = None,
    map_: Annotated[
        list[str] | None,
        typer.Option("--map", help="OURS=THEIRS, as t=time or x=tool_x; may be repeated."),
    ] = None,
    length_unit: Annotated[str | None, typer.Option(help="mm, cm, m or in.")] = None,
    time_unit: Annotated[str | None, typer.Option(help="s, ms, us or ns.")] = None,
    angle_unit: Annotated[str | None, typer.Option(help="rad or deg.")] = None,
    rotation: Annotated[
        str | None,
        typer.Option(help="What rx ry rz are: euler or rotvec; or quaternion: qx qy qz qw."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Learn a skill from one or several demonstrations."""
    from dmpcli.commands.messages import about, tell
    from dmpcli.primitives.learning import fit
    from dmpcli.records import recordings, skill, streams
    from dmpcli.records.fit_settings import FitSettings
    from dmpcli.records.record import Provenance
    from dmpcli.records.settings import resolve

    if forcing_scale is not None and model == "modified":
        raise InputError("--forcing-scale: belongs to --model original; leave it out")
    settings = resolve(
        FitSettings,
        "fit",
        {
            "model": model,
            "forcing_scale": forcing_scale,
            "regression": regression,
            "basis": basis,
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
    columns = _layout(layout, map_ or [], length_unit, time_unit, angle_unit, rotation)
    streams.check_writable(output)
    if [str(path) for path in demonstrations].count(streams.DASH) > 1:
        raise InputError("-: standard input can be read only once")
    sources = [streams.read(path) for path in demonstrations]
    strokes = [recordings.stroke(source, columns) for source in sources]
    with about(", ".join(source.name for source in sources)):
        result = fit(strokes, settings.choices())

    reproduction = [
        skill.Reproduction(
            sha256=source.sha256,
            duration=prepared.stroke.duration,
            rms=r.rms,
            largest=r.largest,
            end=r.end,
            smoothing=prepared.removed,
        )
        for source, prepared, r in zip(sources, result.prepared, result.reproductions, strict=True)
    ]
    options = settings.model_dump()
    if columns is not None:
        options["layout"] = columns.as_options()
    inputs = tuple({"role": "demonstration", "sha256": s.sha256} for s in sources)
    streams.write(
        output, skill.encode(result.skill, reproduction, Provenance("fit", options, inputs))
    )
    name = streams.shown(output, output=True)
    tell(_summary(name, [s.name for s in sources], result), quiet)
    _caution([s.name for s in sources], result)


def _caution(names: list[str], result: "Fit") -> None:
    """Say it where the skill is not the stroke that was demonstrated."""
    from dmpcli.commands.messages import warn
    from dmpcli.surfaces.plane import extent

    for name, prepared, r in zip(names, result.prepared, result.reproductions, strict=True):
        size = extent(prepared.stroke.position)
        if prepared.removed > POOR * size:
            warn(f"{name}: smoothing took off much of the stroke; raise --cutoff")
        if r.rms > POOR * size:
            warn(f"{name}: the skill does not give this stroke back; see --basis and --alpha-1")


def _layout(
    known: str | None,
    mapping: list[str],
    length: str | None,
    time: str | None,
    angle: str | None,
    rotation: str | None,
) -> "Layout | None":
    """Return the layout that the options describe; None where they say nothing."""
    from dmpcli.records import recordings

    given = {"length": length, "time": time, "angle": angle, "rotation": rotation}
    if known is None and not mapping and not any(given.values()):
        return None
    if known is not None and known not in recordings.LAYOUTS:
        raise InputError(
            f"--layout {known}: no such layout; there are {', '.join(recordings.LAYOUTS)}"
        )
    base = recordings.LAYOUTS[known] if known else recordings.Layout()
    return recordings.adapted(base, mapping, {k: v for k, v in given.items() if v is not None})


def _summary(output: str, names: list[str], result: "Fit") -> str:
    """Return what a person wants to know of a fit, a line per demonstration."""
    skill = result.skill
    kind = "closed" if skill.closed else f"start to goal {skill.frame.length:.3f} mm"
    lines = [f"{output}: {skill.model} DMP, N = {len(skill.basis)}, {skill.duration:.3f} s, {kind}"]
    exempt = [
        name
        for name, without in zip(("x", "y", "z", "rx", "ry", "rz"), skill.exempt, strict=True)
        if without and skill.forcing_scale == "axis"
    ]
    if exempt:
        lines.append(
            f"  g - x0 is nearly zero in {', '.join(exempt)}: fitted with factor 1 instead"
        )
    for name, prepared, r in zip(names, result.prepared, result.reproductions, strict=True):
        before, after = prepared.trimmed
        lines.append(
            f"  {name}: reproduction RMS {r.rms:.4f} mm, largest {r.largest:.4f}, "
            f"end {r.end:.4f}; smoothing ({prepared.cutoff:.2f} Hz) took off "
            f"{prepared.removed:.4f} mm RMS; trimmed {before:.2f} s and {after:.2f} s"
        )
        demonstrated, reproduced = (
            _wave_height(x, r.demonstrated) for x in (r.demonstrated, r.reproduced)
        )
        if not skill.closed and demonstrated is not None and reproduced is not None:
            lines.append(
                f"  wave height {demonstrated:.3f} mm demonstrated, {reproduced:.3f} mm reproduced"
            )
    return "\n".join(lines)


def _wave_height(chart: "Floats", demonstrated: "Floats") -> float | None:
    """Return the mean wave height across the demonstrated start-goal line; None for a line."""
    import numpy as np

    from dmpcli.measures.wave import stroke_wave

    return stroke_wave(chart, demonstrated[0], demonstrated[-1], np.array([0.0, 0.0, 1.0])).mean

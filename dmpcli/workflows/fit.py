"""`fit`: recordings in, a skill out."""

from collections.abc import Mapping, Sequence
from typing import Any

from dmpcli.dmp.fit_result import Fit
from dmpcli.dmp.learning import fit
from dmpcli.dmp.skill import TaughtSurface
from dmpcli.errors import InputError, about
from dmpcli.messages import warn
from dmpcli.records import learned_skill, skill
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import Layout
from dmpcli.records.learned_skill import LearnedSkill
from dmpcli.records.record import Provenance
from dmpcli.settings.fit import FitSettings
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.workflows.fit_messages import cautions
from dmpcli.workflows.surface_input import SurfaceInput


def check_said(said: Mapping[str, Any], on_surface: bool) -> None:
    """Refuse options that say nothing without one another, or say it twice.

    Parameters
    ----------
    said : mapping
        Settings that the caller named; None where nothing was said.
    on_surface : bool
        Whether a surface is named that the stroke was taught on.

    Raises
    ------
    InputError
        Names the options.
    """
    if said.get("forcing_scale") is not None and said.get("model") == "modified":
        raise InputError("--forcing-scale: belongs to --model original; leave it out")
    if on_surface and said.get("normal") is not None:
        raise InputError("--surface and --normal both say what the stroke was taught on; give one")


def learn(
    sources: Sequence[Source],
    strokes: Sequence[Trajectory],
    settings: FitSettings,
    form: Layout | None = None,
    on: SurfaceInput | None = None,
) -> tuple[LearnedSkill, Fit]:
    """Learn a skill from one or several demonstrations, and tell what is doubtful about it.

    Parameters
    ----------
    sources : sequence of Source
        The recordings' files.
    strokes : sequence of Trajectory
        What was read of them.
    settings : FitSettings
    form : Layout, optional
        How the recordings were read, where they are not dmpcli's own.
    on : SurfaceInput, optional
        What the stroke was taught on.

    Raises
    ------
    InputError, RefusedError
        The recordings cannot be learned so.
    """
    options = settings.as_options()
    if form is not None:
        options["layout"] = form.as_options()
    inputs = [{"role": "demonstration", "sha256": source.sha256} for source in sources]
    surface, taught = None, None
    if on is not None:
        options |= on.options | {"surface_unit": on.unit}
        inputs += on.inputs
        surface, taught = on.surface, TaughtSurface(on.kind, on.facts)
    names = [source.name for source in sources]
    with about(", ".join(names)):
        result = fit(list(strokes), settings.choices(), surface, taught)
    content = skill.encode(
        result.skill,
        _reproductions([source.sha256 for source in sources], result),
        Provenance("fit", options, tuple(inputs)),
    )
    for line in cautions(names, result, settings.cutoff):
        warn(line)
    return learned_skill.read(Source("skill", content)), result


def _reproductions(hashes: Sequence[str], result: Fit) -> list[skill.Reproduction]:
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

"""What `fit` says of a skill: how it was learned, what it keeps, and what is doubtful."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.dmp.options import MOST
from dmpcli.dmp.stroke_plane import LEANING
from dmpcli.errors import counted
from dmpcli.records import tolerance_mark

if TYPE_CHECKING:
    from dmpcli.dmp.alignment import Alignment
    from dmpcli.dmp.fit_result import Fit, ReproductionMeasures
    from dmpcli.dmp.paper_preprocessing import Prepared
    from dmpcli.dmp.preprocessing import Preprocessed
    from dmpcli.dmp.skill import Skill
    from dmpcli.dmp.stroke_plane import StrokePlane

_AXES = ("x", "y", "z", "rx", "ry", "rz")
# Share of a stroke's extent beyond which the paper's learning is told to fail.
_POOR = 0.05
# Share of the path in its plane below which the plane is in doubt.
_IN_PLANE = 0.5
# Noise below this part of the tolerance does no harm, of whatever kind.
_FAINT = 0.1
# Gaps and pauses that are named by their times.
_SHOWN = 3
# Samples of a force profile that are looked at.
_FORCES = 2001
# Share of a profile's largest force by which it may err, RMS, before that is told.
_ROUGH = 0.05


def summary(output: str, names: Sequence[str], result: "Fit") -> str:
    """Return what a person wants to know of a fit, a line per demonstration.

    Parameters
    ----------
    output : str
        What the skill's file is called.
    names : sequence of str
        What the demonstrations are called, in their order.
    result : Fit

    Returns
    -------
    str
        Lines: the skill first, its force last.
    """
    skill = result.skill
    kind = "closed" if skill.closed else f"start to goal {skill.frame.length:.3f} mm"
    passes = f", {skill.passes} passes of LWR" if skill.passes > 1 else ""
    lines = [
        f"{output}: {skill.model} DMP, N = {len(skill.basis)}{passes}, {skill.duration:.3f} s, "
        f"{kind}{_taught(skill, result.plane)}"
    ]
    exempt = [
        name
        for name, without in zip(_AXES, skill.exempt, strict=True)
        if without and skill.forcing_scale == "axis"
    ]
    if exempt:
        lines.append(
            f"  g - x0 is nearly zero in {', '.join(exempt)}: fitted with factor 1 instead"
        )
    for name, prepared, r in zip(names, result.prepared, result.reproductions, strict=True):
        lines.append(f"  {name}: {_reproduced(prepared, r)}")
        wave = r.wave or _wave(r) if not skill.closed else None
        if wave is not None:
            lines.append(
                f"  wave height {wave[0]:.3f} mm demonstrated, {wave[1]:.3f} mm reproduced"
            )
    if skill.spread is not None:
        u, v, w = np.sqrt(np.mean(skill.spread.deviation[:, :3] ** 2, axis=0))
        lines.append(
            f"  the demonstrations scatter about their mean by {u:.2f} mm along, {v:.2f} across "
            f"and {w:.2f} off the surface (standard deviation)"
        )
    if skill.force is not None:
        lines.append(f"  {_force(skill)}")
    return "\n".join(lines)


def _force(skill: "Skill") -> str:
    force = skill.taught_force(np.linspace(0.0, skill.duration, _FORCES))
    assert skill.force is not None
    assert force is not None
    pressing = force[force > 0.0]
    if not len(pressing):
        return "force along the normal: none"
    return (
        f"force along the normal {pressing.min():.2f} to {pressing.max():.2f} N, mean "
        f"{pressing.mean():.2f}, in {100.0 * len(pressing) / len(force):.0f} % of the time; "
        f"reproduction RMS {skill.force.rms:.3f} N, largest {skill.force.largest:.3f}"
    )


def _taught(skill: "Skill", plane: "StrokePlane | None") -> str:
    if skill.surface is not None:
        least, largest = skill.heights
        return f", taught on the {skill.surface.kind}, w {least:.2f} to {largest:.2f} mm"
    if plane is None:
        return ""
    n = " ".join(f"{c + 0.0:.3f}" for c in skill.frame.normal)
    return f", normal {n}"


def _reproduced(prepared: "Prepared", r: "ReproductionMeasures") -> str:
    before, after = prepared.trimmed
    smoothing = "not smoothed"
    if prepared.cutoff is not None:
        corners = 0 if prepared.seen is None else prepared.seen.position.corners
        kept = f" between {corners} corner{'s' if corners > 1 else ''}" if corners else ""
        smoothing = (
            f"smoothing ({prepared.cutoff:.2f} Hz{kept}) took off {prepared.removed:.4f} mm RMS"
        )
    noise = "" if prepared.seen is None else f"noise {prepared.seen.sigma:.3f} mm, "
    return (
        f"reproduction RMS {r.rms:.4f} mm, largest {r.largest:.4f}, end {r.end:.4f}; {noise}"
        f"{smoothing}; trimmed {before:.2f} s and {after:.2f} s"
    )


def _wave(r: "ReproductionMeasures") -> tuple[float, float] | None:
    """Return the wave heights across the demonstrated start-goal line; None for a line."""
    from dmpcli.metrics.wave_height import stroke_wave

    up = np.array([0.0, 0.0, 1.0])
    ends = r.demonstrated[0], r.demonstrated[-1]
    there, here = (stroke_wave(x, *ends, up).mean for x in (r.demonstrated, r.reproduced))
    return None if there is None or here is None else (there, here)


def cautions(names: Sequence[str], result: "Fit", cutoff: float | None = None) -> Iterator[str]:
    """Yield a line for all that is doubtful of a fit, each with its remedy.

    Parameters
    ----------
    names : sequence of str
        Of the recordings.
    result : Fit
    cutoff : float, optional
        That was asked for, Hz.
    """
    if result.skill.learning == "paper":
        yield from _of_paper(names, result)
        return
    rests = () if result.alignment is None else result.alignment.rests
    for i, (name, prepared) in enumerate(zip(names, result.prepared, strict=True)):
        assert prepared.seen is not None
        yield from _of_recording(name, prepared.seen)
        yield from _of_noise(name, prepared.seen, result.skill, cutoff)
        if not any(rest.left_out and rest.index == i for rest in rests):
            yield from _of_pauses(name, prepared.seen)
    if result.plane is not None:
        yield from _of_plane(result.plane)
    if result.alignment is not None:
        yield from _of_alignment(names, result.alignment)
    yield from _of_tolerance(result)


def _of_paper(names: Sequence[str], result: "Fit") -> Iterator[str]:
    from dmpcli.surfaces.plane import extent

    for name, prepared, r in zip(names, result.prepared, result.reproductions, strict=True):
        size = extent(prepared.stroke.position)
        if prepared.removed > _POOR * size:
            yield f"{name}: smoothing took off much of the stroke; raise --cutoff"
        if r.rms > _POOR * size:
            yield f"{name}: the skill does not give this stroke back; see --basis and --alpha-1"


def _of_recording(name: str, seen: "Preprocessed") -> Iterator[str]:
    if seen.gaps:
        yield (
            f"{name}: {counted(len(seen.gaps), 'gap')} without samples filled in along a smooth "
            f"curve: {_spans(seen.gaps)}; record again, or cut there with --from and --until"
        )
    if seen.merged:
        yield (
            f"{name}: stamps come in bursts: {counted(seen.merged, 'sample')} averaged with others "
            "of their burst; record with the sensor's own time"
        )
    if seen.approach is not None:
        yield (
            f"{name}: begins with an approach that belongs to no stroke, {_spans([seen.approach])};"
            f" --from {seen.approach[1]:.2f} leaves it out"
        )
    if seen.retract is not None:
        yield (
            f"{name}: ends with a retract that belongs to no stroke, {_spans([seen.retract])}; "
            f"--until {seen.retract[0]:.2f} leaves it out"
        )


def _of_noise(
    name: str, seen: "Preprocessed", skill: "Skill", cutoff: float | None
) -> Iterator[str]:
    noise = seen.position.noise
    up_to = (noise.reach or 1.0) * seen.half_rate
    faint = 0.0 if skill.reached is None else _FAINT * skill.reached.tolerance
    if cutoff is not None and cutoff < up_to:
        # As asked, whatever it is.
        return
    if noise.doubted:
        if (noise.rms or 0.0) >= faint:
            yield (
                f"{name}: what fills the band up to {up_to:.3g} Hz, RMS {noise.rms:.2g} mm, is "
                f"kept as the stroke's own; if it is filtered noise, --cutoff {_round(seen)} "
                "smooths it"
            )
        return
    if skill.reached is None or noise.typical < faint:
        return
    if noise.kind == "quantised":
        yield (
            f"{name}: positions come in steps of {noise.step:.3g} mm, which shows as jerks where "
            f"the tool is slow; --cutoff {_round(seen)} smooths them"
        )
    elif noise.kind == "band":
        yield (
            f"{name}: noise was filtered or interpolated before it was recorded, up to "
            f"{up_to:.3g} Hz, and cannot be told from the stroke there; "
            f"--cutoff {_round(seen)} smooths it"
        )


def _of_pauses(name: str, seen: "Preprocessed") -> Iterator[str]:
    if seen.pauses and not seen.cut_pauses:
        yield (
            f"{name}: the tool rests {_spans(seen.pauses)}, and will wherever the stroke is drawn; "
            "--cut-pauses takes that out"
        )


def _spans(spans: "Sequence[tuple[float, float]]") -> str:
    shown = ", ".join(f"{a:.2f} to {b:.2f} s" for a, b in spans[:_SHOWN])
    return shown + (f" and {len(spans) - _SHOWN} more" if len(spans) > _SHOWN else "")


def _round(seen: "Preprocessed") -> str:
    """Return a cut-off to name, Hz: where noise outweighs the stroke."""
    share = seen.position.noise.stroke or 0.5
    return f"{share * seen.half_rate:.2g}"


def _of_plane(plane: "StrokePlane") -> Iterator[str]:
    remedy = "name the plane with --normal X Y Z, or what it was taught on with --surface"
    if plane.rule == "tool" and plane.inside > 0.0:
        yield (
            f"the path is not flat across the tool ({100.0 * plane.inside:.0f} % of it lies in one "
            f"plane, {plane.lean:.0f}° from the tool's axis): the plane across the tool is taken; "
            f"{remedy}"
        )
    elif plane.rule == "base":
        yield (
            "the stroke is nearly straight and has no orientation, so that it tells no plane: the "
            f"one across base z is taken; {remedy}"
        )
    elif plane.rule == "fitted" and plane.inside < _IN_PLANE:
        yield (
            f"only {100.0 * plane.inside:.0f} % of the path lies in one plane: it was taught on a "
            f"curved part, or in the air; {remedy}"
        )
    elif plane.rule == "fitted" and plane.lean is not None and plane.lean > LEANING:
        yield f"the tool leans {plane.lean:.1f}° from the normal of the plane that was drawn in"
    if not plane.pooled:
        yield (
            f"the demonstrations' planes differ by {plane.apart:.0f}°: each is taken in its own; "
            f"{remedy}"
        )


def _of_alignment(names: Sequence[str], alignment: "Alignment") -> Iterator[str]:
    for rest in alignment.rests:
        if rest.left_out:
            yield (
                f"{names[rest.index]}: rests from {rest.start:.2f} to {rest.end:.2f} s, which most "
                "of the others do not: left out"
            )
    for doubt in alignment.doubts:
        what = {
            "opposite": "is drawn in the opposite direction",
            "start": f"begins {100.0 * doubt.shift:.0f} % along the others' path",
            "shape": "has another shape",
            "outlier": "is an outlier",
        }[doubt.kind]
        yield (
            f"{names[doubt.index]}: {what}, RMS {doubt.distance:.2f} mm from the mean of the "
            "others; fit without it"
        )


def _of_tolerance(result: "Fit") -> Iterator[str]:
    profile = result.skill.force
    if profile is not None:
        yield from _of_force(result.skill)
    reached = result.skill.reached
    if reached is None or reached.within:
        return
    if result.lost > reached.tolerance:
        yield (
            f"smoothing took off much of the stroke, RMS {result.lost:.3g} mm beyond its noise; "
            "raise --cutoff, or leave it out"
        )
        return
    remedy = "ask for a --tolerance that will do"
    if result.alternative is not None:
        count, rms = result.alternative
        remedy = f"--regression ridge reaches RMS {rms:.3g} mm with N = {count}"
    elif len(result.skill.basis) < MOST:
        remedy = f"raise --basis, or leave it to --basis auto; or {remedy}"
    missed = list(_missed(result, reached.tolerance))
    said = tolerance_mark.strays(
        vars(reached), " and ".join(missed) or "its ends", "".join(f", {m}" for m in missed)
    )
    yield f"{said}; {remedy}"


def _missed(result: "Fit", tolerance: float) -> Iterator[str]:
    """Yield what of a stroke but its path is beyond the tolerance, mm."""
    waves = [r.wave for r in result.reproductions if r.wave is not None]
    there, here = max(waves, key=lambda wave: abs(wave[1] - wave[0]), default=(0.0, 0.0))
    if abs(here - there) > tolerance:
        yield f"wave {here:.2f} mm of {there:.2f}"
    angle = float(np.degrees(max(r.angle for r in result.reproductions)))
    if angle > tolerance_mark.ANGLE:
        yield f"the tool's turn by up to {angle:.2g}°"


def _of_force(skill: "Skill") -> Iterator[str]:
    force = skill.taught_force(np.linspace(0.0, skill.duration, _FORCES))
    assert skill.force is not None
    assert force is not None
    if skill.force.rms > _ROUGH * force.max():
        yield (
            f"the force profile strays from what was recorded by RMS {skill.force.rms:.2f} N of "
            f"{force.max():.2f} N: raise --basis, or --cutoff for a smoother force"
        )

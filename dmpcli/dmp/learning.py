"""Learning a skill that keeps the stroke: from any recording, within a tolerance."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.agreement import pooled_mean
from dmpcli.dmp.alignment import Alignment, align
from dmpcli.dmp.basis_search import (
    ANGLE,
    Problem,
    Quality,
    Tolerance,
    Weights,
    judged,
    nearest,
    search,
)
from dmpcli.dmp.curve import Curve, dense_count
from dmpcli.dmp.demonstrations import ComparedPath
from dmpcli.dmp.fit_result import Fit, ReproductionMeasures
from dmpcli.dmp.force_profile import LEAST, ForceProfile
from dmpcli.dmp.options import TOLERANCE, TOLERANCE_SHARE, FitOptions
from dmpcli.dmp.paper_learning import fit_as_paper
from dmpcli.dmp.paper_preprocessing import Prepared
from dmpcli.dmp.preprocessing import Preprocessed, preprocess
from dmpcli.dmp.skill import Accuracy, DemonstrationSpread, Skill, TaughtSurface
from dmpcli.dmp.smoothing import Signal
from dmpcli.dmp.taught_strokes import TaughtStroke, mean_frame, taught_strokes
from dmpcli.dmp.transformation_system import TransformationGains, critical
from dmpcli.errors import InputError
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces import plane
from dmpcli.surfaces.surface import Surface

# Samples at which the scatter of several demonstrations is kept.
_SPREAD = 101
# Samples of a reproduction that are kept beside those of one of several demonstrations.
_MOST_SHOWN = 8001
# The nearest distance of noisy samples to the true curve: by two of its three components.
_ACROSS = 2.0
# Standard errors of that estimate that count as noise, and standard deviations of one sample.
_DOUBT, _OUTLYING = 3.0, 4.5
# Of a stroke whose force is learned, less than this share in contact tells none.
_PRESSED = 0.05


def fit(
    strokes: Sequence[Trajectory],
    choices: FitOptions,
    surface: Surface | None = None,
    taught: TaughtSurface | None = None,
) -> Fit:
    """Learn one skill from one or several demonstrations.

    Parameters
    ----------
    strokes : sequence of Trajectory
        At least one; all with orientation or all without.
    choices : FitOptions
    surface : Surface, optional
        What they were taught on, in the base frame; without it a plane is looked for.
    taught : TaughtSurface, optional
        What the skill keeps of it.

    Returns
    -------
    Fit
        Its frame is the mean of the demonstrations', whatever their order.

    Raises
    ------
    InputError
        A stroke does not move, or the strokes do not match.
    RefusedError
        A recording does not lie on the surface.
    """
    if choices.as_paper:
        _check_paper(choices, surface)
        return fit_as_paper(strokes, choices)
    seen = [
        preprocess(
            stroke if choices.force_profile else replace(stroke, contact_force=None),
            cutoff=choices.cutoff,
            trim=choices.trim,
            start=choices.start,
            until=choices.until,
            cut_pauses=choices.cut_pauses,
        )
        for stroke in strokes
    ]
    _check_alike(seen)
    found, planes, closed = taught_strokes(seen, choices, surface)
    alignment, curves = _aligned(found, choices, closed)
    mean = curves[0] if len(curves) == 1 else _mean(curves)
    problem = _problem(mean, choices, closed)
    lost = [lost_of(p) for p in seen]
    tolerance = _tolerance(mean, seen, choices)
    method = choices.regression
    learned = search(problem, method, tolerance, choices.basis, choices.passes)
    quality = with_lost(learned.quality, lost)
    within = bool(quality.excess(tolerance) <= 1.0)
    alternative, most_lost = None, max(loss[0] for loss in lost)
    if not within and method == "lwr" and choices.basis is None and most_lost < tolerance.length:
        ridge = search(problem, "ridge", tolerance)
        alternative = (len(ridge.basis), with_lost(ridge.quality, lost).rms)
    noise = max(p.sigma for p in seen)
    profile = _profile(found, alignment, problem, learned, choices)
    skill = _skill(
        learned,
        problem,
        choices,
        found,
        Accuracy(tolerance.length, quality.rms, quality.largest, noise, within),
        taught,
        # A force that pushes tells the side.
        guessed=planes is not None and planes.guessed and profile is None,
        spread=None if alignment is None else _spread(alignment),
        force=profile,
    )
    if len(found) == 1:
        reproductions = [_reproduction(learned.demonstrated, learned.reproduced, quality)]
    else:
        reproductions = [
            _own_reproduction(skill, curve, loss) for curve, loss in zip(curves, lost, strict=True)
        ]
    prepared = [_prepared(d, closed) for d in found]
    return Fit(skill, prepared, reproductions, planes, alignment, alternative, most_lost)


def _check_paper(choices: FitOptions, surface: Surface | None) -> None:
    """Refuse what the paper's learning would pass over."""
    given = {
        "--surface": surface is not None,
        "--normal": choices.normal is not None,
        "--tolerance": choices.tolerance is not None,
        "--from": choices.start is not None,
        "--until": choices.until is not None,
        "--cut-pauses": choices.cut_pauses,
        "passes": choices.passes is not None,
        "--align": choices.align != "path",
        "--force-profile": choices.force_profile,
    }
    for name, asked in given.items():
        if asked:
            raise InputError(
                f"{name}: the original model and the preset paper learn as the paper has it, which "
                "knows none; leave it out, or take the modified model with the default preset"
            )


def _check_alike(seen: Sequence[Preprocessed]) -> None:
    for i, other in enumerate(seen[1:], start=2):
        if (other.rotation is None) != (seen[0].rotation is None):
            raise InputError(
                f"demonstration {i} and the first: only one has an orientation; fit them apart"
            )


def _problem(curve: Curve, choices: FitOptions, closed: bool) -> Problem:
    d = np.full(6, choices.damping)
    spring = TransformationGains(critical(d), d, choices.tau * curve.duration)
    return Problem(curve, spring, choices.alpha_1, choices.widths, closed)


def _aligned(
    found: Sequence[TaughtStroke], choices: FitOptions, closed: bool
) -> tuple[Alignment | None, list[Curve]]:
    """Curves over a common time, u scaled to the mean start-goal distance."""
    if len(found) == 1:
        return None, [found[0].curve]
    mean = float(np.mean([d.length for d in found]))
    tracks = []
    for d in found:
        x = d.curve.even(_samples_of(d.curve))
        if not closed:
            x[:, 0] *= mean / d.length
        angles = None if d.seen.rotation is None else x[:, 3:]
        tracks.append(ComparedPath(d.seen.duration, x[:, :3], d.seen.smoothed_noise, angles))
    alignment = align(tracks, choices.align)
    intervals = max(d.curve.intervals for d in found)
    curves = []
    for i, x in enumerate(alignment.x):
        columns = np.zeros((len(x), 6))
        columns[:, :3] = x
        if alignment.angles is not None:
            columns[:, 3:] = alignment.angles[i]
        curves.append(Curve.through(columns, alignment.duration, intervals))
    return alignment, curves


def _mean(curves: Sequence[Curve]) -> Curve:
    samples = _samples_of(curves[0])
    x = pooled_mean(np.array([c.even(samples) for c in curves]))
    return Curve.through(x, curves[0].duration, curves[0].intervals)


def _tolerance(curve: Curve, seen: Sequence[Preprocessed], choices: FitOptions) -> Tolerance:
    """Tolerance of a skill: what is asked for, but not below twice the noise after smoothing."""
    size = plane.extent(curve.even(_samples_of(curve))[:, :3])
    length = choices.tolerance or min(TOLERANCE, TOLERANCE_SHARE * size)
    noise = max(p.smoothed_noise for p in seen)
    angular = max(p.smoothed_angular_noise for p in seen)
    return Tolerance(max(length, 2.0 * noise), max(ANGLE, 2.0 * angular))


def _samples_of(curve: Curve) -> int:
    return len(curve.spline.c)


def lost_of(seen: Preprocessed) -> tuple[float, float]:
    """RMS and largest of what smoothing took off a recording beyond its noise, mm."""
    count = dense_count(len(seen.raw.position))
    smooth = seen.position(np.linspace(0.0, seen.duration, count))
    return _beyond_noise(nearest(seen.raw.position, smooth), seen.sigma)


def _beyond_noise(distance: Floats, noise: float) -> tuple[float, float]:
    explained = _ACROSS * noise**2 * (1.0 + _DOUBT / np.sqrt(len(distance)))
    rms = float(np.sqrt(max(0.0, float(np.mean(distance**2)) - explained)))
    return rms, max(0.0, float(distance.max()) - _OUTLYING * noise)


def with_lost(quality: Quality, lost: Sequence[tuple[float, float]]) -> Quality:
    """Add what smoothing lost to the skill's own error."""
    rms = max((loss[0] for loss in lost), default=0.0)
    largest = max((loss[1] for loss in lost), default=0.0)
    return Quality(
        float(np.hypot(quality.rms, rms)),
        max(quality.largest, largest),
        quality.end,
        quality.wave,
        quality.angle,
    )


def _skill(
    learned: Weights,
    problem: Problem,
    choices: FitOptions,
    found: Sequence[TaughtStroke],
    reached: Accuracy,
    taught: TaughtSurface | None,
    guessed: bool,
    spread: DemonstrationSpread | None,
    force: ForceProfile | None,
) -> Skill:
    curve, spring = problem.curve, problem.spring
    x = curve.even(_samples_of(curve))
    return Skill(
        model="modified",
        forcing_scale=None,
        spring=spring,
        alpha_1=choices.alpha_1,
        basis=learned.basis,
        weights=learned.weights,
        forcing_factor=np.ones(6),
        exempt=np.zeros(6, dtype=bool),
        alpha_f=learned.alpha_f,
        alpha_e=spring.k / spring.d,
        start=x[0],
        goal=x[-1],
        initial_velocity=learned.initial_velocity,
        duration=curve.duration,
        closed=problem.closed,
        frame=mean_frame(found, problem.closed),
        learning="tolerance",
        passes=learned.passes,
        surface=taught,
        heights=(float(x[:, 2].min()), float(x[:, 2].max())),
        side_guessed=guessed,
        reached=reached,
        spread=spread,
        force=force,
    )


def _profile(
    found: Sequence[TaughtStroke],
    alignment: Alignment | None,
    problem: Problem,
    learned: Weights,
    choices: FitOptions,
) -> ForceProfile | None:
    """Learn the force along the normal with the functions of the path; None is not asked for."""
    if not choices.force_profile:
        return None
    forces = []
    for i, d in enumerate(found, start=1):
        if d.force is None:
            raise InputError(f"demonstration {i}: --force-profile: has no force to learn")
        if float(np.mean(d.force > LEAST)) < _PRESSED:
            side = ""
            if float(np.mean(d.force < -LEAST)) >= _PRESSED:
                side = "; it pushes to the other side: turn the normal over with --normal"
            raise InputError(
                f"demonstration {i}: --force-profile: the tool is pushed along the normal by more "
                f"than {LEAST:g} N in {100.0 * float(np.mean(d.force > LEAST)):.0f} % of the "
                f"stroke{side or '; record it in contact, with a tool file whose zero is right'}"
            )
        forces.append(d.force[:, None])
    if alignment is not None:
        forces = [track.carry(f) for track, f in zip(alignment.tracks, forces, strict=True)]
    curve = Curve.through(np.mean(forces, axis=0), problem.curve.duration, len(forces[0]) - 1)
    passes = None if choices.regression == "ridge" else learned.passes
    *_, way = problem.ways(curve, len(learned.basis), choices.regression, passes)
    error = way.reproduced - way.demonstrated
    return ForceProfile(
        weights=way.weights[0],
        alpha_f=float(way.alpha_f[0]),
        start=float(way.demonstrated[0, 0]),
        goal=float(way.demonstrated[-1, 0]),
        initial_velocity=float(way.initial_velocity[0]),
        rms=float(np.sqrt(np.mean(error**2))),
        largest=float(np.abs(error).max()),
    )


def _spread(alignment: Alignment) -> DemonstrationSpread:
    """Scatter of the demonstrations at a few shares of the duration."""
    share = np.linspace(0.0, 1.0, _SPREAD)
    at = np.linspace(0.0, 1.0, len(alignment.spread))
    deviation = np.zeros((_SPREAD, 6))
    for axis, column in enumerate(alignment.spread.T):
        deviation[:, axis] = np.interp(share, at, column)
    return DemonstrationSpread(share, deviation)


def _own_reproduction(
    skill: Skill, curve: Curve, lost: tuple[float, float]
) -> ReproductionMeasures:
    """Roll the skill out at one of several demonstrations' own ends, in its own chart."""
    t = np.linspace(0.0, skill.duration, min(_samples_of(curve), _MOST_SHOWN))
    r, x = skill.response(t), curve(t)
    reproduced = r.between(skill, x[0], x[-1])
    return _reproduction(x, reproduced, with_lost(judged(x, reproduced, skill.closed), [lost]))


def _reproduction(
    demonstrated: Floats, reproduced: Floats, quality: Quality
) -> ReproductionMeasures:
    return ReproductionMeasures(
        demonstrated[:, :3],
        reproduced[:, :3],
        quality.rms,
        quality.largest,
        quality.end,
        quality.wave,
        quality.angle,
    )


def _prepared(demonstration: TaughtStroke, closed: bool) -> Prepared:
    """What reports and pictures show of a demonstration: at the recording's own sample times."""
    seen = demonstration.seen
    t = seen.raw.t
    position = seen.position(t)
    rotation = None if seen.rotation is None else seen.rotation(t)
    curve = demonstration.curve
    return Prepared(
        Trajectory(t, position, rotation),
        Signal(curve(t), curve(t, 1), curve(t, 2)),
        demonstration.frame,
        closed,
        float(np.sqrt(np.mean(np.sum((position - seen.raw.position) ** 2, axis=1)))),
        seen.trimmed,
        seen.cutoff,
        seen.raw.position,
        seen,
    )

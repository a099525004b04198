"""Learning as the paper has it: one regression with N functions, and alpha_f.

It serves the preset `paper`, whose figures are those of the paper, and the original model, which
knows no chart; `learning` learns by a tolerance.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.dmp.canonical_system import even_in_time, phase
from dmpcli.dmp.fit_result import Fit, ReproductionMeasures
from dmpcli.dmp.options import PAPER_BASIS, FitOptions, Model
from dmpcli.dmp.paper_preprocessing import Prepared, check_alike, prepare
from dmpcli.dmp.regression import METHODS, target_forcing
from dmpcli.dmp.skill import Response, Skill
from dmpcli.dmp.smoothing import Signal
from dmpcli.dmp.transformation_system import TransformationGains, critical
from dmpcli.spatial.trajectory import Trajectory

# An axis whose |g - x0| is below this part of the stroke's extent cannot carry the factor of (7).
NEARLY_ZERO = 1e-3
# A forced response below this part of the extent does not tell alpha_f.
_NEGLIGIBLE = 1e-9


def fit_as_paper(strokes: Sequence[Trajectory], choices: FitOptions) -> Fit:
    """Learn one skill from one or several demonstrations.

    Each demonstration is taken in its own chart, its time as t/T_i, its length along u scaled to
    the mean; all are stacked in one regression (7)-(8).

    Parameters
    ----------
    strokes : sequence of Trajectory
        At least one; all open or all closed, all with orientation or all without.
    choices : FitOptions

    Returns
    -------
    Fit
        The task frame, and with it R(0), is the first demonstration's.

    Raises
    ------
    InputError
        A stroke does not move, or the strokes do not match.
    """
    prepared = [prepare(stroke, choices) for stroke in strokes]
    check_alike(prepared)
    duration = float(np.mean([p.stroke.duration for p in prepared]))
    first = prepared[0]
    tau = choices.tau * duration
    d = np.full(6, choices.damping)
    spring = TransformationGains(critical(d), d, tau)
    basis = even_in_time(
        choices.basis or PAPER_BASIS, duration, tau, choices.alpha_1, choices.widths
    )

    length = float(np.mean([p.frame.length for p in prepared]))
    stretch = [_stretch(p, length, choices.model) for p in prepared]
    signals = [
        _rescaled(p.signal, r, p.stroke.duration / duration)
        for p, r in zip(prepared, stretch, strict=True)
    ]
    start = np.mean([g.x[0] for g in signals], axis=0)
    goal = np.mean([g.x[-1] for g in signals], axis=0)
    velocity = tau * np.mean([g.velocity[0] for g in signals], axis=0)
    factor, exempt = _factor(signals[0], choices)

    times = [np.linspace(0.0, duration, len(g.x)) for g in signals]
    s = phase(np.concatenate(times), tau, choices.alpha_1)
    forcing = np.concatenate(
        [target_forcing(spring, g.x[-1], g.x, g.velocity, g.acceleration) for g in signals]
    )
    regress = METHODS[choices.regression]
    if choices.model == "modified":
        weights = regress(basis, s, s, forcing)
    else:
        own = np.concatenate(
            [np.broadcast_to(_factor(g, choices, exempt)[0], g.x.shape) for g in signals]
        )
        weights = np.concatenate(
            [regress(basis, s, s * own[:, i], forcing[:, i : i + 1]) for i in range(6)]
        )

    original = choices.model == "original"
    skill = Skill(
        model=choices.model,
        forcing_scale=choices.forcing_scale if original else None,
        spring=spring,
        alpha_1=choices.alpha_1,
        basis=basis,
        weights=weights,
        forcing_factor=factor,
        exempt=exempt,
        alpha_f=np.ones(6),
        alpha_e=spring.k / spring.d,
        start=start,
        goal=goal,
        initial_velocity=velocity,
        duration=duration,
        closed=first.closed,
        frame=first.frame,
    )
    responses = [skill.response(t) for t in times]
    if not original:
        skill = replace(skill, alpha_f=_alpha_f(skill, responses, signals))
    reproductions = [
        _reproduce(skill, r, p, scale)
        for r, p, scale in zip(responses, prepared, stretch, strict=True)
    ]
    return Fit(skill, prepared, reproductions)


def _stretch(p: Prepared, length: float, model: Model) -> Floats:
    """Factors that bring a demonstration's coordinates to the mean length along u."""
    scale = np.ones(6)
    if model == "modified" and not p.closed:
        scale[0] = length / p.frame.length
    return scale


def _rescaled(signal: Signal, scale: Floats, time: float) -> Signal:
    return Signal(
        signal.x * scale, signal.velocity * scale * time, signal.acceleration * scale * time**2
    )


def _factor(
    signal: Signal, choices: FitOptions, exempt: Booleans | None = None
) -> tuple[Floats, Booleans]:
    """Factor beside s in eq. (7) per axis, and which axes go without it."""
    if choices.model == "modified":
        return np.ones(6), np.zeros(6, dtype=bool)
    difference = signal.x[-1] - signal.x[0]
    ranges = np.ptp(signal.x, axis=0)
    if exempt is None:
        size = np.repeat([np.linalg.norm(ranges[:3]), np.linalg.norm(ranges[3:])], 3)
        exempt = np.abs(difference) <= NEARLY_ZERO * size
        if choices.forcing_scale == "distance":
            exempt[:3] = np.linalg.norm(difference[:3]) <= NEARLY_ZERO * size[0]
            exempt[3:] = True
    if choices.forcing_scale == "distance":
        difference = np.full(6, np.linalg.norm(difference[:3]))
    return np.where(exempt, 1.0, difference), exempt


def _alpha_f(skill: Skill, responses: Sequence[Response], signals: Sequence[Signal]) -> Floats:
    """Factor per axis that brings the forced response closest to the demonstrations.

    With x = x_hom + alpha x_forced: ``alpha = <x_demo - x_hom, x_forced> / <x_forced, x_forced>``;
    1 where x_forced is negligible.
    """
    across, along = np.zeros(6), np.zeros(6)
    size = np.zeros(6)
    for r, signal in zip(responses, signals, strict=True):
        rest = signal.x - signal.x[0] * r.a - signal.x[-1] * r.b - skill.initial_velocity * r.c
        across += np.sum(rest * r.forced, axis=0)
        along += np.sum(r.forced**2, axis=0)
        ranges = np.ptp(signal.x, axis=0)
        extents = np.repeat([np.linalg.norm(ranges[:3]), np.linalg.norm(ranges[3:])], 3)
        size += len(signal.x) * extents**2
    told = along > _NEGLIGIBLE**2 * size
    return np.where(told, across / np.where(told, along, 1.0), 1.0)  # alpha_f of eq. (9)


def rolled_out(skill: Skill, p: Prepared, share: Floats) -> tuple[Floats, Floats]:
    """Roll the skill out at a demonstration's own start, goal, length and duration.

    Parameters
    ----------
    skill : Skill
    p : Prepared
    share : array, shape (T,)
        Of the duration, 0 to 1.

    Returns
    -------
    reproduced, demonstrated : array, shape (T, 6)
        In the demonstration's own coordinates.
    """
    length = float(skill.goal[0] - skill.start[0]) if skill.model == "modified" else 0.0
    r = skill.response(share * skill.duration)
    own = np.linspace(0.0, 1.0, len(p.signal.x))
    demonstrated = np.column_stack([np.interp(share, own, column) for column in p.signal.x.T])
    return _rolled(skill, r, p, _stretch(p, length, skill.model)), demonstrated


def _rolled(skill: Skill, r: Response, p: Prepared, stretch: Floats) -> Floats:
    scale = 1.0 / stretch
    if skill.model == "original":
        choices = FitOptions(model="original", forcing_scale=skill.forcing_scale or "axis")
        scale = _factor(p.signal, choices, skill.exempt)[0] / skill.forcing_factor
    return np.asarray(
        p.signal.x[0] * r.a
        + p.signal.x[-1] * r.b
        + scale * (skill.initial_velocity * r.c + skill.alpha_f * r.forced)
    )


def _reproduce(skill: Skill, r: Response, p: Prepared, stretch: Floats) -> ReproductionMeasures:
    """Roll the skill out at a demonstration's own start, goal, length and duration."""
    x = _rolled(skill, r, p, stretch)
    demonstrated, reproduced = p.signal.x[:, :3], x[:, :3]
    if skill.model == "original":
        demonstrated = (demonstrated - p.frame.start) @ p.frame.axes
        reproduced = (reproduced - p.frame.start) @ p.frame.axes
    error = np.linalg.norm(reproduced - demonstrated, axis=1)
    return ReproductionMeasures(
        demonstrated,
        reproduced,
        float(np.sqrt(np.mean(error**2))),
        float(error.max()),
        float(error[-1]),
    )

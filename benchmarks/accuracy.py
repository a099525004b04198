"""What the closed-form roll-out and the two regressions reach on the paper's stroke.

The roll-out is compared with ``scipy.integrate.solve_ivp`` (DOP853, rtol 1e-10) of the same
equations and weights; heights and errors with the noise-free stroke itself. ``make bench``.
"""

import numpy as np
from scipy.integrate import solve_ivp

from dmpcli.arrays import Floats
from dmpcli.dmp import reference_paths
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.generalization import draw
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.skill import Skill
from dmpcli.metrics.paper_values import EXPERIMENTS, REPRODUCTION, Experiment
from dmpcli.metrics.wave_height import stroke_wave
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory

UP = np.array([0.0, 0.0, 1.0])
PAPER = FitOptions(alpha_1=1.7, widths="power", learning="paper")
ROWS = {
    "modified, default, LWR": FitOptions(),
    "modified, default, ridge": FitOptions(regression="ridge"),
    "modified, paper preset": PAPER,
    "original, paper preset, literal (7)": FitOptions(
        "original", "axis", alpha_1=1.7, widths="power"
    ),
    "original, paper preset, by distance": FitOptions(
        "original", "distance", alpha_1=1.7, widths="power"
    ),
}


def reference() -> Trajectory:
    """Return the paper's stroke without hand, sensor or servo, 50 Hz."""
    t = np.linspace(0.0, 10.0, 501)
    start, goal = np.array(REPRODUCTION.start), np.array(REPRODUCTION.goal)
    position = reference_paths.sine(start, goal, REPRODUCTION.demonstration, t, 10.0)
    down = rotations.from_euler(np.tile([np.pi, 0.0, 0.0], (501, 1)))
    return Trajectory(t, position, down)


def height(position: Floats, experiment: Experiment, normal: Floats) -> float:
    """Return the wave height across the line of an experiment, mm; 0 where there is none."""
    start, goal = np.array(experiment.start), np.array(experiment.goal)
    return stroke_wave(position, start, goal, normal).mean or 0.0


def against_solve_ivp(skill: Skill) -> float:
    """Return the largest difference of the roll-out from the integrated equations, mm or rad."""
    t = np.linspace(0.0, skill.duration, 501)
    r = skill.response(t)
    found = (
        skill.start * r.a
        + skill.goal * r.b
        + skill.initial_velocity * r.c
        + skill.alpha_f * r.forced
    )
    k, d, tau = skill.spring.k, skill.spring.d, skill.spring.tau

    def motion(at: float, z: Floats) -> Floats:
        f = skill.alpha_f * skill.forcing(np.array(at))
        return np.concatenate([z[6:], k * (skill.goal - z[:6]) - d * z[6:] + f]) / tau

    solution = solve_ivp(
        motion,
        (0.0, skill.duration),
        np.concatenate([skill.start, skill.initial_velocity]),
        method="DOP853",
        rtol=1e-10,
        atol=1e-10,
        max_step=0.02,
        t_eval=t,
    )
    return float(np.abs(found - solution.y[:6].T).max())


def main() -> None:
    """Print a Markdown table."""
    stroke = reference()
    print("| noise-free stroke, mm | RMS | end | Table 1 | Table 2 | roll-out − solve_ivp |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    demonstrated = height(stroke.position, REPRODUCTION, UP)
    print(f"| demonstration | | | {demonstrated:.3f} | {demonstrated:.3f} | |")
    for name, choices in ROWS.items():
        result = fit([stroke], choices)
        r = result.reproductions[0]
        heights = []
        for experiment in EXPERIMENTS:
            pairs = Pairs(np.array([experiment.start]), np.array([experiment.goal]))
            drawn = draw(result.skill, pairs, np.array([10.0]), None, GeneralizeOptions())[0]
            heights.append(height(drawn.position, experiment, UP))
        print(
            f"| {name} | {r.rms:.5f} | {r.end:.5f} | {heights[0]:.3f} | {heights[1]:.3f} "
            f"| {against_solve_ivp(result.skill):.1e} |"
        )
    print("| paper, modified | | | 49.161 | 49.158 | |")
    print("| paper, original | | | 47.669 | 45.725 | |")


if __name__ == "__main__":
    main()

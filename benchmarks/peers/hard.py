"""Ten hard strokes beside other packages at the same N: RMS of what is given back.

``python -m benchmarks.peers.hard`` in the environment of `make peers`.
"""

import numpy as np
import torch
from movement_primitives.dmp import DMP
from mp_pytorch.mp import MPFactory

from benchmarks.peers.models import D, K
from dmpcli.arrays import Floats
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.spatial.trajectory import Trajectory
from tests import cases, human_strokes
from tests.nearest import nearest_rms

STEP = 1e-3
"""Finest step of mp-pytorch, by the duration: it prepares for as many steps squared."""

MOST = 320
"""N beyond which it takes minutes too."""

LASA = (("Worm", 0), ("Sharpc", 0), ("Leaf_1", 0))


def strokes() -> dict[str, tuple[Floats, Floats]]:
    """Times (T,), s, and positions (T, 3), mm, even in time."""
    t = np.arange(0.0, 150.001, 0.05)
    waves = np.column_stack([10.0 * t / 3.0, 20.0 * np.sin(2.0 * np.pi * t / 3.0), 0.0 * t])
    found = {
        "20 loops": cases.loops()[:, :4],
        "30 letters": cases.letters(),
        "30 corners": cases.corners(),
        "50 waves": np.column_stack([t, waves]),
        "pen lift": cases.pen_lift(),
        "hop": cases.hop(),
        "closed letter": cases.wall_letter(0.0),
    }
    split = {name: (table[:, 0], table[:, 1:4]) for name, table in found.items()}
    for shape, i in LASA:
        stroke = human_strokes.strokes(shape)[i]
        split[f"LASA {shape}"] = stroke.t - stroke.t[0], stroke.position
    return split


def ours(t: Floats, position: Floats, choices: FitOptions) -> tuple[int, Floats]:
    """N, and the reproduction (S, 3)."""
    result = fit([Trajectory(t, position)], choices)
    frame = result.skill.frame
    return len(result.skill.basis), (
        frame.start + result.reproductions[0].reproduced @ frame.axes.T
    )


def movement_primitives(t: Floats, position: Floats, count: int) -> Floats:
    """Reproduction (S, 3) by movement_primitives' DMP, Runge-Kutta steps."""
    t = t - t[0]
    dmp = DMP(3, t[-1], t[1], count, int_dt=t[1], alpha_y=D, beta_y=K / D)
    dmp.imitate(t, position)
    dmp.configure(start_y=position[0], goal_y=position[-1])
    return np.asarray(dmp.open_loop(step_function="rk4-cython")[1])


def prodmp(t: Floats, position: Floats, count: int) -> Floats:
    """Reproduction (S, 3) by mp-pytorch's ProDMP, double precision."""
    share = (t - t[0]) / (t[-1] - t[0])
    settings = {
        "num_basis": count,
        "basis_bandwidth_factor": 3,
        "num_basis_outside": 0,
        "alpha": D,
        "alpha_phase": float(np.log(100.0)),
        "dt": max(float(share[1]), STEP),
    }
    mp = MPFactory.init_mp("prodmp", settings, 3, 1.0, dtype=torch.float64)
    times, Y = torch.as_tensor(share), torch.as_tensor(position)
    params = mp.learn_mp_params_from_trajs(times[None], Y[None])["params"]
    velocity = torch.as_tensor(np.gradient(position, share[1], axis=0)[:1])
    zero = torch.zeros(1, dtype=torch.float64)
    mp.update_inputs(times[None], params, None, zero, Y[:1], velocity)
    return np.asarray(mp.get_traj_pos()[0].numpy())


def main() -> None:
    """Print a Markdown table."""
    torch.set_num_threads(1)
    print(
        "| RMS to the nearest point, mm | samples | N | dmpcli, lwr | dmpcli, ridge "
        "| movement-primitives | mp-pytorch ProDMP |\n"
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    )
    for name, (t, position) in strokes().items():
        count, by_lwr = ours(t, position, FitOptions(trim=False))
        if count > MOST:
            count, by_lwr = ours(t, position, FitOptions(trim=False, basis=MOST))
        _, by_ridge = ours(t, position, FitOptions(trim=False, basis=count, regression="ridge"))
        others = (movement_primitives(t, position, count), prodmp(t, position, count))
        errors = [nearest_rms(position, found) for found in (by_lwr, by_ridge, *others)]
        shown = " | ".join(f"{error:.4f}" for error in errors)
        print(f"| {name} | {len(t)} | {count} | {shown} |", flush=True)


if __name__ == "__main__":
    main()

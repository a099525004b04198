"""Each package behind the same questions: fit, roll out many pairs, and what its equations are."""

# ruff: noqa: D102 - the protocols say what the methods do

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import torch
from movement_primitives.dmp import DMP
from mp_pytorch.mp import MPFactory
from pydmps.dmp_discrete import DMPs_discrete

from dmpcli.arrays import Floats
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions, Method, Orientation
from dmpcli.dmp.rollout import Pairs, curves, poses
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.plane import pair_charts

BASIS, K, D = 80, 100.0, 20.0
"""Of every package, where it lets one choose: critically damped, time in units of tau."""


class Model(Protocol):
    """One package with its own settings."""

    name: str
    batch: int
    """Pairs that it rolls out at once."""

    def fit(self, t: Floats, Y: Floats) -> None:
        """Learn from poses Y (T, 6) at times t (T,), s."""
        ...

    def prepare(self, start: Floats, goal: Floats) -> Callable[[], object]:
        """Return what rolls out all pairs (B, 6), its inputs ready."""
        ...


class Peer(Model, Protocol):
    """Another's package, whose own equations can be solved with its own weights."""

    def reproduce(self) -> tuple[Floats, Floats]:
        """Return times and poses of the roll-out at the demonstrated ends."""
        ...

    def motion(self) -> Callable[[float], Floats]:
        """Return the forcing term (6,) of the time in units of tau."""
        ...


class MovementPrimitives:
    """movement_primitives.dmp.DMP, one pair after the other."""

    batch = 1

    def __init__(self, step: str) -> None:
        self.name, self.step = f"movement-primitives, {step}", step

    def fit(self, t: Floats, Y: Floats) -> None:
        self.t, self.Y = t, Y
        dt = t[1] - t[0]
        self.dmp = DMP(6, t[-1], dt, BASIS, int_dt=dt, alpha_y=D, beta_y=K / D)
        self.dmp.imitate(t, Y)

    def prepare(self, start: Floats, goal: Floats) -> Callable[[], object]:
        def run() -> None:
            for a, b in zip(start, goal, strict=True):
                self.dmp.configure(start_y=a, goal_y=b)
                self.dmp.open_loop(step_function=self.step)

        return run

    def reproduce(self) -> tuple[Floats, Floats]:
        self.dmp.configure(start_y=self.Y[0], goal_y=self.Y[-1])
        return self.dmp.open_loop(step_function=self.step)

    def motion(self) -> Callable[[float], Floats]:
        return lambda t: self.dmp.forcing_term(t * self.t[-1])[:, 0]


class PyDmps:
    """pydmps.DMPs_discrete, one pair after the other; it knows durations of 1 s only."""

    name, batch = "pydmps", 1

    def fit(self, t: Floats, Y: Floats) -> None:
        self.Y = Y
        gains = {"ay": np.full(6, D), "by": np.full(6, K / D)}
        self.dmp = DMPs_discrete(n_dmps=6, n_bfs=BASIS, dt=1.0 / len(t), **gains)
        self.dmp.imitate_path(Y.T)

    def prepare(self, start: Floats, goal: Floats) -> Callable[[], object]:
        def run() -> None:
            for a, b in zip(start, goal, strict=True):
                self.dmp.y0, self.dmp.goal = a, b
                self.dmp.rollout()

        return run

    def reproduce(self) -> tuple[Floats, Floats]:
        self.dmp.y0, self.dmp.goal = self.Y[0].copy(), self.Y[-1].copy()
        y = self.dmp.rollout()[0]
        # Its first sample is one step after the start.
        return np.arange(1, len(y) + 1) * self.dmp.dt, y

    def motion(self) -> Callable[[float], Floats]:
        factor = self.dmp.goal - self.dmp.y0

        def forcing(t: float) -> Floats:
            x = np.exp(-self.dmp.cs.ax * t)
            psi = self.dmp.gen_psi(x)
            return x * factor * (self.dmp.w @ psi) / psi.sum()

        return forcing


class ProDmp:
    """mp_pytorch's ProDMP, so many pairs at once."""

    def __init__(self, dtype: torch.dtype, batch: int) -> None:
        self.dtype, self.batch = dtype, batch
        self.name = f"mp-pytorch ProDMP, {str(dtype).removeprefix('torch.')}"

    def fit(self, t: Floats, Y: Floats) -> None:
        self.t = torch.as_tensor(t / t[-1], dtype=self.dtype)
        self.Y = torch.as_tensor(Y, dtype=self.dtype)
        if not hasattr(self, "mp"):
            # Half a second, once for all demonstrations of one length.
            self.mp = MPFactory.init_mp("prodmp", self.settings(t), 6, 1.0, dtype=self.dtype)
        learned = self.mp.learn_mp_params_from_trajs(self.t[None], self.Y[None])
        self.params = learned["params"]

    @staticmethod
    def settings(t: Floats) -> dict[str, Any]:
        """Return settings as near to the others' as they go."""
        return {
            "num_basis": BASIS,
            "basis_bandwidth_factor": 3,
            "num_basis_outside": 0,
            "alpha": D,
            "alpha_phase": float(np.log(100.0)),
            "dt": float((t[1] - t[0]) / t[-1]),
        }

    def prepare(self, start: Floats, goal: Floats) -> Callable[[], object]:
        first = torch.as_tensor(start, dtype=self.dtype)
        params = self.params.repeat(len(start), 1)
        params[:, BASIS :: BASIS + 1] = torch.as_tensor(goal, dtype=self.dtype)
        chunks = [slice(i, i + self.batch) for i in range(0, len(start), self.batch)]

        def run() -> None:
            for rows in chunks:
                self.roll_out(params[rows], first[rows])

        return run

    def roll_out(self, params: torch.Tensor, first: torch.Tensor) -> torch.Tensor:
        """Roll out some pairs, shape (B, T, 6)."""
        count = len(first)
        times = self.t.expand(count, -1)
        rest = torch.zeros_like(first)
        self.mp.update_inputs(
            times, params, None, torch.zeros(count, dtype=self.dtype), first, rest
        )
        return self.mp.get_traj_pos()

    def reproduce(self) -> tuple[Floats, Floats]:
        params = self.params.clone()
        y = self.roll_out(params, self.Y[:1])[0]
        return self.t.numpy().astype(float), y.numpy().astype(float)

    def motion(self) -> Callable[[float], Floats]:
        # In double precision: single would be a forcing term that no solver can follow.
        weights = self.params.reshape(6, -1)[:, :-1].numpy().astype(float)
        centres = self.mp.basis_gn.centers_p.numpy().astype(float)
        widths = self.mp.basis_gn.bandwidth.numpy().astype(float)

        def forcing(t: float) -> Floats:
            x = np.exp(-np.log(100.0) * t)
            psi = np.exp(-widths * (x - centres) ** 2 / 2.0)
            return x * (weights @ psi) / psi.sum()

        return forcing

    @property
    def goal(self) -> Floats:
        """Goal that it learned beside its weights."""
        return self.params.reshape(6, -1)[:, -1].numpy().astype(float)


class Ours:
    """dmpcli: charts, a full transform per pair and all poses into one fresh array."""

    batch = 1 << 30

    def __init__(self, orientation: Orientation, regression: Method = "lwr") -> None:
        self.orientation, self.regression = orientation, regression
        self.name = f"dmpcli, --orientation {orientation}"

    def fit(self, t: Floats, Y: Floats) -> None:
        stroke = Trajectory(t, Y[:, :3], rotations.from_euler(Y[:, 3:]))
        self.t = t
        self.result = fit([stroke], FitOptions(damping=D, basis=BASIS, regression=self.regression))

    def prepare(self, start: Floats, goal: Floats) -> Callable[[], object]:
        skill = self.result.skill
        shared = curves(skill, self.t)
        pairs = Pairs(start[:, :3].copy(), goal[:, :3].copy())

        def run() -> Floats:
            charts = pair_charts(pairs.start, pairs.goal, skill.frame.normal, skill.closed)
            return poses(skill, shared, pairs, charts, orientation=self.orientation)

        return run

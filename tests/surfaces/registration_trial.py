"""Trials of registration: a part touched at random with noise, begun from a rough pose."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError
from dmpcli.records import file_io, mesh
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces import pose_bound
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.registration import (
    LIMIT,
    RegisteredPart,
    onto_surface,
    starts_anywhere,
    starts_near,
)

PARTS = Path(__file__).parent / "parts"
FAR_SHIFT, FAR_TURN = 10.0, np.radians(10.0)
MOST_RESIDUAL = 1.0


class Outcome(NamedTuple):
    """What became of one trial.

    Attributes
    ----------
    verdict : {'accepted', 'free', 'residual', 'rival', 'uncertain'}
        Why the pose was refused, in the order of `register`.
    error : float
        Largest displacement of a point of the part from where it is, mm; NaN where it is free.
    bound : float
        What was stated of it, mm.
    """

    verdict: str
    error: float
    bound: float


def wedge():
    """A cast block with sloping sides, 110 × 70 × 45 mm, none like another."""
    corners = [(0, 0, 0), (110, 0, 0), (110, 70, 0), (0, 70, 0)]
    corners += [(8, 5, 45), (85, 9, 40), (96, 58, 28), (14, 63, 33)]
    made = trimesh.Trimesh(np.array(corners, dtype=float)).convex_hull
    return np.array(made.vertices, dtype=float), np.array(made.faces)


def part_of(name):
    """Return vertices and faces of a part: `wedge` or a file's stem."""
    if name == "wedge":
        return wedge()
    found = mesh.decode(file_io.read(PARTS / f"{name}.stl"))
    return found.V, found.F


def touched_on(V, F, count, rng, faces=None):
    """Points spread over a mesh, or over some of its faces, by area."""
    F = F if faces is None else F[faces]
    a, b, c = np.moveaxis(V[F], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = rng.choice(len(F), count, p=area / area.sum())
    return np.einsum("ki,kij->kj", rng.dirichlet([1.0, 1.0, 1.0], count), V[F[chosen]])


def motion(rng, angle=None, shift=500.0):
    """A random rigid motion: R, t."""
    turn = Rotation.random(rng=rng).as_rotvec()
    if angle is not None:
        turn *= angle / np.linalg.norm(turn)
    return Rotation.from_rotvec(turn).as_matrix(), rng.uniform(-shift, shift, 3)


def near(R, t, centre, rng, angle, shift):
    """A pose that is off by a turn about the part's centre and a shift."""
    turn, _ = motion(rng, angle)
    step = rng.standard_normal(3)
    return turn @ R, R @ centre + t - turn @ R @ centre + shift * step / np.linalg.norm(step)


def trial(V, F, part: RegisteredPart, count, seed, sigma=0.1, anywhere=False) -> Outcome:
    """Touch a part and register it.

    Parameters
    ----------
    V, F : arrays
        Of the part.
    part : RegisteredPart
        The same.
    count : int
        Touched points, random by area.
    seed : int
    sigma : float
        Of the touches, on each axis, mm.
    anywhere : bool
        Search all orientations, instead of about a start within 10 mm and 10°.
    """
    rng = np.random.default_rng([seed, count])
    R, t = motion(rng)
    points = touched_on(V, F, count, rng) @ R.T + t + sigma * rng.standard_normal((count, 3))
    middle = 0.5 * (V.min(axis=0) + V.max(axis=0))
    rough = near(R, t, middle, rng, FAR_TURN * rng.random(), FAR_SHIFT * rng.random())
    starts = starts_anywhere(points, part) if anywhere else starts_near(points, *rough)
    try:
        found = onto_surface(points, part, starts)
    except InputError:
        return Outcome("free", np.nan, np.nan)
    placed, true = Pose(found.position[None], found.rotation[None]), Pose(t[None], R[None])
    error = float(pose_bound.displacement(placed, true, part.extreme)[0])
    if found.residual.max() > MOST_RESIDUAL:
        verdict = "residual"
    elif found.rival is not None and found.rival.near:
        verdict = "rival"
    else:
        verdict = "accepted" if found.uncertainty <= LIMIT else "uncertain"
    return Outcome(verdict, error, found.uncertainty)


def loaded(name):
    """Return V, F and the `RegisteredPart` of a part."""
    V, F = part_of(name)
    return V, F, RegisteredPart.of(Mesh(V, F))

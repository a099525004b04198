"""Strokes taught on one curved surface and drawn on another, with the true strokes of both."""

from dataclasses import dataclass

import numpy as np

from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.generalization import draw
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.skill import TaughtSurface
from dmpcli.metrics.deviation import nearest_distance
from dmpcli.metrics.wave_height import wave_heights
from dmpcli.spatial.trajectory import Trajectory
from tests.surfaces import cases

DURATION = 6.0
SWING = 0.3
"""How far the tool turns against the surface as it goes, rad."""


def tool(axes):
    """Rotations (T, 3, 3) of a tool that points into the surface and turns against its chart."""
    r = np.linspace(0.0, 1.0, len(axes))
    a, b = SWING * np.sin(2 * np.pi * r), 0.5 * SWING * np.sin(3 * r)
    c, s, o, z = np.cos(a), np.sin(a), np.ones_like(a), np.zeros_like(a)
    about_n = np.stack(
        [np.stack([c, -s, z], -1), np.stack([s, c, z], -1), np.stack([z, z, o], -1)], -2
    )
    c, s = np.cos(b), np.sin(b)
    lean = np.stack(
        [np.stack([o, z, z], -1), np.stack([z, c, -s], -1), np.stack([z, s, c], -1)], -2
    )
    return axes @ about_n @ lean @ np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Carried:
    """What became of a stroke.

    Attributes
    ----------
    rms : float
        Distance to the true stroke, mm.
    wave : float
        Largest difference of a wave height, mm.
    turn : float
        Largest difference of the tool's orientation from the true one, degrees.
    status : int
    """

    rms: float
    wave: float
    turn: float
    status: int


def taught(name, mesh, case, i, choices):
    """Skill of the case's i-th stroke, taught on a mesh."""
    t = np.linspace(0.0, DURATION, case.position.shape[1])
    stroke = Trajectory(t, case.position[i], tool(case.axes[i]))
    return fit([stroke], choices, mesh, TaughtSurface("mesh", {})).skill


def carried(skill, mesh, case):
    """Draw a skill at all pairs of a case on a mesh, and hold it against the case."""
    start, goal = (mesh.closest(x).position for x in (case.start, case.goal))
    count, samples = case.position.shape[:2]
    first = np.stack([tool(axes)[0] for axes in case.axes])
    pairs = Pairs(start, goal, first)
    rate = (samples - 1) / DURATION
    style = GeneralizeOptions(rate=rate, orientation="surface")
    drawn = draw(skill, pairs, np.full(count, skill.duration), mesh, style)
    found = []
    for i, stroke in enumerate(drawn):
        true = case.position[i]
        off = nearest_distance(stroke.position, true)
        # v of a drawn point: that of the true one at the same time, and the gap along e_v.
        at = np.linspace(0.0, 1.0, len(stroke.position)), np.linspace(0.0, 1.0, samples)
        e_v = np.column_stack([np.interp(*at, c) for c in case.axes[i, :, :, 1].T])
        there = np.column_stack([np.interp(*at, c) for c in true.T])
        v = np.interp(*at, case.coordinates[i, :, 1])
        v = v + np.sum((stroke.position - there) * e_v, axis=1)
        heights = wave_heights(v).heights, wave_heights(case.coordinates[i, :, 1]).heights
        same = len(heights[0]) == len(heights[1])
        wave = np.abs(heights[0] - heights[1]).max() if same else np.inf
        R = _rotations(stroke.euler)
        truth = tool(case.axes[i])
        steps = np.minimum(np.arange(len(R)), samples - 1)
        cosine = (np.einsum("tij,tij->t", R, truth[steps]) - 1.0) / 2.0
        turn = float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max())
        found.append(
            Carried(float(np.sqrt(np.mean(off**2))), float(wave), turn, int(stroke.status))
        )
    return found


def _rotations(euler):
    from dmpcli.spatial import rotations

    return rotations.from_euler(euler)


def meshes(faces):
    """Meshes of the three surfaces, and the largest distance of each from the true one."""
    made = {name: cases.mesh(name, faces) for name in ("saddle", "bumpy", "cylinder")}
    return made, {name: cases.largest_error(name, mesh) for name, mesh in made.items()}


RIDGE = FitOptions(regression="ridge")
TIGHT = FitOptions(tolerance=0.02)

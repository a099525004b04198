"""Strokes that several tests learn from."""

import numpy as np

from dmpcli.dmp import reference_paths
from dmpcli.metrics.paper_values import REPRODUCTION
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from tests.minimum_jerk import minimum_jerk

START = np.array(REPRODUCTION.start)
GOAL = np.array(REPRODUCTION.goal)
HEIGHT = REPRODUCTION.demonstration


def paper_stroke(samples: int = 501, turning: bool = False) -> Trajectory:
    """The paper's noise-free stroke, 10 s, pen straight down; turning as it goes if asked."""
    t = np.linspace(0.0, 10.0, samples)
    angles = np.zeros((samples, 3))
    angles[:, 0] = np.pi
    if turning:
        r = t / 10.0
        s = minimum_jerk(r)
        angles += np.stack([0.2 * np.sin(6 * s), 0.15 * np.sin(4 * s), 0.5 * s], axis=1)
    position = reference_paths.sine(START, GOAL, HEIGHT, t, 10.0)
    return Trajectory(t, position, rotations.from_euler(angles))


def circle(samples: int = 401) -> Trajectory:
    """A closed stroke: a circle of radius 30 mm in a tilted plane, 8 s."""
    t = np.linspace(0.0, 8.0, samples)
    r = t / 8.0
    s = 2 * np.pi * minimum_jerk(r)
    flat = 30.0 * np.stack([np.cos(s) - 1.0, np.sin(s), 0 * s], axis=1)
    tilt = rotations.from_euler(np.array([0.2, -0.1, 0.4]))
    return Trajectory(t, np.array([100.0, 50.0, 20.0]) + flat @ tilt.T)

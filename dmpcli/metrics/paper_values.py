"""What the paper prints of its experiments on the flat plate (section 3.2.1)."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats

TOLERANCE = 1.0
"""A start or goal this near to the paper's is the paper's, mm."""


@dataclass(frozen=True)
class Experiment:
    """One of the paper's tables: a start-goal pair and the wave heights printed for it, mm."""

    table: int
    title: str
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    demonstration: float
    original: float
    modified: float

    def printed(self, role: str) -> float:
        """Wave height for ``demonstration``, ``original`` or ``modified``, mm."""
        return {
            "demonstration": self.demonstration,
            "original": self.original,
            "modified": self.modified,
        }[role]


REPRODUCTION = Experiment(
    1,
    "reproduction at the demonstrated start and goal",
    (-551.030, 131.399, -17.560),
    (-660.021, 130.034, -17.538),
    49.979,
    47.669,
    49.161,
)
GENERALIZATION = Experiment(
    2,
    "generalization to a new start and goal",
    (-701.698, 132.420, -17.538),
    (-807.597, 129.739, -17.518),
    49.979,
    45.725,
    49.158,
)
EXPERIMENTS = (REPRODUCTION, GENERALIZATION)


def experiment_at(start: Floats, goal: Floats) -> Experiment | None:
    """Return the paper's experiment between these points, or None.

    Parameters
    ----------
    start, goal : array, shape (3,)
        mm, base frame.
    """
    for experiment in EXPERIMENTS:
        off = [np.linalg.norm(start - np.array(experiment.start))]
        off.append(np.linalg.norm(goal - np.array(experiment.goal)))
        if max(off) <= TOLERANCE:
            return experiment
    return None

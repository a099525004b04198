"""The paper's experiments are recognised by their ends."""

import numpy as np
import pytest

from dmpcli.metrics.paper_values import EXPERIMENTS, experiment_at


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_a_pair_within_a_millimetre_is_the_papers(experiment):
    start, goal = np.array(experiment.start), np.array(experiment.goal)
    assert experiment_at(start + 0.5, goal - 0.5) is experiment
    assert experiment_at(start + np.array([1.1, 0, 0]), goal) is None
    assert experiment_at(start, goal + np.array([0, 0, 1.1])) is None
    assert experiment_at(goal, start) is None


def test_the_printed_heights_are_those_of_tables_1_and_2():
    printed = [
        [e.printed(r) for r in ("demonstration", "original", "modified")] for e in EXPERIMENTS
    ]
    assert printed == [[49.979, 47.669, 49.161], [49.979, 45.725, 49.158]]

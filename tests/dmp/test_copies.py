"""Copies side by side: what each of them keeps of its pair."""

import numpy as np

from dmpcli.dmp import copies
from dmpcli.dmp.rollout import Pairs
from dmpcli.spatial import rotations

START = np.array([[0.0, 0, 0], [5.0, 60, 0]])
R = rotations.exp(np.array([[0.1, 0.2, 0.3], [-0.4, 0.0, 1.0]]))


def test_each_pair_stands_as_often_as_it_is_asked_for_with_its_tool_and_shifted():
    pairs = copies.copied(Pairs(START, START + 40.0, R, R @ R[0]), 3, 8.0)
    assert len(pairs) == 6
    for i in range(6):
        np.testing.assert_array_equal(pairs.start[i], START[i // 3])
        np.testing.assert_array_equal(pairs.goal[i], START[i // 3] + 40.0)
        np.testing.assert_array_equal(pairs.start_rotation[i], R[i // 3])
        np.testing.assert_array_equal(pairs.goal_rotation[i], R[i // 3] @ R[0])
    assert pairs.shift.tolist() == [0.0, 8.0, 16.0] * 2


def test_without_a_tool_there_is_none_to_copy():
    pairs = copies.copied(Pairs(START, START + 40.0), 2, 5.0)
    assert pairs.start_rotation is None
    assert pairs.goal_rotation is None
    assert pairs.shift.tolist() == [0.0, 5.0] * 2

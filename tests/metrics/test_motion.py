"""Path length, speed and end errors of paths worked out by hand."""

import numpy as np
import pytest

from dmpcli.metrics.motion import motions, path_length


def test_length_of_a_circle_and_of_a_corner():
    a = np.linspace(0, 2 * np.pi, 10001)
    assert path_length(30 * np.column_stack([np.cos(a), np.sin(a), 0 * a])) == pytest.approx(
        60 * np.pi, rel=1e-6
    )
    assert path_length(np.array([[0.0, 0, 0], [3, 4, 0], [3, 4, 12]])) == 17.0


def test_length_peak_speed_and_ends_of_strokes_with_uneven_samples():
    t = np.array([1.0, 2.0, 2.5, 4.0, 5.0])
    one = np.array([[0.0, 0, 0], [3, 0, 0], [6, 0, 0], [6, 6, 0], [6, 6, 3]])
    other = np.array([[0.0, 3, 4], [1, 1, 1], [2, 2, 2], [5, 5, 5], [9, 9, 9]])
    both = np.stack([one, other], axis=1).transpose(2, 1, 0)
    goal = np.array([[6.0, 6, 3], [9, 9, 8.5]])
    found = motions(t, both, np.zeros((2, 3)), goal)
    rest = np.linalg.norm(np.diff(other, axis=0), axis=1)
    assert found.length == pytest.approx([15.0, rest.sum()])
    assert found.peak_speed == pytest.approx([6.0, (rest / [1.0, 0.5, 1.5, 1.0]).max()])
    assert found.start_error.tolist() == [0.0, 5.0]
    assert found.goal_error.tolist() == [0.0, 0.5]

"""Path length, speed and end errors of paths worked out by hand."""

import numpy as np
import pytest

from dmpcli.measures.path import duration, end_errors, path_length, peak_speed


def test_length_of_a_circle_and_of_a_corner():
    a = np.linspace(0, 2 * np.pi, 10001)
    assert path_length(30 * np.column_stack([np.cos(a), np.sin(a), 0 * a])) == pytest.approx(
        60 * np.pi, rel=1e-6
    )
    assert path_length(np.array([[0.0, 0, 0], [3, 4, 0], [3, 4, 12]])) == 17.0


def test_peak_speed_and_duration_of_uneven_samples():
    t = np.array([1.0, 2.0, 2.5, 4.0])
    p = np.array([[0.0, 0, 0], [3, 0, 0], [6, 0, 0], [6, 6, 0]])
    assert peak_speed(t, p) == 6.0
    assert duration(t) == 3.0


def test_end_errors_are_distances_to_the_intended_ends():
    p = np.array([[0.0, 3, 4], [1, 1, 1], [9, 9, 9]])
    assert end_errors(p, np.zeros(3), np.array([9.0, 9, 8.5])) == (5.0, 0.5)

"""The left Jacobian of rotations, beside differences."""

import numpy as np
import pytest

from dmpcli.spatial import rotations
from dmpcli.surfaces import mistouched


@pytest.mark.parametrize("size", [0.0, 3e-5, 9e-5, 1.1e-4, 0.02, 0.7, 2.5])
def test_the_left_jacobian_is_that_of_differences(size):
    w = size * np.array([0.6, -0.48, 0.64])
    J = mistouched._left_jacobian(w)
    back = rotations.exp(w).T
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-5
        ahead, behind = rotations.exp(w + step) @ back, rotations.exp(w - step) @ back
        slope = (rotations.log(ahead[None])[0] - rotations.log(behind[None])[0]) / 2e-5
        np.testing.assert_allclose(J[:, axis], slope, atol=2e-9)


@pytest.mark.parametrize("size", [1e-3, 5e-3])
def test_its_series_and_its_closed_form_meet(size):
    w = size * np.array([0.6, -0.48, 0.64])
    K = rotations.skew(w)
    series = np.eye(3) + K / 2.0 + K @ K / 6.0 + K @ K @ K / 24.0
    np.testing.assert_allclose(mistouched._left_jacobian(w), series, atol=1e-11)

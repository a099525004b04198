import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.spatial.rotations import exp_one, log_one


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 9.9e-5, 1.1e-4, 0.01, 1.0, 2.0, 2.2, 3.14])
def test_one_rotation_agrees_with_scipy_at_every_angle(angle):
    rng = np.random.default_rng(0)
    for _ in range(50):
        axis = rng.standard_normal(3)
        rotvec = angle * axis / np.linalg.norm(axis)
        R = Rotation.from_rotvec(rotvec).as_matrix()
        np.testing.assert_allclose(exp_one(rotvec), R, atol=3e-15)
        np.testing.assert_allclose(log_one(R), rotvec, rtol=1e-9, atol=1e-15)

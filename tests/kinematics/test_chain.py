from dataclasses import replace

import numpy as np
import pytest

from dmpcli.kinematics import chain, models
from dmpcli.spatial.rotations import log
from tests.kinematics import urdf
from tests.kinematics.jacobian import jacobian

EC66 = models.model("ec66")


@pytest.mark.slow
def test_the_chain_is_that_of_the_makers_urdf_in_position_and_orientation():
    q = np.random.default_rng(3).uniform(-2 * np.pi, 2 * np.pi, (100, 6))
    position, rotation = chain.forward(EC66, q)
    for i in range(len(q)):
        p, R = urdf.flange(q[i])
        assert position[i] == pytest.approx(p, abs=1e-9)
        assert np.abs(rotation[i] - R).max() < 1e-12


def test_any_leading_shape_gives_what_one_configuration_gives():
    q = np.random.default_rng(4).uniform(-3, 3, (2, 3, 6))
    position, rotation = chain.forward(EC66, q)
    assert position.shape == (2, 3, 3)
    assert rotation.shape == (2, 3, 3, 3)
    one = chain.forward(EC66, q[1, 2])
    assert np.array_equal(position[1, 2], one[0])
    assert np.array_equal(rotation[1, 2], one[1])
    assert np.array_equal(jacobian(EC66, q)[1, 2], jacobian(EC66, q[1, 2]))


def test_one_configuration_in_plain_floats_is_where_many_are():
    tilted = replace(EC66, alpha=EC66.alpha + np.arange(6) * 0.3, a=EC66.a + 7.0, d=EC66.d + 5.0)
    for arm in (EC66, tilted):
        for q in np.random.default_rng(6).uniform(-2 * np.pi, 2 * np.pi, (50, 6)):
            for one, many in zip(chain.forward_one(arm, q), chain.forward(arm, q), strict=True):
                np.testing.assert_allclose(one, many, rtol=0.0, atol=1e-9)


def test_the_jacobian_is_the_derivative_of_the_chain():
    step = 1e-6
    for q in np.random.default_rng(5).uniform(-3, 3, (50, 6)):
        J = jacobian(EC66, q)
        for i in range(6):
            ahead, behind = q.copy(), q.copy()
            ahead[i] += step
            behind[i] -= step
            p1, R1 = chain.forward(EC66, ahead)
            p0, R0 = chain.forward(EC66, behind)
            assert J[:3, i] == pytest.approx((p1 - p0) / (2 * step), abs=1e-5)
            assert J[3:, i] == pytest.approx(log(R1 @ R0.T) / (2 * step), abs=1e-8)


def test_a_moving_point_has_the_velocity_of_the_jacobian_and_of_a_small_step():
    rng = np.random.default_rng(3)
    arm, tip = models.model("ec66"), np.array([10.0, -20.0, 130.0])
    for _ in range(20):
        q, speeds = rng.uniform(-2.0, 2.0, (2, 6))
        position, rotation, velocity = chain.forward_moving(arm, q, speeds, tip)
        np.testing.assert_array_equal(position, chain.forward_one(arm, q)[0])
        np.testing.assert_array_equal(rotation, chain.forward_one(arm, q)[1])
        flange = jacobian(arm, q) @ speeds
        expected = flange[:3] + np.cross(flange[3:], rotation @ tip)
        np.testing.assert_allclose(velocity[:3], expected, atol=1e-9)
        np.testing.assert_allclose(velocity[3:], flange[3:], atol=1e-12)
        later = chain.forward_one(arm, q + 1e-6 * speeds)
        moved = (later[0] + later[1] @ tip - position - rotation @ tip) / 1e-6
        np.testing.assert_allclose(velocity[:3], moved, atol=0.01)

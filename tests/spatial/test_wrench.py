import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.spatial import wrench
from dmpcli.spatial.rotations import exp
from dmpcli.spatial.wrench import Tool

UPRIGHT = np.zeros(2)


def test_a_force_at_the_tcp_is_felt_at_the_sensor_with_its_lever():
    # 10 N along x at the end of a lever of 100 mm along z: 1 N·m about y.
    felt = wrench.to_sensor(np.array([10.0, 0, 0, 0, 0, 0]), np.eye(3), np.array([0.0, 0.0, 100.0]))
    np.testing.assert_allclose(felt, [10.0, 0, 0, 0, 1.0, 0])


@given(st.integers(0, 10_000))
def test_there_and_back_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    R, lever, w = exp(rng.standard_normal((7, 3))), 100 * rng.standard_normal(3), np.ones((7, 6))
    there = wrench.to_tcp(wrench.to_sensor(w, R, lever), R, lever)
    np.testing.assert_allclose(there, w, atol=1e-12)


@given(st.integers(0, 10_000))
def test_power_is_the_same_at_sensor_and_tcp(seed):
    # The oracle is virtual work: a rigid body's power does not depend on the point it is taken at.
    rng = np.random.default_rng(seed)
    R, lever = exp(rng.standard_normal(3)), 100 * rng.standard_normal(3)
    at_sensor = rng.standard_normal(6)
    turning, moving = rng.standard_normal(3), rng.standard_normal(3)
    power = at_sensor[:3] @ moving + 1000.0 * at_sensor[3:] @ turning
    tip = moving + np.cross(turning, lever)
    at_tcp = wrench.to_tcp(at_sensor, R, lever)
    assert at_tcp[:3] @ (R @ tip) + 1000.0 * at_tcp[3:] @ (R @ turning) == pytest.approx(power)


def test_weight_pulls_down_in_a_base_that_stands_upright():
    np.testing.assert_allclose(wrench.gravity(6.0, UPRIGHT), [0, 0, -6.0], atol=1e-15)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_inclination_turns_the_weight_and_keeps_its_size(u, v):
    load = wrench.gravity(6.0, np.array([u, v]))
    assert np.linalg.norm(load) == pytest.approx(6.0)
    # The plumb vector turned about x by -U, then about y by -V.
    expected = exp(np.array([0.0, -v, 0.0])) @ exp(np.array([-u, 0.0, 0.0])) @ [0.0, 0.0, -6.0]
    np.testing.assert_allclose(load, expected, atol=1e-12)


def test_the_weight_of_a_tool_that_points_down_hangs_on_the_sensors_z():
    R = np.diag([1.0, -1.0, -1.0])
    felt = wrench.of_weight(R, np.array([0.0, 0.0, -6.0]), np.array([10.0, 0.0, 50.0]))
    np.testing.assert_allclose(felt, [0, 0, 6.0, 0, -0.06, 0], atol=1e-15)


def test_lever_and_attitude_of_a_sensor_that_is_turned_on_its_flange():
    quarter = exp(np.array([0.0, 0.0, np.pi / 2]))
    tool = Tool(
        np.array([0.0, 10.0, 150.0]),
        np.eye(3),
        np.array([0.0, 0.0, 20.0]),
        quarter,
        0.0,
        np.zeros(3),
    )
    np.testing.assert_allclose(tool.lever, [10.0, 0.0, 130.0], atol=1e-12)
    np.testing.assert_allclose(tool.sensor_in_tcp, quarter, atol=1e-15)

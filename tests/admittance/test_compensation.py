import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.admittance.compensation import Compensation, LowPass, dead_band, rest_zero
from dmpcli.spatial import wrench
from dmpcli.spatial.rotations import exp
from dmpcli.spatial.wrench import Tool

seeds = st.integers(0, 10_000)


def some_tool(rng, zero=True):
    return Tool(
        tcp_position=100.0 * rng.standard_normal(3),
        tcp_rotation=exp(rng.standard_normal(3)),
        sensor_position=20.0 * rng.standard_normal(3),
        sensor_rotation=exp(rng.standard_normal(3)),
        weight=rng.uniform(0.0, 20.0),
        centre=50.0 * rng.standard_normal(3),
        inclination=0.3 * rng.standard_normal(2),
        zero=rng.standard_normal(6) if zero else None,
    )


def sensed(tool, rotation, external):
    """What a sensor feels, by Newton: forces add, torques add with r × F about its origin."""
    R = rotation @ tool.tcp_rotation.T @ tool.sensor_rotation  # base ← sensor
    in_flange = tool.tcp_position - tool.sensor_position
    arm = rotation @ tool.tcp_rotation.T @ in_flange  # sensor → TCP, base axes
    weight = wrench.gravity(tool.weight, tool.inclination)
    force = external[:3] + weight
    torque = (
        external[3:]
        + np.cross(arm, external[:3]) / 1000.0
        + np.cross(R @ tool.centre, weight) / 1000.0
    )
    zero = np.zeros(6) if tool.zero is None else tool.zero
    return np.concatenate([R.T @ force, R.T @ torque]) + zero


@pytest.mark.slow
@given(seeds)
def test_the_external_wrench_comes_back_under_any_attitude(seed):
    rng = np.random.default_rng(seed)
    tool, rotation = some_tool(rng), exp(3.0 * rng.standard_normal(3))
    external = np.concatenate([50.0 * rng.standard_normal(3), 3.0 * rng.standard_normal(3)])
    found = Compensation(tool)(sensed(tool, rotation, external), rotation)
    np.testing.assert_allclose(found, external, atol=1e-10)


@pytest.mark.slow
@given(seeds)
def test_a_zero_taken_at_rest_holds_in_every_other_attitude(seed):
    rng = np.random.default_rng(seed)
    tool, here, there = some_tool(rng), exp(rng.standard_normal(3)), exp(rng.standard_normal(3))
    readings = sensed(tool, here, np.zeros(6)) + 0.01 * np.array([[1.0], [-1.0]])
    zeroed = tool.with_zero(rest_zero(tool.with_zero(None), readings, here))
    np.testing.assert_allclose(zeroed.zero, tool.zero, atol=1e-12)
    external = rng.standard_normal(6)
    found = Compensation(zeroed)(sensed(tool, there, external), there)
    np.testing.assert_allclose(found, external, atol=1e-10)


def test_many_readings_at_once_are_as_one_by_one():
    rng = np.random.default_rng(0)
    tool, R, w = some_tool(rng), exp(rng.standard_normal((9, 3))), rng.standard_normal((9, 6))
    compensate = Compensation(tool)
    one_by_one = [compensate(a, b) for a, b in zip(w, R, strict=True)]
    np.testing.assert_allclose(compensate(w, R), one_by_one, atol=1e-12)


def test_the_low_pass_meets_a_step_to_63_percent_after_its_time_constant():
    low_pass = LowPass(cutoff=2.0, rate=1000.0)
    low_pass(np.zeros(6))
    for _ in range(round(1000.0 / (2.0 * np.pi * 2.0))):
        value = low_pass(np.ones(6))
    np.testing.assert_allclose(value, 1.0 - np.exp(-1.0), atol=2e-3)


def test_the_low_pass_starts_from_the_first_value():
    np.testing.assert_array_equal(LowPass(10.0, 100.0)(np.full(6, 3.0)), 3.0)


@given(seeds)
def test_the_dead_band_shortens_and_never_turns(seed):
    rng = np.random.default_rng(seed)
    value = np.concatenate([3.0 * rng.standard_normal(3), 0.2 * rng.standard_normal(3)])
    out = dead_band(value, 1.0, 0.05)
    for half, width in ((slice(0, 3), 1.0), (slice(3, 6), 0.05)):
        length = np.linalg.norm(value[half])
        np.testing.assert_allclose(np.linalg.norm(out[half]), max(length - width, 0.0), atol=1e-12)
        np.testing.assert_allclose(np.cross(out[half], value[half]), 0.0, atol=1e-12)


def test_the_dead_band_is_continuous_at_its_edge():
    edge = np.array([0.6, 0.8, 0, 0, 0, 0])
    np.testing.assert_array_equal(dead_band(edge, 1.0, 0.05), 0.0)
    assert np.linalg.norm(dead_band(edge * (1 + 1e-9), 1.0, 0.05)) == pytest.approx(0.0, abs=1e-8)

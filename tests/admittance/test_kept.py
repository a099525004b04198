"""Laws, filters and identified loads: results that are kept, see `tests/kept.py`."""

import numpy as np
import pytest

from dmpcli.admittance import (
    compensation,
    contact_estimation,
    force_coupling,
    force_law,
    force_stability,
    model,
    payload_identification,
)
from dmpcli.admittance.normal_estimation import NormalEstimator, carried, turned
from dmpcli.admittance.oscillation import AlternationDetector
from dmpcli.errors import DmpError
from dmpcli.spatial import rotations
from dmpcli.spatial.wrench import Tool
from tests.admittance.damping import smallest_damping
from tests.kept import Kept

KEPT = Kept(__file__)
LAW = model.AdmittanceLaw(
    np.array([5.0, 5.0, 6.0, 0.1, 0.1, 0.2]),
    np.array([90.0, 90.0, 80.0, 2.0, 2.0, 3.0]),
    np.array([0.0, 100.0, 0.0, 0.0, 1.0, 0.0]),
    0.008,
)


def rng():
    return np.random.default_rng(7)


@KEPT.case
def a_hand_that_leads():
    found: list = []
    for bounds in (None, model.Bounds(40.0, 300.0, 0.3, 2.0), model.Bounds(speed=20.0)):
        state = home = model.DragState(np.zeros(3), np.eye(3), np.zeros(6))
        for k in range(60):
            wrench = np.array(
                [12 * np.sin(0.1 * k), 8.0, -5 * np.cos(0.2 * k), 0.3, -0.2, 0.1 * k % 1]
            )
            state = model.move(LAW, state, wrench, home, bounds)
            if k % 12 == 11:
                found.append(state)
        for _ in range(5):
            state = model.brake(LAW, state, bounds or model.Bounds(40.0, 300.0, 0.3, 2.0))
        found.append(state)
    found.append(model.acceleration(LAW, np.arange(6.0), np.ones(6), 2 * np.ones(6)))
    return found


@KEPT.case
def forces_under_control():
    found: list = []
    for stiffness, delay in ((0.5, 0.02), (3.0, 0.06), (20.0, 0.1)):
        gains = force_law.by_rule(stiffness, delay, 0.02, 1.0)
        state = force_law.LawState()
        for k in range(40):
            state = force_law.advance(gains, state, 5.0 - 0.1 * k, 30.0)
        found += [gains, state, gains.softened(2.0)]
        found += [
            force_stability.growth(gains, s, delay) for s in (0.5 * stiffness, 3.0 * stiffness)
        ]
        found += [
            force_stability.is_stable(gains, s, delay) for s in (0.5 * stiffness, 9.0 * stiffness)
        ]
        found += [
            force_stability.is_safe(gains, s, delay, 0.6e-3) for s in (stiffness, 9.0 * stiffness)
        ]
        found += [
            force_stability.loop_matrix(gains, stiffness, delay, 0.6e-3),
            force_stability.steadied(gains.softened(0.3), stiffness, delay, 0.6e-3),
        ]
        found.append(smallest_damping(stiffness, delay, 0.02))
        found.append(smallest_damping(stiffness, delay, 0.02, 4.0))
    return found


@KEPT.case
def filters():
    found: list = []
    for args in (
        (100.0, 20.0, 5.0, 0.7, 0.05),
        (30.0, 20.0, 0.2, 0.7, 0.02),
        (400.0, 20.0, 1.0, 2.0, 0.01),
    ):
        one = force_coupling.discretize(*args)
        z = np.zeros(2)
        for k in range(20):
            z = force_coupling.follow(one, z, np.sin(k))
        found += [one, z]
    low = compensation.LowPass(10.0, 125.0)
    found += [force_coupling.fast_filter(0.4, 0.02), force_coupling.fast_filter(0.4, 0.02, 2.0)]
    found += [low(np.array([np.sin(k)] * 6)) for k in range(8)]
    values = np.array([0.5, -3.0, 1.0, 0.01, -0.4, 0.2])
    return [*found, compensation.dead_band(values, 1.0, 0.1)]


@KEPT.case
def contacts_estimated():
    depth = [0.1, 0.2, 0.35, 0.5, 0.61]
    force = [0.3, 0.45, 0.9, 1.2, 1.55]
    way = [(0.0, 0.0), (0.1, 0.0), (0.2, 0.02), (0.3, 0.5), (0.4, 1.4), (0.5, 2.0), (0.6, 2.0)]
    found: list = [contact_estimation.line(depth, force)]
    found.append(contact_estimation.delay_of_move(way, ((0.0, 0.0), (1.0, 2.0)), 0.02))
    for depths, forces in (
        ((0.1, 0.6), (0.3, 1.5)),
        ((0.1, 0.1001), (0.3, 1.5)),
        ((0.5, 0.1), (1.0, 1.2)),
    ):
        found.append(contact_estimation.static_stiffness(depths, forces, 0.05))
    test = contact_estimation.RiseTest(0.2)
    return [*found, [test.believed(0.1 * k, 3.0, 0.05 * k, 2.0) for k in range(30)]]


@KEPT.case
def swings():
    found: list = []
    for grow in (0.9, 1.0, 1.1):
        one = AlternationDetector(1.0, 4, 0.5)
        told = [one.feel(0.02 * k, 2.0 * grow**k * np.sin(1.1 * k) + 5.0) for k in range(60)]
        found += [told, one.swing, one.grows]
        one.reset()
        found.append(one.swing)
    return found


@KEPT.case
def tools_that_are_led_fast():
    found: list = []
    light = model.AdmittanceLaw(np.full(6, 0.02), np.full(6, 0.1), np.zeros(6), 0.02)
    bound = model.Bounds(60.0, 400.0, 0.5, 4.0)
    state = home = model.DragState(np.ones(3), rotations.exp(np.array([0.2, 0, 1.0])), np.zeros(6))
    for k in range(40):
        wrench = np.array([9.0, -5.0 * np.cos(0.3 * k), 2.0, 0.4, 0.1 * np.sin(k), -0.3])
        state = model.move(light, state, wrench, home, bound)
    found.append(state)
    for _ in range(9):
        state = model.brake(light, state, bound)
        found.append(state)
    return found


@KEPT.case
def normals_that_are_estimated():
    found: list = []
    for seed, friction in ((0, 0.2), (1, 0.6)):
        r, one = np.random.default_rng(seed), NormalEstimator(0.02, friction)
        for k in range(40):
            planned = np.array([np.sin(0.02 * k), 0.3 * np.cos(0.1 * k), 1.0])
            planned /= np.linalg.norm(planned)
            push = 5.0 * planned + r.normal(size=3) * (0.3 if k % 7 else 4.0)
            found.append(one.feel(push, [12.0, 4.0, 1.0] * r.normal(size=3), planned))
            if k % 5 == 0:
                found += [one.normal, one.friction, one.angle, one._P, one.heard]
        one.carry(np.array([0.1, -0.7, 0.2]) / np.sqrt(0.54))
        found.append(one.normal)
    for axis in np.eye(3):
        lean = rotations.exp(0.3 * axis) @ np.array([0.0, 0.6, 0.8])
        found += [carried(lean, np.array([0.0, 0.6, 0.8]), np.array([0.6, 0.0, 0.8]))]
        found += [turned(lean, axis, np.array([0.0, 0.6, 0.8]), 0.2, step) for step in (0.05, 9.0)]
    return found


@KEPT.case
def loops_of_any_delay():
    found: list = []
    for delay in (0.013, 0.05, 0.071):
        for gains in (
            force_law.ForceGains(0.02, 0.8, 0.3, np.inf, 0.02),
            force_law.by_rule(4.0, delay, 0.02, 0.1, 0.02),
        ):
            found += [gains, force_stability.loop_matrix(gains, 3.0, delay)]
            found += [force_stability.growth(gains, 3.0, delay)]
            found += [force_stability.steadied(gains, 30.0, delay, 2e-4)]
        found.append(smallest_damping(3.0, delay, 0.02, 0.4))
    state, gains = force_law.LawState(0.1, 2.0, 0.05), force_law.by_rule(2.0, 0.06, 0.02)
    for error, fastest in ((9.0, 1.0), (-9.0, 1.0), (0.3, 50.0), (2.0, 0.5)):
        state = force_law.advance(gains, state, error, fastest)
        found.append(state)
    return found


@KEPT.case
def loads_of_few_or_bad_poses():
    r = rng()
    found: list = []
    for n, tilt in ((3, 0.8), (5, 0.5), (7, 0.9), (12, 1.1)):
        R = rotations.exp(tilt * r.normal(size=(n, 3)))
        force = np.einsum("kji,j->ki", R, np.array([0.4, 0.3, -5.0]))
        sensed = np.hstack([force, np.cross([0.002, 0.001, 0.03], force)]) + 0.3
        sensed += 0.01 * r.normal(size=sensed.shape)
        sensed[n // 2] += [0.4, 0.0, -0.3, 0.02, 0.0, 0.05]
        for t in (None, np.cumsum(r.uniform(0.1, 0.3, n)), np.zeros(n)):
            try:
                found.append(payload_identification.identify(R, sensed, t))
            except DmpError as error:
                found.append(str(error))
    for R in (
        rotations.exp(np.linspace(0.0, 1.5, 6)[:, None] * [0.2588, 0.9659, 0.0]),
        rotations.exp(0.05 * r.normal(size=(5, 3))),
        rotations.exp(np.array([[0.0, 0, 0], [0.5, 0, 0]])),
    ):
        try:
            payload_identification.check_orientations(R)
        except DmpError as error:
            found.append(str(error))
    light = np.random.default_rng(3).normal(size=(8, 6))
    try:
        payload_identification.solve(rotations.exp(r.normal(size=(8, 3))), light)
    except DmpError as error:
        found.append(str(error))
    return found


@KEPT.case
def loads_identified():
    r = rng()
    R = rotations.exp(0.8 * r.normal(size=(14, 3))) @ rotations.from_euler(
        np.array([np.pi, 0.0, 0.0])
    )
    load = np.array([0.3, -0.2, -6.0])
    force = np.einsum("kji,j->ki", R, load)
    sensed = np.hstack([force, np.cross([0.001, -0.002, 0.045], force)]) + [
        1.2,
        -0.8,
        3.5,
        0.02,
        -0.03,
        0.01,
    ]
    sensed += np.array([0.02] * 3 + [8e-4] * 3) * r.normal(size=sensed.shape)
    sensed[5, 2] += 0.5
    t = 10.0 * np.arange(14.0)
    drifting = sensed + np.outer(t, [1e-3, 0, 2e-3, 0, 0, 0])
    found: list = [payload_identification.condition(R), payload_identification.condition(R[:4])]
    for x, more in ((sensed, {}), (drifting, {"t": t})):
        one = payload_identification.identify(R, x, **more)
        found += [one, one.rms, one.largest]
    one = payload_identification.solve(R, sensed)
    found += [one, payload_identification.residuals(one, R, sensed, None)]
    tool = Tool(
        np.array([10.0, 0, 120]),
        np.eye(3),
        np.array([0.0, 0, 20]),
        np.eye(3),
        6.0,
        np.array([1.0, -2, 45]),
        np.array([0.02, -0.01]),
        sensed[0],
    )
    found += [
        compensation.rest_zero(tool, sensed[1], R[1]),
        compensation.Compensation(tool)(sensed[2], R[2]),
    ]
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", KEPT.cases)
def test_results_are_those_that_were_kept(name):
    KEPT.check(name)

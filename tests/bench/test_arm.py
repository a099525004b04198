"""The arm of the bench: where it stands, how it follows, how it gives way."""

import numpy as np
import pytest

from dmpcli.bench.joint_servos import JointReference
from dmpcli.bench.parameters import BenchParameters, JointServos
from dmpcli.bench.workpiece import Nothing
from dmpcli.errors import InputError, RefusedError
from dmpcli.extras import BENCH
from dmpcli.kinematics import chain
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp_one
from tests.bench.worlds import PERIOD, TIP, at, press, world
from tests.extras_here import needs
from tests.kinematics.jacobian import jacobian

pytestmark = needs(BENCH)


@pytest.mark.parametrize("arm", ["ec66", "ur5e"])
def test_it_stands_where_its_published_kinematics_say(arm):
    bench = world(Nothing(), arm=arm)
    flange, rotation = chain.forward_one(bench.arm, bench.joints)
    tool = bench.parameters.tool
    np.testing.assert_allclose(
        bench.pose.position, flange + rotation @ tool.tcp_position, atol=1e-9
    )
    np.testing.assert_allclose(bench.pose.position, TIP, atol=1e-9)
    np.testing.assert_allclose(bench.pose.rotation, bench.parameters.rotation, atol=1e-12)


@pytest.mark.parametrize("arm", ["ec66", "ur5e"])
def test_mujocos_frames_are_those_of_the_kinematics_in_any_posture(arm):
    bench, rng = world(Nothing(), arm=arm), np.random.default_rng(1)
    for q in rng.uniform(-2.5, 2.5, (20, 6)):
        bench._data.qpos[:6] = q
        bench._mujoco.mj_forward(bench._model, bench._data)
        flange, rotation = chain.forward_one(bench.arm, q)
        tool = bench.parameters.tool
        np.testing.assert_allclose(
            bench.pose.position, flange + rotation @ tool.tcp_position, atol=1e-9
        )
        np.testing.assert_allclose(bench.pose.rotation, rotation @ tool.tcp_rotation, atol=1e-12)


def test_it_holds_its_own_weight_and_the_tools():
    bench = world(Nothing())
    bench.advance(1.0)
    np.testing.assert_allclose(bench.pose.position, TIP, atol=1e-9)
    assert abs(bench.compression) < 1e-9


@pytest.mark.parametrize("lag", [0.01, 0.025, 0.08])
def test_a_joint_takes_a_step_as_a_critically_damped_servo_does(lag):
    step = 1e-3
    reference = JointReference(np.zeros(6), lag, 0.0, step)
    reference.start(step)  # taken up within one step of the grid
    reference.send(0.0, np.full(6, 0.1))
    found, t = [], 0.0
    while t < 0.3:
        moved = reference.advance(t, 7)
        found.append(moved.position)
        t += step * len(moved.position)
    times = step * np.arange(1, sum(map(len, found)) + 1)
    w = 2.0 / lag

    # The answer to a ramp of one step, from that to a ramp without an end.
    def ramp(t):
        t = np.maximum(t, 0.0)
        return t - lag + (lag + t) * np.exp(-w * t)

    expected = 0.1 / step * (ramp(times) - ramp(times - step))
    np.testing.assert_allclose(np.concatenate(found)[:, 2], expected, atol=1e-12)


def test_the_arm_is_where_the_servos_lead_it_while_nothing_is_touched():
    bench = world(Nothing())
    for k in range(60):
        bench.step(
            PERIOD, at(bench, 30.0 * np.sin(0.1 * k), 0.4 * k, 20.0 - 20.0 * np.cos(0.1 * k))
        )
        if k:
            np.testing.assert_allclose(bench.joints, bench.reference.position, atol=1e-3)


def test_behind_set_points_that_move_evenly_it_is_late_by_lag_delay_and_a_period():
    lag, delay, speed = 0.025, 0.04, 40.0
    bench = world(Nothing(), servos=JointServos(lag=lag, delay=delay))
    for k in range(100):
        pose, _ = bench.step(PERIOD, at(bench, 0.0, -speed * PERIOD * k, 0.0))
    # The last one was sent a period ago.
    late = (TIP[1] - pose.position[1]) / speed
    assert PERIOD * 100 - late == pytest.approx(lag + delay + PERIOD, abs=2e-3)


def test_set_points_may_come_while_others_are_on_their_way():
    sparse, often = (JointReference(np.zeros(6), 0.025, 0.05, 1e-3) for _ in range(2))
    for one in (sparse, often):
        one.start(PERIOD)
    for k in range(20):
        for one in (sparse, often):
            one.send(k * PERIOD, np.full(6, 0.01 * k))
        left = 20
        while left:
            left -= len(sparse.advance(0.02 * k + 1e-3 * (20 - left), left).position)
        for i in range(20):
            often.advance(0.02 * k + 1e-3 * i, 1)
    np.testing.assert_allclose(sparse.position, often.position, atol=1e-14)
    assert sparse.position[0] > 0.1


def test_a_load_bends_it_as_its_joints_stiffness_says():
    bench = world()
    press(bench, 3.0)
    J = jacobian(bench.arm, bench.joints)
    flange, _ = chain.forward_one(bench.arm, bench.joints)
    lever = bench.pose.position - flange
    # The TCP's rows, mm/rad; N·m/rad are 1000 N·mm/rad.
    rows = J[:3] + np.cross(J[3:].T, lever).T
    force = bench.contact_force
    bent = (rows / (1e3 * bench.parameters.servos.stiffness)) @ rows.T @ force
    led, _ = chain.forward_one(bench.arm, bench.reference.position)
    tip = led + chain.forward_one(bench.arm, bench.reference.position)[1] @ np.array([0, 0, 160.0])
    np.testing.assert_allclose(bench.pose.position - tip, bent, atol=0.01 * np.linalg.norm(bent))
    np.testing.assert_allclose(bench.compliance @ force, bent, rtol=1e-6, atol=1e-6)


def test_a_stop_holds_it_where_it_is():
    bench = world(Nothing())
    for k in range(20):
        bench.step(PERIOD, at(bench, 0.0, -1.0 * k, 0.0))
    before = bench.pose.position
    bench.stand_still()
    bench.advance(bench.t + 0.5)
    assert np.linalg.norm(bench.pose.position - before) < 0.5


def test_what_it_cannot_be_is_refused():
    with pytest.raises(InputError, match="no arm 'ec12'; it has ec66, ur5e"):
        world(arm="ec12")
    with pytest.raises(RefusedError):
        world(position=np.array([-3000.0, 0.0, 0.0]))
    with pytest.raises(InputError, match=r"too long for a pen of 2 N/mm .* at most 0\.0017 s"):
        world(step=2e-3)
    assert BenchParameters().grid == 1e-3


def test_a_turned_tool_is_led_too():
    bench = world(Nothing())
    turned = exp_one(np.array([0.2, 0.1, 0.0])) @ bench.parameters.rotation
    for _ in range(40):
        pose, _ = bench.step(PERIOD, Pose(TIP, turned))
    np.testing.assert_allclose(pose.rotation, turned, atol=1e-6)
    np.testing.assert_allclose(pose.position, TIP, atol=1e-4)

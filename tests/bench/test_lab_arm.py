"""The bench behind the virtual lab: the same controller, another physics."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.bench.lab_arm import BenchArm
from dmpcli.errors import InputError
from dmpcli.extras import BENCH
from dmpcli.kinematics.models import model
from dmpcli.simulation.elite_server.joint_arm import JointArm
from dmpcli.simulation.elite_server.lab import LabParameters, VirtualLab, parked
from dmpcli.simulation.elite_server.workpiece import SpringWorkpiece, facing
from dmpcli.simulation.mock import PEN, PEN_DOWN
from dmpcli.simulation.mock.parameters import Plate, SensorParameters
from dmpcli.spatial import wrench
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere
from tests.extras_here import needs

pytestmark = needs(BENCH)

TIP = np.array([-551.0, 131.0, -17.0])
UP = np.array([0.0, 0.0, 1.0])
QUIET = SensorParameters(noise=np.zeros(6), drift=np.zeros(6))
PLATE = Plate(point=TIP, normal=UP)


def setting(**more):
    return LabParameters(position=TIP, sensor=QUIET, **more)


def joints_at(x=0.0, y=0.0, z=0.0):
    return parked(model("ec66"), PEN, Pose(TIP + [x, y, z], PEN_DOWN))


def led(arm, goal, seconds=1.0):
    """Lead the arm to joint angles within a second, and wait."""
    legs = [(goal, 1.0)]
    arm.feed = lambda _: legs.pop() if legs else None
    for _ in range(round((1.0 + seconds) / 2e-3)):
        arm.advance(2e-3)


@pytest.mark.slow
def test_in_the_air_it_comes_to_rest_where_the_joints_without_physics_do():
    goal = joints_at(20.0, -10.0, 30.0)
    springs = JointArm(model("ec66"), PEN, joints_at())
    physics = BenchArm(setting(), joints_at())
    for arm in (springs, physics):
        led(arm, goal)
    np.testing.assert_allclose(physics.joints, springs.joints, atol=1e-6)
    np.testing.assert_allclose(physics.posture.position, TIP + [20.0, -10.0, 30.0], atol=1e-3)
    assert np.abs(physics.speeds).max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("ground", [PLATE, facing(Plane(TIP, -UP), TIP + UP, -UP)])
def test_the_lab_feels_the_parts_stiffness_as_that_of_the_pen(ground):
    lab = VirtualLab(setting(ground=ground, physics=BenchArm), clock=lambda: 0.0)
    arm = lab.controller.arm
    led(arm, joints_at(0.0, 0.0, -1.0))
    R = arm.posture.rotation @ PEN.sensor_in_tcp
    weight = wrench.of_weight(R, wrench.gravity(PEN.weight, PEN.inclination), PEN.centre)
    felt = wrench.to_tcp(lab.wrench(0.0) - PEN.zero - weight, R, PEN.lever)
    np.testing.assert_allclose(felt[:2], 0.0, atol=0.6)  # it may rest by friction
    # A pen of 5 N/mm before an arm of some 240.
    assert felt[2] == pytest.approx(5.0, rel=0.05)
    # The controller takes it for arrived although it presses.
    assert np.abs(arm.command - arm.joints).max() < 1e-4


def test_a_stop_holds_the_joints():
    arm = BenchArm(setting(), joints_at())
    arm.feed = lambda _: (joints_at(0.0, 50.0, 0.0), 1.0)
    for _ in range(100):
        arm.advance(2e-3)
    arm.stand_still()
    there = arm.posture.position
    arm.advance(0.5)
    assert np.linalg.norm(arm.posture.position - there) < 1.0
    assert arm.idle


def test_a_part_that_is_touched_from_inside_is_refused_unless_it_can_be_turned():
    inside = SpringWorkpiece(Sphere(TIP + 50.0 * UP, 50.0), sign=-1.0)
    with pytest.raises(InputError, match="from inside"):
        BenchArm(replace(setting(), ground=inside), joints_at())

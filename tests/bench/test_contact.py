"""The pen on its surface, and what the sensor makes of it: statics, friction, noise."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.admittance.compensation import Compensation
from dmpcli.bench.parameters import BenchParameters, Pen, WristSensor
from dmpcli.bench.workpiece import Edge, Flat, Nothing, Ramp, Round, Slot, Step, Traced, moved
from dmpcli.control.met_wall import against, met
from dmpcli.extras import BENCH
from dmpcli.simulation.mock import PEN
from dmpcli.spatial import wrench
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp_one
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.plane import Plane
from tests.bench.worlds import FRAME, PERIOD, QUIET, TIP, UP, at, press, slide, world
from tests.extras_here import needs

pytestmark = needs(BENCH)


@pytest.mark.slow
@pytest.mark.parametrize("k", [0.5, 2.0, 5.0, 20.0, 60.0])
def test_the_true_force_is_the_pens_spring_and_the_arms_one_after_the_other(k):
    bench, forces = world(pen=Pen(stiffness=k)), []
    for depth in (0.5, 1.5):
        press(bench, depth)
        force = bench.contact_force
        forces.append(np.linalg.norm(force))
        assert forces[-1] == pytest.approx(k * bench.compression, rel=1e-4)
        # MuJoCo's contact is a spring too: of some 2000 N/mm.
        assert abs(bench.tip[2] - TIP[2]) < 0.05
    normal = bench.parameters.workpiece.pose.rotation[:, 2]
    along = float(normal @ bench.pose.rotation[:, 2]) ** 2
    both = 1.0 / (along / k + float(normal @ bench.compliance @ normal))
    assert forces[1] - forces[0] == pytest.approx(both, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 10.0])
def test_a_pen_that_is_pressed_rests(tilt):
    bench = world(Flat(moved(FRAME, 0.0, np.radians(tilt), 0.3)))
    press(bench, 2.0)
    forces = []
    for _ in range(200):
        bench.advance(bench.t + 1e-3)
        forces.append(bench.contact_force)
    assert np.std(forces, axis=0).max() < 1e-3
    # It rests by friction where that is enough: 0.2 against tan 10° = 0.18 is.
    assert np.linalg.norm(forces[-1]) > 3.0


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("k", [0.5, 20.0])
@pytest.mark.parametrize("mu", [0.0, 0.2, 0.6])
def test_a_pen_that_slides_rubs_by_coulombs_law_and_does_not_rattle(k, mu):
    bench = world(pen=Pen(stiffness=k, friction=mu))
    press(bench, 2.0)
    forces, tips = slide(bench, 2.0, 30.0, 0.5)
    moving = forces[300:]
    normal = moving[:, 2]
    across = np.hypot(moving[:, 0], moving[:, 1])
    np.testing.assert_allclose(across, mu * normal, rtol=1e-6, atol=1e-9)
    assert (moving[:, 0] <= 0.0).all()  # against the motion along +x
    assert normal.min() > 0.95 * normal.mean()
    assert normal.max() < 1.05 * normal.mean()
    assert np.abs(tips[:, 2] - TIP[2]).max() < 0.05


@pytest.mark.slow
def test_friction_never_leaves_its_cone():
    bench = world()
    press(bench, 2.0)
    forces, _ = slide(bench, 2.0, 1.0, 1.0)  # slower than where it is full
    assert (np.hypot(forces[:, 0], forces[:, 1]) <= 0.2 * forces[:, 2] * (1.0 + 1e-9)).all()


@pytest.mark.parametrize("attitude", [(0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, -0.5, 0.3)])
def test_at_rest_the_sensor_feels_the_tools_weight_at_its_centre(attitude):
    turned = exp_one(np.array(attitude)) @ BenchParameters().rotation
    bench = world(Nothing(), rotation=turned)
    bench.advance(0.5)
    tool = bench.parameters.tool
    expected = wrench.of_weight(
        turned @ tool.sensor_in_tcp, wrench.gravity(tool.weight, tool.inclination), tool.centre
    )
    # A pen that hangs differently from at first slides by its own weight: micrometres.
    np.testing.assert_allclose(bench.felt(), expected, atol=2e-3)


def test_the_sensor_feels_the_weight_of_an_inclined_base():
    tool = replace(PEN, inclination=np.array([0.2, -0.1]), zero=None)
    bench = world(Nothing(), tool=tool)
    bench.advance(0.5)
    load = wrench.gravity(tool.weight, tool.inclination)
    expected = wrench.of_weight(bench.parameters.rotation @ tool.sensor_in_tcp, load, tool.centre)
    np.testing.assert_allclose(bench.felt(), expected, atol=2e-3)


def test_what_the_sensor_reads_is_the_contact_once_the_tool_is_taken_off():
    sensor_turned = exp_one(np.array([0.0, 0.0, 0.7]))
    tool = replace(PEN, sensor_rotation=sensor_turned, zero=None)
    bench = world(tool=tool)
    press(bench, 2.0)
    slide(bench, 2.0, 10.0, 0.3)
    for _ in range(40):
        _, felt = bench.step(PERIOD)
    by_hand = Compensation(tool)(bench.sensed(), bench.pose.rotation)
    np.testing.assert_allclose(felt, by_hand, atol=1e-12)
    np.testing.assert_allclose(felt[:3], bench.contact_force, atol=5e-3)
    # The force acts at the tip, which the spring has let move off the TCP.
    lever = (bench.tip - bench.pose.position) / 1e3
    np.testing.assert_allclose(felt[3:], np.cross(lever, bench.contact_force), atol=2e-3)


def test_noise_bias_and_zero_are_as_asked_for():
    noise = np.array([0.05, 0.05, 0.05, 1e-3, 1e-3, 1e-3])
    bias = np.array([0.1, -0.2, 1.2, 0.0, 0.01, 0.0])
    tool = replace(PEN, zero=np.array([1.0, 0.0, -2.0, 0.0, 0.0, 0.1]))
    bench = world(Nothing(), sensor=WristSensor(noise=noise, bias=bias), tool=tool)
    read = np.array([bench.sensed() for _ in range(4000)]) - bench.felt()
    np.testing.assert_allclose(read.std(axis=0), noise, rtol=0.05)
    assert (np.abs(read.mean(axis=0) - bias - tool.zero) < 5.0 * noise / np.sqrt(4000)).all()
    # White: what comes next knows nothing of what was.
    white = read - read.mean(axis=0)
    assert (np.abs(np.mean(white[1:] * white[:-1], axis=0)) < 0.1 * noise**2).all()


def test_a_zero_drifts_evenly():
    drift = np.array([0.0, 0.1, -0.3, 0.0, 0.0, 0.0])
    bench = world(Nothing(), sensor=WristSensor(noise=np.zeros(6), drift=drift))
    before = bench.sensed() - bench.felt()
    bench.advance(2.0)
    np.testing.assert_allclose(bench.sensed() - bench.felt() - before, 2.0 * drift, atol=1e-9)


def test_the_same_seed_reads_the_same_and_another_one_does_not():
    one, same, other = (world(sensor=WristSensor(), seed=seed).sensed() for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, same)
    assert not np.allclose(one, other, atol=1e-6)


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("native", "shape"),
    [
        (Flat(moved(FRAME, 0.0, 0.1, 0.4)), Plane(np.zeros(3), UP)),
        (
            Round(FRAME, 60.0),
            Cylinder(np.array([0.0, 0.0, -60.0]), np.array([0.0, 1.0, 0.0]), 60.0),
        ),
    ],
    ids=["plane", "cylinder"],
)
def test_a_surface_by_its_closest_point_pushes_like_mujocos_own(native, shape):
    forces = []
    for workpiece in (native, Traced(native.pose, shape)):
        bench = world(workpiece)
        press(bench, 2.0)
        forces.append(slide(bench, 2.0, 20.0, 0.2)[0])
    np.testing.assert_allclose(forces[0], forces[1], atol=0.02)
    assert forces[0][:, 2].min() > 1.0


@pytest.mark.slow
def test_on_a_cylinder_the_pen_follows_the_circle():
    bench = world(Round(FRAME, 60.0))
    press(bench, 4.0)
    _, tips = slide(bench, 4.0, 15.0, 1.0)
    x, z = (tips - TIP)[:, 0], (tips - TIP)[:, 2]
    # The ball of 1 mm rides on the circle: its middle is at R + 1, and the tip 1 mm below it.
    np.testing.assert_allclose(z, np.sqrt(61.0**2 - x**2) - 61.0, atol=0.02)
    assert x.max() > 12.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("workpiece", "before", "after"),
    [
        (Step(FRAME, 10.0, -2.0), 0.0, -2.0),
        (Ramp(FRAME, 10.0, 2.0, np.radians(30.0)), 0.0, 2.0),
        (Edge(FRAME, 10.0), 0.0, None),
        (Slot(FRAME, 40.0, 5.0), 0.0, 0.0),
    ],
    ids=["step", "ramp", "edge", "slot"],
)
def test_what_is_in_the_way_lies_where_it_is_said_to(workpiece, before, after):
    bench = world(workpiece)
    press(bench, 3.0)
    forces, tips = slide(bench, 3.0, 25.0, 1.0)
    x, z = (tips - TIP)[:, 0], (tips - TIP)[:, 2]
    np.testing.assert_allclose(z[x < 8.5], before, atol=0.05)
    behind = x > 17.0
    assert behind.any()
    if after is None:
        assert (forces[behind] == 0.0).all()
    else:
        np.testing.assert_allclose(z[behind], after, atol=0.05)
    if isinstance(workpiece, Ramp):
        # In the middle of the ramp, by its slope; the ball touches beside its lowest point.
        on = (x > 11.0) & (x < 12.5)
        beside = 1.0 - 1.0 / np.cos(np.radians(30.0))
        expected = (x[on] - 10.0) * np.tan(np.radians(30.0)) - beside
        np.testing.assert_allclose(z[on], expected, atol=0.05)


def test_at_a_wall_the_force_grows_by_the_arms_stiffness_across():
    bench = world(Step(FRAME, 5.0, 3.0), pen=Pen(friction=0.0))
    press(bench, 2.0)
    forces, tips = slide(bench, 2.0, 5.0, 2.0)
    pressed = forces[-200:, 0]
    assert pressed.max() < 0.0
    # The ball stands before the wall, its middle 1 mm away.
    assert (tips - TIP)[-1, 0] == pytest.approx(4.0, abs=0.3)
    slope = (pressed[-1] - pressed[0]) / 199.0 * 1e3 / 5.0
    arm = 1.0 / bench.compliance[0, 0]
    assert -slope == pytest.approx(arm, rel=0.25)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_the_unavoidable_force_is_what_an_arm_that_does_nothing_makes_of_the_wall(friction):
    """Slanting into it: by readings of a few cycles, of the slope that goes on after them."""
    bench = world(Step(FRAME, 5.0, 3.0), pen=Pen(friction=friction))
    press(bench, 2.0)
    forces, _ = slide(bench, 2.0, 24.0, 0.6, direction=(0.8, 0.6))
    hit = int(np.argmax(forces[:, 0] < -3.0))
    later = np.linalg.norm(forces[hit + 50 :][:150, :2], axis=1)
    slope = np.polyfit(1e-3 * np.arange(150), later, 1)[0]
    readings = [(1e-3 * n, forces[n]) for n in range(hit - 23, hit + 30, 10)]
    series, speed = against(
        readings, np.array([0.0, 0.0, 1.0]), np.array([19.2, 14.4, 0.0]), friction
    )
    wall = met(10.0, series, speed, 0.075, PERIOD)
    assert wall.speed == pytest.approx(19.2, rel=0.03)
    assert wall.unavoidable == pytest.approx(0.075 * slope, rel=0.1)
    assert wall.stiffness == pytest.approx(slope / 19.2, rel=0.1)


def test_step_leads_the_tool_and_tells_what_is_felt():
    bench = world()
    pose, felt = bench.step(PERIOD)
    np.testing.assert_allclose(pose.position, TIP, atol=1e-9)
    np.testing.assert_allclose(felt, 0.0, atol=1e-9)
    for _ in range(40):
        pose, felt = bench.step(PERIOD, at(bench, 0.0, 0.0, -2.0))
    assert felt[2] == pytest.approx(2.0 * 2.0, rel=0.06)
    assert isinstance(pose, Pose)
    assert QUIET.noise.sum() == 0.0

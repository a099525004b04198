"""What a run under force is made of: its policy, its filter, its sense of touch, and its words."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from dmpcli.admittance.force_coupling import fast_filter
from dmpcli.admittance.force_law import ForceGains
from dmpcli.control import force_execution
from dmpcli.control.contact_policy import ContactEvent, ContactPolicy
from dmpcli.control.normal_sensing import NormalPolicy
from dmpcli.errors import InputError, RefusedError
from dmpcli.instruments.protocols import RobotState, SensorInfo
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.simulation.mock import PEN
from tests.control.fake_sensors import StreamingSensor
from tests.control.streaming_fakes import PEN_DOWN, START, plan, stroke
from tests.control.test_execution import UP, ready, selection

# Each as no other one, and none as it is by default.
OWN = {
    "coupling_contact": 0.7, "coupling_reach": 4.5, "coupling_seek": 1.5, "coupling_release": 8.0,
    "coupling_clamp": 12.0, "coupling_rate": 9.0, "coupling_limit": 3.5, "coupling_drag": 2.5,
    "coupling_rub": 0.3, "coupling_patience": 0.09, "on_contact_loss": "hold", "stiffness": 6.5,
    "delay": 0.11, "coupling_damping": 1.7, "coupling_mass": 0.4, "coupling_stiffness": 0.25,
    "coupling_zero_limit": 1.25, "min_contact": 60.0, "force_setpoint": 3.25,
}  # fmt: skip


def test_the_coupling_goes_by_each_setting_as_it_is_set():
    made = force_execution.policy_of(selection(stroke()), ExecuteSettings(**OWN), 0.17, 19.6133)
    assert made == ContactPolicy(
        setpoint=3.25, contact=0.7, reach=4.5, again=4.5, seek=1.5, free=8.0, clamp=12.0, rate=9.0,
        limit=3.5, drag=2.5, rub=0.3, patience=0.09, on_loss="hold", delay=0.17, stiffness=6.5,
        whole_delay=0.11, gains=ForceGains(0.4, 1.7, 0.25, math.inf, 0.02), spring=0.25,
        zero_limit=1.25, least_share=0.6, tool_mass=pytest.approx(2.0),
    )  # fmt: skip


def test_less_than_half_the_set_point_is_no_contact_and_lost_it_is_sought_over_six_millimetres():
    plain = force_execution.policy_of(
        selection(stroke()), ExecuteSettings(coupling_reach=14.0), 0.1
    )
    assert (plain.setpoint, plain.contact, plain.reach, plain.again) == (5.0, 0.5, 14.0, 6.0)
    assert plain.gains is None
    assert plain.tool_mass == 0.0
    light = ExecuteSettings(force_setpoint=0.8)
    assert force_execution.policy_of(selection(stroke()), light, 0.1).contact == pytest.approx(0.4)


def test_the_largest_force_of_all_strokes_is_the_set_point_unless_one_is_asked_for():
    forces = [None, np.full(501, 0.0), np.linspace(1.0, 4.0, 501), np.full(501, 2.0)]
    batch = selection(*(dataclasses.replace(stroke(), force=force) for force in forces))
    assert force_execution.policy_of(batch, ExecuteSettings(), 0.1).setpoint == 4.0
    assert (
        force_execution.policy_of(batch, ExecuteSettings(force_setpoint=3.0), 0.1).setpoint == 3.0
    )
    assert force_execution.policy_of(selection(stroke()), ExecuteSettings(), 0.1).setpoint == 5.0


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_the_filter_is_that_of_the_strokes_tau_at_the_speed_and_period_of_the_run(speed):
    settings = ExecuteSettings(speed=speed, period=0.01)
    pressed = stroke(normal=UP)
    for facts, tau in (({"tau": 4.0}, 4.0), ({}, 10.0), ({"tau": None}, 10.0)):
        found = force_execution.coupling_filter(dataclasses.replace(pressed, facts=facts), settings)
        own = fast_filter(tau / speed, 0.01)
        assert (found.tau, found.k, found.d, found.alpha_e) == (
            pytest.approx((tau / speed, own.k, own.d, own.alpha_e))
        )
        np.testing.assert_allclose(found.transition, own.transition)
    # Of several strokes it is the first one's; each of them is asked.
    batch = selection(pressed, dataclasses.replace(pressed, t=2.0 * pressed.t), facts={"k": 1.0})
    assert force_execution.coupling_of(batch, settings, 5.0).tau == pytest.approx(10.0 / speed)
    late = dataclasses.replace(pressed, t=pressed.t + 100.0)
    assert force_execution.coupling_filter(late, settings).tau == pytest.approx(10.0 / speed)
    with pytest.raises(InputError, match="no surface normal"):
        force_execution.coupling_of(selection(pressed, stroke()), settings, 5.0)


def test_a_set_point_or_gains_that_must_not_be_are_refused_before_anything_moves():
    hard = dataclasses.replace(stroke(normal=UP), force=np.linspace(0.0, 50.0, 501))
    with pytest.raises(InputError, match="the trajectory's fn = 50"):
        force_execution.coupling_filter(hard, ExecuteSettings())
    force_execution.coupling_filter(hard, ExecuteSettings(max_force=50.1))
    with pytest.raises(InputError, match="coupling_mass"):
        force_execution.coupling_of(
            selection(stroke(normal=UP)), ExecuteSettings(coupling_mass=1.0), 5.0
        )


def test_a_look_ahead_behind_which_a_force_is_corrected_slowly_is_told():
    assert force_execution.slowed(0.15) == ""
    assert "behind a look-ahead of 0.2 s" in force_execution.slowed(0.2)
    assert "2 times as slowly" in force_execution.slowed(0.2)


class Started(StreamingSensor):
    """Whether a zero was asked for shows by how long was waited."""

    def start(self, rate):
        super().start(rate)
        self.asked = rate


@pytest.mark.parametrize("rate", [50.0, 1000.0])
def test_what_the_loop_feels_with_is_zeroed_at_rest_and_streams_no_faster_than_it_can(rate):
    arm = ready()
    sensor = Started(arm.clock, lambda t: np.array([1.0, 0, 2.0, 0, 0, 0]))
    sensor.open = lambda: SensorInfo("fake", rate, np.full(6, 100.0))
    tool = dataclasses.replace(PEN, weight=0.0, zero=None)
    made = plan(stroke(normal=UP))
    felt = force_execution.touch(sensor, tool, made, ExecuteSettings(), arm, None)
    assert sensor.asked == min(rate, 100.0)
    assert felt.pressing is None
    assert arm.clock.now() == pytest.approx(100.5)
    np.testing.assert_allclose(felt.compensate.tool.zero, [1.0, 0, 2.0, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(
        felt.feel(RobotState(0.0, START, PEN_DOWN, "ready"), arm.clock.now()), 0.0, atol=1e-9
    )


def test_the_coupling_is_that_of_the_settings_and_tells_its_events():
    arm, said = ready(), []
    sensor = Started(arm.clock)
    settings = ExecuteSettings(
        force_setpoint=3.0, normal_from_force=True, normal_angle=0.3, normal_rate=0.4
    )
    made = plan(stroke(normal=UP))
    tool = dataclasses.replace(PEN, weight=0.0, zero=np.zeros(6))
    policy, filter_ = ContactPolicy(3.0), fast_filter(4.0, 0.02)
    felt = force_execution.touch(
        sensor, tool, made, settings, arm, filter_, 1.0, policy, said.append
    )
    pressing = felt.pressing
    assert pressing.supervisor.policy is policy
    assert pressing.sense._policy == NormalPolicy(True, 0.3, 0.4)
    assert pressing.wanted(10.0) == 3.0
    pressing.supervisor.leaves(1.0)
    assert [event.state for event in said] == ["retreating"]
    sensor.seq = 0
    assert force_execution.touch(sensor, tool, made, settings, arm, filter_).pressing is None
    # A known zero is checked where asked, against what the sensor reads.
    loaded = Started(arm.clock, lambda t: np.array([0.0, 0.0, 1.1, 0.0, 0.0, 0.0]))
    force_execution.touch(loaded, tool, made, settings, arm, None, 1.2)
    loaded.seq = 0
    with pytest.raises(RefusedError, match="over 1 N"):
        force_execution.touch(loaded, tool, made, settings, arm, None, 1.0)


def pressed_like(**found):
    whole = {
        "mean": 4.0,
        "least": 1.0,
        "largest": 6.0,
        "rms_error": 0.5,
        "share": 0.75,
        "saturated": 0.0,
    } | found
    supervisor = SimpleNamespace(events=[], noise=0.05)
    facts = {"contact": whole}
    return SimpleNamespace(facts=lambda: facts, supervisor=supervisor, wall=None)


def test_how_hard_it_pressed_is_said_in_one_line():
    assert force_execution.pressed(SimpleNamespace(facts=dict)) == "no stroke was drawn under force"
    assert force_execution.pressed(pressed_like()) == (
        "force along the normal 4.00 N in the mean, 1.00 to 6.00 N, RMS error 0.50 N; no contact "
        "on 25 % of the stroke"
    )
    more = pressed_like(landing_peak=5.5, stiffness=2.0, delay=0.06, saturated=0.125)
    more.wall = "9 N"
    more.supervisor.events = [
        ContactEvent(0.5, "drawing"),
        ContactEvent(1.25, "oscillating"),
    ]
    assert force_execution.pressed(more).split("; ")[2:] == [
        "landed with 5.50 N at the most, on 2 N/mm behind 0.06 s",
        "ended by a wall: 9 N",
        "at its limits on 12 % of the stroke",
        "the force swung, and the gains were softened",
        "contact: drawing at 0.50 s, oscillating at 1.25 s",
    ]
    for drift, told in ((0.16, True), (0.14, False)):
        said = force_execution.pressed(pressed_like(zero_drift=drift))
        assert (f"zero has moved by {drift:.2f} N" in said) is told
    leans = pressed_like(
        normal_angle={"mean": np.radians(2.0), "p95": np.radians(3.5)}, friction=0.3
    )
    assert force_execution.pressed(leans).split("; ")[2] == (
        "the surface leans from the planned normal by 2.0° in the mean, 3.5° (95 %), friction 0.30"
    )

"""What the force coupling adds to a stream: nothing where e is 0, and nothing for good."""

import dataclasses

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from dmpcli.admittance.force_coupling import fast_filter
from dmpcli.admittance.force_law import by_rule
from dmpcli.admittance.force_stability import is_safe
from dmpcli.control.contact_policy import ContactPolicy
from dmpcli.control.contact_supervisor import ContactSupervisor
from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.force_tracking import ForceInput, ForceTracker
from dmpcli.control.servo_loop import DONE, ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.instruments.protocols import SensorInfo
from dmpcli.planning.plan import joined, sample, straight
from dmpcli.spatial.pose import Pose
from tests.control.fake_sensors import PolledSensor
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, FakeClock, FakeServo, stroke

PERIOD, UP, PLATE = 0.02, (0.0, 0.0, 1.0), 2.0


class PlateSensor(PolledSensor):
    """Feels a plate of 2 N/mm, some mm over the plan; None feels nothing."""

    def __init__(self, clock, servo, over):
        super().__init__(clock)
        self.servo, self.over = servo, over

    def poll(self):
        depth = 0.0 if self.over is None else START[2] + self.over - self.servo.position[2]
        self.wrench = np.array([0.0, 0.0, PLATE * max(depth, 0.0), 0.0, 0.0, 0.0])
        return super().poll()


def drawn(force, over, coupled=True, duration=3.0, **policy):
    """Draw a stroke and lift the tool off it by 20 mm; returns plan, loop and what was sent."""
    source = dataclasses.replace(stroke(duration, normal=UP), force=force)
    at = sample(source, PERIOD, 1.0, PEN_DOWN)
    up = Pose(at.position[-1] + [0.0, 0.0, 20.0], at.rotation[-1])
    made = joined(
        at, [], [straight("retract", at.pose(-1), up, PERIOD, WIDE, 50.0, 15.0)], PERIOD, True
    )
    clock = FakeClock(PERIOD)
    servo = FakeServo(clock, lookahead=0.04)
    touch = None
    if coupled:
        sensor = PlateSensor(clock, servo, over)
        sensing = Sensing(
            sensor, SensorInfo("fake", 100.0, np.full(6, 100.0)), 100.0, PERIOD, clock
        )
        supervisor = ContactSupervisor(ContactPolicy(5.0, delay=0.02, **policy), PERIOD)
        press = ForceTracker(supervisor, fast_filter(5.0, PERIOD), made)
        touch = ForceInput(sensing, lambda sensed, _: sensed, press)
    arm = ReadyArm(servo, servo.info, clock)
    loop = ServoLoop(made, WIDE, StopLimits(20.0, 0.1, 50.0, 5.0), arm, touch)
    outcome = loop.run(Interruption())
    assert outcome.reason == DONE, outcome.reason
    return made, loop, np.array([position for position, _ in servo.sent])


@pytest.mark.slow
@settings(max_examples=4)
@given(st.floats(0.5, 20.0), st.floats(0.03, 0.2), st.sampled_from([2.5, 4.0]))
def test_where_e_is_0_the_coupled_stream_is_the_plain_one(k, delay, duration):
    """A stroke that is lifted all along: whatever the gains, no set-point differs by 1e-9 mm."""
    force = np.zeros(round(duration * 50.0) + 1)
    _, _, plain = drawn(force, None, coupled=False, duration=duration)
    _, loop, sent = drawn(force, None, duration=duration, stiffness=k, whole_delay=delay)
    # It waits at the start for its zero.
    wait = len(sent) - len(plain)
    assert wait > 5
    np.testing.assert_allclose(sent[:wait], np.broadcast_to(plain[0], (wait, 3)), atol=1e-9)
    np.testing.assert_allclose(sent[wait:], plain, atol=1e-9)
    assert set(loop.log.columns()["contact"]) <= {"free", "retreating", None}


@pytest.mark.slow
@settings(max_examples=5)
@given(st.floats(1.2, 10.0), st.floats(0.05, 0.15), st.floats(-4.0, 4.0))
def test_after_contact_has_ended_the_offset_decays_and_the_goal_is_reached(k, delay, over):
    """Over random gains that are stable on the plate, which lies up to 4 mm off the plan."""
    assume(is_safe(by_rule(k, delay + PERIOD / 2.0, PERIOD), PLATE, 0.06))
    force = np.full(151, 5.0)
    made, loop, sent = drawn(force, over, stiffness=k, whole_delay=delay)
    columns = loop.log.columns()
    pressed = columns["contact"] == "drawing"
    assert pressed.sum() > 120
    # While it drew it was off the plan by where the plate is, and by the pen's compression.
    e = columns["coupling"][pressed][-30:]
    np.testing.assert_allclose(e, over - 5.0 / PLATE, atol=0.2)
    np.testing.assert_allclose(sent[-1], made.position[-1], atol=1e-9)
    assert loop.drawn == ["0"]

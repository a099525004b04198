"""Steps on either side of every limit: what the checks before a motion would not have passed."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.control.step_limits import StepLimits, check_start
from dmpcli.errors import InstrumentError, RefusedError
from dmpcli.instruments.protocols import RobotState
from dmpcli.planning.limits import Limits
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, plan

PERIOD = 0.02
LIMITS = Limits(100.0, 2000.0, 5e4, 0.5, 10.0, 300.0)
ALONG = np.array([0.6, 0.0, 0.8])


def walked(steps, turns=None, limits=LIMITS):
    """Set-points so many mm, and rad, after one another; what the last one is refused for."""
    checked = StepLimits(limits, PERIOD)
    position, rotation, before = START, PEN_DOWN, None
    for step, turn in zip([0.0, *steps], [0.0, *(turns or [0.0] * len(steps))], strict=True):
        position = position + step * ALONG
        rotation = exp(turn * ALONG) @ rotation
        setpoint = Pose(position, rotation)
        checked.check(before, setpoint)
        before = setpoint


def rising(size, most, count):
    """Steps that grow to a size by no more than `most` at a time."""
    return [min(size, most * (i + 1)) for i in range(count)]


def test_a_speed_up_to_the_limit_and_one_per_cent_is_sent():
    # 100 mm/s are 2 mm a period, 2000 mm/s² 0.8 mm from one to the next.
    walked(rising(2.0 * 1.0099, 0.8, 6))
    with pytest.raises(RefusedError, match=r"take 101 mm/s, 0 rad/s, over 100 mm/s, 0\.5"):
        walked(rising(2.0 * 1.0101, 0.8, 6))
    # 0.5 rad/s are 10 mrad, 10 rad/s² 4 mrad.
    walked([0.0] * 6, rising(0.01 * 1.0099, 0.004, 6))
    with pytest.raises(RefusedError, match=r"take 0 mm/s, 0\.505\d* rad/s"):
        walked([0.0] * 6, rising(0.01 * 1.0101, 0.004, 6))


def test_an_acceleration_up_to_the_limit_and_a_tenth_is_sent_from_rest_and_to_rest():
    for most in (0.8, -0.8):
        walked([1.0999 * most])
        with pytest.raises(RefusedError, match=r"take 2200 mm/s², 0 rad/s², over 2000 mm/s²"):
            walked([1.1002 * most])
    walked([0.8, 1.6, 0.8, 0.0])
    with pytest.raises(RefusedError, match="mm/s²"):
        walked([0.8, 1.6, 0.6])
    walked([0.0], [1.0999 * 0.004])
    with pytest.raises(RefusedError, match=r"rad/s², over 2000 mm/s², 10 rad/s²"):
        walked([0.0], [1.1002 * 0.004])
    with pytest.raises(RefusedError, match="rad/s²"):
        walked([0.0, 0.0, 0.0], [0.004, 0.008, 0.003])


def test_no_set_point_leaves_the_workspace_or_is_no_number():
    box = replace(LIMITS, workspace=(-552.0, -550.0, 0.0, 200.0, -50.0, 50.0))
    walked([0.5], limits=box)
    with pytest.raises(RefusedError):
        walked([0.5, 1.2, 1.5], limits=box)
    with pytest.raises(RefusedError):
        StepLimits(box, PERIOD).check(None, Pose(START + [5.0, 0.0, 0.0], PEN_DOWN))
    with pytest.raises(Exception, match="number"):
        StepLimits(LIMITS, PERIOD).check(None, Pose(START * np.nan, PEN_DOWN))


def stands(off=0.0, turned=0.0, limits=WIDE, mode="ready"):
    pose = START + off * ALONG, exp(turned * ALONG) @ PEN_DOWN
    check_start(RobotState(1.0, *pose, mode), plan(), limits)


@pytest.mark.parametrize(
    ("speed", "far"),
    [(250.0, 0.5), (10.0, 0.2), (0.1, 0.02)],
    ids=["what a brake lets sink", "a period's way", "the noise at rest"],
)
def test_an_arm_may_stand_a_little_off_its_first_set_point(speed, far):
    limits = replace(WIDE, speed=speed)
    stands(0.99 * far, limits=limits)
    with pytest.raises(RefusedError, match=f"over {far:.2g} mm, 0.005 rad: it has moved"):
        stands(1.02 * far, limits=limits)


@pytest.mark.parametrize(("speed", "far"), [(0.785, 0.005), (0.1, 0.002), (0.01, 0.001)])
def test_or_be_turned_a_little(speed, far):
    limits = replace(WIDE, rotation_speed=speed)
    stands(turned=0.99 * far, limits=limits)
    with pytest.raises(RefusedError, match=f"over 0.5 mm, {far:.2g} rad"):
        stands(turned=1.02 * far, limits=limits)


def test_an_arm_that_is_not_ready_or_nowhere_does_not_begin():
    with pytest.raises(RefusedError):
        stands(mode="emergency stop")
    with pytest.raises(InstrumentError):
        stands(np.nan)

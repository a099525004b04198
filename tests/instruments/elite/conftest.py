import numpy as np
import pytest

from dmpcli.control import workcell
from dmpcli.instruments.clock import MonotonicClock
from dmpcli.instruments.pose_forms import encode
from dmpcli.kinematics import chain, models
from tests.instruments.elite.scripted import HOME, Scripted
from tests.instruments.test_servo_adapter import declared


def flange_at(joints):
    """What an EC66 without a tool reports at joint angles in degrees: mm and degrees."""
    return encode(declared(), chain.forward(models.model("ec66"), np.radians(joints))).tolist()


@pytest.fixture
def robot():
    """A scripted controller that stands at `HOME` and knows where that is."""
    with Scripted() as scripted:
        scripted.pose = flange_at(HOME)
        scripted.answers["inverseKinematic"] = scripted.solve
        yield scripted


@pytest.fixture
def arm(robot):
    """Makes servos for the scripted controller; options of the URL are its arguments."""
    made = []

    def servo(**options):
        given = {"monitor_port": robot.monitor_port} | options
        more = "&".join(f"{key}={value}" for key, value in given.items())
        url = f"elite://127.0.0.1:{robot.port}?{more}"
        made.append(workcell.connect(url, None, MonotonicClock()).robot)
        return made[-1]

    yield servo
    for each in made:
        robot.answers["stop"] = robot.answers["stop_trajectory"] = True
        each.close()

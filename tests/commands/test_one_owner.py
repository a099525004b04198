"""Two commands and one arm: the second one waits its turn, and takes over what a crash has left."""

import signal
import subprocess
import time

import pytest

from dmpcli.records import tool
from dmpcli.simulation.elite_server import faults
from dmpcli.simulation.elite_server.lab import LabParameters, VirtualLab
from dmpcli.simulation.elite_server.service import ControllerService
from dmpcli.simulation.mock import PEN
from tests.commands.test_execute import START, columns, written
from tests.commands.virtual_lab import DMPCLI


@pytest.fixture
def lab():
    service = ControllerService(VirtualLab(LabParameters(START, habits=faults.parse(()).habits)))
    yield service
    service.close()


def begun(lab, tmp_path, name, duration, *more, mode="stream"):
    traj = written(tmp_path / f"{name}-traj.parquet", columns(duration=duration))
    pen = tmp_path / "pen.json"
    pen.write_bytes(tool.encode(PEN))
    url = (
        f"elite://127.0.0.1:{lab.robot_port}?monitor_port={lab.monitor_port}"
        f"&mode={mode}&lookahead=0.5&oldest=0.5"
    )
    words = [
        *(DMPCLI, "execute", traj, "-o", tmp_path / f"{name}.parquet"),
        *("--robot", url, "--tool", pen, *more),
    ]
    return subprocess.Popen([str(word) for word in words], stderr=subprocess.PIPE, text=True)


def ended(process):
    _, said = process.communicate(timeout=60.0)
    return process.returncode, said


def moving(lab):
    """Wait until the arm does."""
    until = time.monotonic() + 30.0
    while not abs(lab._lab.controller.arm.speeds).max() > 0.01:
        assert time.monotonic() < until
        time.sleep(0.02)


@pytest.mark.slow
def test_a_second_command_leaves_the_stroke_of_the_first_alone(lab, tmp_path):
    first = begun(lab, tmp_path, "first", 10.0)
    moving(lab)
    code, said = ended(begun(lab, tmp_path, "second", 10.0))
    assert code == 3
    assert f"another dmpcli on this computer (process {first.pid}) moves this arm" in said
    assert ended(first)[0] == 0


@pytest.mark.thorough
def test_what_a_crash_left_is_taken_over_once_the_arm_rests(lab, tmp_path):
    first = begun(lab, tmp_path, "first", 10.0)
    moving(lab)
    first.send_signal(signal.SIGKILL)
    ended(first)
    time.sleep(1.0)  # its buffer runs empty
    code, said = ended(begun(lab, tmp_path, "second", 3.0, "--approach", "50"))
    assert code == 0, said
    assert "took over a transmission that was left open" in said


@pytest.mark.thorough
def test_an_arm_that_plays_on_after_a_crash_is_not_cut_into(lab, tmp_path):
    first = begun(lab, tmp_path, "first", 20.0, "--allow-file-mode", mode="file")
    moving(lab)
    first.send_signal(signal.SIGKILL)
    ended(first)
    code, said = ended(begun(lab, tmp_path, "second", 3.0, "--approach", "50"))
    assert code in (3, 4)  # it may be seen moving already as it is connected to
    assert "it moves" in said or "hold the arm still" in said
    assert abs(lab._lab.controller.arm.speeds).max() > 0.0

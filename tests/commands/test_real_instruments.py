"""What the command lines say of real instruments, and the exit code that it earns."""

import time

import numpy as np
import pytest
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.records import file_io, record, schemas, tool
from dmpcli.simulation.elite_server.lab import LabParameters, VirtualLab
from dmpcli.simulation.elite_server.service import ControllerService
from dmpcli.simulation.mock import PEN
from tests.commands.test_execute import START, columns, written
from tests.instruments.elite.conftest import flange_at
from tests.instruments.elite.scripted import HOME, Scripted


@pytest.fixture
def traj(tmp_path):
    return written(tmp_path / "traj.parquet", columns(duration=3.0))


@pytest.fixture
def pen(tmp_path):
    path = tmp_path / "pen.json"
    path.write_bytes(tool.encode(PEN))
    return path


def dmpcli(*arguments, expect):
    begun = time.monotonic()
    result = CliRunner().invoke(app, [str(each) for each in arguments])
    assert result.exit_code == expect, (result.exit_code, result.stderr, result.exception)
    result.took = time.monotonic() - begun
    return result


def last_line(result):
    lines = result.stderr.strip().splitlines()
    return lines[-1]


@pytest.mark.parametrize("command", ["execute", "record"])
def test_a_robot_that_cannot_be_reached_is_one_line_within_three_seconds(
    command, traj, pen, tmp_path
):
    with Scripted() as gone:
        robot = f"elite://{gone.query}"
    options = ("-o", tmp_path / "out.parquet", "--robot", robot, "--tool", pen)
    if command == "execute":
        result = dmpcli("execute", traj, *options, expect=4)
    else:
        result = dmpcli("record", *options, "--allow-mixed", expect=4)
    assert "cannot be reached (Connection refused); check address" in last_line(result)
    assert result.took < 3.0
    assert not (tmp_path / "out.parquet").exists()


def test_a_robot_that_accepts_and_says_nothing_is_one_line_within_three_seconds(
    traj, pen, tmp_path
):
    with Scripted() as robot:
        robot.silent = True
        url = f"elite://{robot.query}"
        options = ("-o", tmp_path / "out.parquet", "--robot", url, "--tool", pen)
        result = dmpcli("execute", traj, *options, expect=4)
    assert "getRobotState: no answer; is " in last_line(result)
    assert "the controller's JSON-RPC port, as a rule 8055?" in last_line(result)
    assert result.took < 3.0


def test_a_port_that_speaks_something_else_is_asked_about(traj, pen, tmp_path):
    with Scripted() as robot:
        robot.answers["getRobotState"] = "HTTP/1.1 400"
        url = f"elite://{robot.query}"
        result = dmpcli("execute", traj, "-o", tmp_path / "o", "--robot", url, expect=4)
    assert "the controller's JSON-RPC port, as a rule 8055?" in last_line(result)


@pytest.mark.parametrize(
    ("period", "words"),
    [
        (0.1, "the Elite EC66 robot takes periods of 0.002 to 0.05 s (20 to 500 Hz)"),
        (0.0205, "the Elite EC66 robot takes periods of whole multiples of 1 ms"),
    ],
)
def test_a_period_that_the_robot_does_not_take_is_refused_before_streaming(
    traj, tmp_path, period, words
):
    with Scripted() as robot:
        robot.pose = flange_at(HOME)
        robot.answers["inverseKinematic"] = robot.solve
        url = f"elite://{robot.query}&lookahead=0.1"
        out = tmp_path / "o.parquet"
        result = dmpcli("execute", traj, "-o", out, "--robot", url, "--period", period, expect=2)
    assert f"--period {period}: {words}" in last_line(result)
    assert "streaming" not in result.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("monitor", "words"),
    [
        ({"mode": 0}, "robot: not ready (it is in teach mode, not in remote); clear it"),
        ({"estop": 1}, "robot: emergency stop; release it and clear it on the pendant and try"),
        ({"collision": 1}, "robot: protective stop (it has detected a collision)"),
    ],
)
@pytest.mark.parametrize("command", ["execute", "record"])
def test_a_robot_that_must_not_move_is_refused_in_one_line(command, monitor, words, traj, tmp_path):
    with Scripted() as robot:
        robot.pose, robot.monitor = flange_at(HOME), monitor
        robot.answers["inverseKinematic"] = robot.solve
        options = ("-o", tmp_path / "out.parquet", "--robot", f"elite://{robot.query}")
        if command == "execute":
            result = dmpcli("execute", traj, *options, expect=3)
        else:
            result = dmpcli("record", *options, "--allow-mixed", expect=3)
        assert "stop" not in robot.methods()
    assert words in last_line(result)
    assert "--robot elite://127.0.0.1" in result.stderr.splitlines()[0]  # there is no --tool


def test_a_recording_that_never_began_is_not_summed_up(tmp_path):
    out = tmp_path / "out.parquet"
    with Scripted() as robot:
        robot.pose = flange_at(HOME)
        robot.answers |= {"inverseKinematic": robot.solve, "getRobotMode": 0}
        url = f"elite://{robot.query}"
        result = dmpcli("record", "-o", out, "--robot", url, "--allow-mixed", expect=3)
    assert "in teach mode; turn the key to remote" in last_line(result)
    assert "rows" not in result.stderr
    assert "no cycle" not in result.stderr
    assert not out.exists()


def test_an_instrument_beside_a_mock_one_must_be_meant(tmp_path):
    out = tmp_path / "out.parquet"
    result = dmpcli("record", "-o", out, "--robot", "elite://127.0.0.1", expect=2)
    assert "beside a mock sensor: give --sensor too, or --allow-mixed" in last_line(result)
    result = dmpcli("record", "-o", out, "--sensor", "laser://127.0.0.1", expect=2)
    assert "a sensor is one of mock:," in last_line(result)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["stream", "file"])
def test_a_stroke_is_drawn_by_the_virtual_arm_and_logged(mode, traj, pen, tmp_path):
    out = tmp_path / "run.parquet"
    service = ControllerService(VirtualLab(LabParameters(START)))
    try:
        url = (
            f"elite://127.0.0.1:{service.robot_port}?monitor_port={service.monitor_port}"
            f"&mode={mode}&lookahead=0.5&oldest=0.5"
        )
        options = ("--robot", url, "--tool", pen, "--speed", 0.5, "--approach", 100)
        if mode == "file":
            refused = dmpcli("execute", traj, "-o", out, *options, expect=2)
            assert "--allow-file-mode if somebody stands there" in last_line(refused)
            dmpcli("execute", traj, "--dry-run", *options, expect=0)
            options += ("--allow-file-mode",)
        dmpcli("execute", traj, "-o", out, *options, expect=0)
    finally:
        service.close()
    run = record.decode(file_io.read(out), schemas.RUN)
    facts = run.provenance.facts
    assert (facts["reason"], facts["completed"], facts["simulated"]) == ("done", True, False)
    assert run.provenance.options["robot"] == "elite"
    assert [each["role"] for each in run.provenance.inputs] == ["trajectory", "tool"]
    actual = np.column_stack([run.columns[name] for name in "xyz"])
    way = np.column_stack([columns(duration=3.0, rate=500.0)[name] for name in "xyz"])
    gaps = np.linalg.norm(actual[:, None] - way[None], axis=2)
    arrived = int(np.argmax(gaps[:, 0] < 0.3))
    assert gaps[arrived:].min(axis=1).max() < 0.5
    np.testing.assert_allclose(actual[-1], way[-1], atol=0.1)

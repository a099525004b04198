"""What a person reads last, and the exit code, where an arm may still move."""

import pytest
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.errors import InstrumentError
from dmpcli.records import file_io, record, schemas
from dmpcli.simulation.mock import MockServo
from tests.commands.test_execute import columns, written


def deaf(servo):
    raise InstrumentError("mock robot: no answer")


@pytest.fixture
def traj(tmp_path):
    return written(tmp_path / "traj.parquet", columns(duration=3.0))


def ends(*words, expect=4):
    done = CliRunner().invoke(app, [*map(str, words)])
    assert done.exit_code == expect, (done.exit_code, done.stderr, done.exception)
    return done.stderr.strip().splitlines()


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["mock:", "mock:?estop_at=2.5", "mock:?refuse_at=2.5"])
@pytest.mark.parametrize("command", ["execute", "record"])
def test_it_is_the_last_line_with_exit_code_4_and_stands_in_the_file(
    command, robot, traj, tmp_path, monkeypatch
):
    out = tmp_path / "out.parquet"
    monkeypatch.setattr(MockServo, "stop", deaf)
    first = [traj] if command == "execute" else ["--duration", 2]
    said = ends(command, *first, "-o", out, "--robot", robot, "-q")
    assert said[-1].endswith(
        "THE ARM MAY STILL MOVE: it could not be told to stop: mock robot: no answer; "
        "press its emergency stop"
    )
    assert ("estop" in robot) == any("emergency stop;" in line for line in said[:-1])
    schema = schemas.RUN if command == "execute" else schemas.DEMONSTRATION
    facts = record.decode(file_io.read(str(out)), schema).provenance.facts
    assert facts["stop"] == {"outcome": "not told", "why": "mock robot: no answer"}


def test_a_defect_shows_its_traceback_before_it(traj, tmp_path, monkeypatch):
    state, looks = MockServo.state, []

    def broken(servo):
        looks.append(servo)
        return 1 / 0 if len(looks) == 60 else state(servo)

    monkeypatch.setattr(MockServo, "state", broken)
    monkeypatch.setattr(MockServo, "stop", deaf)
    said = ends("execute", traj, "-o", tmp_path / "run.parquet")
    assert any("ZeroDivisionError" in line for line in said[:-1])
    assert any(line.startswith("Traceback") for line in said)
    assert "THE ARM MAY STILL MOVE" in said[-1]


def test_an_arm_that_stands_still_on_a_short_stroke_is_not_said_to_have_drawn_it(
    tmp_path, monkeypatch
):
    from dmpcli.simulation.mock.arms import ServoArm

    short = columns(duration=3.0)
    for name in "xyz":
        short[name] = short[name][0] + 0.03 * (short[name] - short[name][0])
        short[f"r{name}"] = 0.0 * short[f"r{name}"] + short[f"r{name}"][0]
    traj, out = written(tmp_path / "traj.parquet", short), tmp_path / "run.parquet"
    ends("execute", traj, "-o", out, expect=0)
    monkeypatch.setattr(ServoArm, "send", lambda *_: None)
    said = ends("execute", traj, "-o", out)
    assert "took every set-point" in said[-1]
    assert record.decode(file_io.read(str(out)), schemas.RUN).provenance.facts["completed"] is False

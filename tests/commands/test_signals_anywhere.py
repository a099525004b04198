"""A signal at any line between the journal and the end: nothing is lost, the exit code is true."""

import os
import signal
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.records import file_io, record

WATCHED = ("workflows/record.py", "workflows/execute.py", "run_output.py", "control/signals.py")
LINE = ["--reference", "line", "--duration", "1.5", "--start", "-551", "131", "-17.56"]
LINE += ["--goal", "-561", "131", "-17.56"]


class Shot:
    """Sends this process a signal at the n-th line of the command that is run."""

    def __init__(self, at):
        self.at, self.lines, self.where = at, 0, ""

    def __enter__(self):
        # Outside of a command a signal would end the tests.
        self.before = signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
        sys.settrace(self.call)
        return self

    def __exit__(self, *_):
        sys.settrace(None)
        signal.signal(signal.SIGTERM, self.before)

    def call(self, frame, event, _):
        return self.line if frame.f_code.co_filename.endswith(WATCHED) else None

    def line(self, frame, event, _):
        if event == "line":
            self.lines += 1
            if self.lines == self.at:
                self.where = f"{frame.f_code.co_filename}:{frame.f_lineno}"
                os.kill(os.getpid(), signal.SIGTERM)
        return self.line


@pytest.fixture
def quick(monkeypatch):
    """A run in real time, as far as the command knows."""
    from dmpcli.instruments import clock

    monkeypatch.setattr(clock, "MonotonicClock", clock.SimulatedClock)
    for module in ("control.watchdog", "workflows.record"):
        monkeypatch.setattr(f"dmpcli.{module}.watched", lambda robot: robot)
    monkeypatch.setattr("dmpcli.records.journal.Journal._keep", lambda _: None)


def shot(words, out, at):
    with Shot(at) as one:
        result = CliRunner().invoke(app, [*words, "-o", str(out), "--realtime"])
    return one, result


def swept(words, tmp_path, first, step):
    out = tmp_path / "run.parquet"
    seen, at = set(), first
    while True:
        one, result = shot(words, out, at)
        there = out.exists()
        rows = len(record.decode(file_io.read(out))) if there else 0
        left = sorted(file.name for file in tmp_path.iterdir())
        said = f"{one.where}: {result.exit_code}, {rows} rows, {left}\n{result.output}"
        assert result.exit_code in (0, 128 + signal.SIGTERM), said
        assert left == (["run.parquet"] if there else []), said
        if result.exit_code == 0:
            assert rows > 20, said
        seen.add((result.exit_code, there))
        out.unlink(missing_ok=True)
        if not one.where:
            return seen
        at += step


@pytest.mark.slow
def test_a_signal_at_any_line_of_record_loses_nothing(quick, tmp_path):
    seen = swept(["record", *LINE], tmp_path, 1, 29)
    assert (0, True) in seen
    assert (143, False) in seen


@pytest.mark.slow
def test_a_signal_at_any_line_of_execute_loses_nothing(quick, tmp_path, tmp_path_factory):
    folder = tmp_path_factory.mktemp("stroke")
    for words in (
        ["record", *LINE, "-o", str(folder / "d.parquet")],
        ["fit", str(folder / "d.parquet"), "-o", str(folder / "s.json")],
        ["generalize", str(folder / "s.json"), "--reproduce", "-o", str(folder / "t.parquet"),
         "--ease-in", "0.3", "--ease-out", "0.3"],
    ):  # fmt: skip
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 0, result.output
    seen = swept(["execute", str(folder / "t.parquet")], tmp_path, 1, 29)
    assert (0, True) in seen
    assert (143, False) in seen


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_that_comes_as_an_object_is_cleared_away_is_not_lost(number):
    """Python ignores what is raised there; compiling clears away many objects of llvmlite."""
    program = f"""
import os, signal, time
from dmpcli import cli
class Cleared:
    def __del__(self):
        os.kill(os.getpid(), {int(number)})
        sum(range(1000))
def work():
    Cleared()
    time.sleep(30)
cli.app = work
cli.main()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode in (128 + number, -number)
    assert "Exception ignored" not in done.stderr

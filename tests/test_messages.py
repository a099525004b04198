"""Progress of long work: seen at a terminal, with share, count, rate and failures; nowhere else."""

import csv
import io
import re
import subprocess
import sys

import pytest

from dmpcli import messages
from tests.commands.running import ended
from tests.control.test_watching import DMPCLI, watched

CODES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


class Screen(io.StringIO):
    """Standard error that says that it is a terminal."""

    def isatty(self):
        return True


def at_a_terminal(monkeypatch):
    """Let a person watch; in the test itself, for pytest takes standard error anew for each."""
    made = Screen()
    monkeypatch.setattr(sys, "stderr", made)
    monkeypatch.setattr(messages, "watched", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    return made


def test_progress_shows_share_count_and_failures(monkeypatch):
    screen = at_a_terminal(monkeypatch)
    with messages.progress("drawing", 200) as advance:
        advance(50)
        advance(50, failed=3)
        advance(50, failed=4)
    text = CODES.sub("", screen.getvalue())
    assert "drawing" in text
    assert re.search(r"75%\s+150/200", text)
    assert "7 failed" in text
    # What was shown is taken away again: the next message begins on a line of its own.
    assert screen.getvalue().rstrip("\n").endswith("\x1b[2K")


def test_a_batch_without_failures_says_none(monkeypatch):
    screen = at_a_terminal(monkeypatch)
    with messages.progress("measuring", 2) as advance:
        advance(2)
    text = CODES.sub("", screen.getvalue())
    assert re.search(r"100%\s+2/2", text)
    assert "failed" not in text


def test_what_another_run_does_is_not_waited_for(monkeypatch):
    screen = at_a_terminal(monkeypatch)
    with messages.progress("drawing", 80) as advance:
        advance(2, 2, left_out=60)
        advance(18)
    assert re.search(r"100%\s+20/20", CODES.sub("", screen.getvalue()))


def test_where_nobody_watches_nothing_is_drawn(capsys):
    with messages.progress("drawing", 10) as advance:
        advance(10, failed=1)
    assert capsys.readouterr() == ("", "")


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    """A folder with a skill and a table of many pairs, one in ten of which cannot be drawn."""
    folder = tmp_path_factory.mktemp("many")
    line = ["--reference", "line", "--duration", "1.5"]
    line += ["--start", "-551", "131", "-17.56", "--goal", "-561", "131", "-17.56"]
    ended("record", "-o", folder / "demo.parquet", *line)
    ended("fit", folder / "demo.parquet", "-o", folder / "skill.json")
    with (folder / "pairs.csv").open("w", newline="") as stream:
        rows = csv.writer(stream)
        rows.writerow(["x0", "y0", "z0", "xg", "yg", "zg"])
        for k in range(4000):
            far = 0.0 if k % 10 == 0 else 10.0
            rows.writerow([-500.0, 0.1 * k, 0.0, -500.0 - far, 0.1 * k, 0.0])
    return folder


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_person_at_the_terminal_sees_how_far_a_batch_is(batch, tmp_path, jobs):
    words = ["generalize", "skill.json", "--pairs", "pairs.csv", "--on-error", "skip"]
    words += ["--jobs", jobs, "--pairs-per-part", "100", "-o", tmp_path / "out"]
    text, code = watched(batch, *words)
    assert code == 0, text
    bare = CODES.sub("", text)
    counts = [int(count) for count in re.findall(r"drawing .*?(\d+)/4000", bare)]
    assert counts == sorted(counts)
    assert counts[-1] == 4000
    assert "400 failed" in bare
    assert re.search(r"\d/s", bare)
    assert "3600 strokes drawn, 400 pairs skipped" in bare


@pytest.mark.thorough
def test_a_share_of_a_batch_counts_its_own_pairs(batch, tmp_path):
    words = ["generalize", "skill.json", "--pairs", "pairs.csv", "--on-error", "skip"]
    words += ["--shard", "2/4", "--pairs-per-part", "100", "-o", tmp_path / "out"]
    text, code = watched(batch, *words)
    assert code == 0, text
    bare = CODES.sub("", text)
    assert re.findall(r"100%\s+1000/1000", bare)
    assert "100 failed" in bare


@pytest.mark.slow
def test_a_quiet_batch_and_one_into_a_pipe_show_nothing(batch, tmp_path):
    words = ["generalize", "skill.json", "--pairs", "pairs.csv", "--on-error", "skip"]
    text, code = watched(batch, *words, "-o", tmp_path / "quiet", "-q")
    assert code == 0
    assert "drawing" not in text
    assert "\x1b" not in text
    done = subprocess.run(
        [DMPCLI, *words, "-o", tmp_path / "piped"], cwd=batch, capture_output=True, check=True
    )
    assert b"\x1b" not in done.stderr
    assert b"drawing" not in done.stderr

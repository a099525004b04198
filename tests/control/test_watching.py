"""The live view: a person sees a run, the loop does not know, and nothing is drawn elsewhere."""

import contextlib
import io
import os
import pty
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dmpcli import live_view
from dmpcli.control import watching
from dmpcli.control.run_log import Row, RunLog
from dmpcli.live_view import SIZE, RowView, SharedRow
from dmpcli.spatial.pose import Pose
from tests.commands.test_execute import columns, written
from tests.control.streaming_fakes import plan, stroke
from tests.control.test_servo_loop import Bench

DMPCLI = str(Path(sys.executable).with_name("dmpcli"))


def drawn(content):
    """What a picture says, as text."""
    from rich.console import Console

    console = Console(width=100, record=True, file=open(os.devnull, "w"))  # noqa: SIM115
    with contextlib.closing(console.file):
        console.print(live_view.table(content))
        return console.export_text()


def add(log, numbers, late=0.0004):
    for k in numbers:
        pose = Pose(np.array([1.0 * k, 2.0, 3.0]), np.eye(3))
        wrench = np.array([1.0, 2.0, 2.0, 0.1, 0.0, 0.0])
        log.add(
            0.02 * k,
            Row(
                0.02 * k, 0.02 * k, pose, pose, pose, 0.02 * k, late, wrench, 0.25, "ready",
                "stroke", "a",
            ),
        )  # fmt: skip


def logged(count, late=0.0004):
    log = RunLog(sensed=True, coupled=True)
    add(log, range(count), late)
    return log


@contextlib.contextmanager
def mirrored(log, whole=None):
    """A view of a log's rows, and what the process that draws reads of them."""
    view = watching.RunView("executing", log.rows, 0.02, whole)
    with tempfile.TemporaryFile() as file:
        file.truncate(SIZE)
        seen = RowView.of_json(view.of_rows().json())
        log.rows.mirror = SharedRow(file.fileno(), view.of_rows()).put
        yield SharedRow(file.fileno(), seen)


def test_a_view_says_pose_force_lateness_contact_and_share():
    log = logged(0)
    with mirrored(log, whole=0.4) as theirs:
        add(log, range(11))
        seen = theirs.read()
    assert seen["pose"][:3] == [10.0, 2.0, 3.0]
    assert seen["pose"][3:] == pytest.approx([0.0, 0.0, 0.0])
    assert seen["force"] == [1.0, 2.0, 2.0]
    assert seen["share"] == pytest.approx(0.5)
    assert (seen["late"], seen["worst"]) == pytest.approx((0.4, 0.4))
    text = drawn(seen | {"reason": "done"})
    for words in ("executing", "50 %", "10.00", "|F| 3.00 N", "led by 0.25 mm", "stroke", "done"):
        assert words in text, words


def test_the_worst_lateness_is_that_of_all_rows_since_the_view_began():
    log = logged(0)
    with mirrored(log) as theirs:
        add(log, range(5), late=0.003)
        assert theirs.read()["worst"] == pytest.approx(3.0)
        add(log, range(5, 9), late=1e-4)
        seen = theirs.read()
    assert (seen["late"], seen["worst"]) == pytest.approx((0.1, 3.0))
    assert seen["share"] is None


def test_a_row_that_was_never_sent_has_no_lateness_to_show():
    log = logged(0)
    with mirrored(log) as theirs:
        add(log, range(1), late=np.nan)
        assert "late" not in drawn(theirs.read())


def test_names_with_brackets_and_colons_are_shown_as_they_are():
    seen = {"title": "executing", "t": 0.0, "state": "stroke  a[red]:100:[/x]", "reason": "[b]"}
    text = drawn(seen)
    assert "a[red]:100:[/x]" in text
    assert "[b]" in text


def test_there_is_nothing_to_see_before_the_first_row():
    with mirrored(logged(0)) as theirs:
        assert theirs.read() is None


def test_a_picture_waits_for_the_next_row_as_long_as_one_is_due():
    log = logged(0)
    with mirrored(log) as theirs:
        add(log, range(1))
        theirs.await_next()  # nobody writes: two periods, and it goes on
        assert theirs.read()["t"] == 0.0
        over = threading.Event()

        def write():
            k = 1
            while not over.wait(0.001):
                add(log, [k])
                k += 1

        thread = threading.Thread(target=write)
        thread.start()
        before = theirs._number[0]
        theirs.await_next()
        assert theirs._number[0] != before
        over.set()
        thread.join()


def test_a_row_is_read_whole_or_not_at_all():
    log = logged(0)
    with mirrored(log) as theirs:
        over = threading.Event()

        def write():
            while not over.is_set():
                add(log, range(2))

        thread = threading.Thread(target=write)
        thread.start()
        found = []
        while len(found) < 200:
            seen = theirs.read()
            if seen is not None:
                found.append((seen["t"], seen["pose"][0]))
        over.set()
        thread.join()
    assert set(found) <= {(0.0, 0.0), (0.02, 1.0)}


def watched(tmp_path, *words, interrupt=None):
    """Run a command whose standard error is a terminal; return what was drawn, and its end."""
    screen, side = pty.openpty()
    process = subprocess.Popen(
        [DMPCLI, *map(str, words)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=side,
        cwd=tmp_path,
        env=os.environ | {"TERM": "xterm", "COLUMNS": "100"},
    )
    os.close(side)
    text = b""
    until = time.monotonic() + 60.0
    with contextlib.suppress(OSError):  # the other end has closed
        while time.monotonic() < until:
            more = os.read(screen, 65536)
            if not more:
                break
            text += more
            if interrupt is not None and interrupt in text:
                process.send_signal(signal.SIGINT)
                interrupt = None
    os.close(screen)
    process.communicate(timeout=30)
    return text.decode(errors="replace"), process.returncode


@pytest.mark.thorough
def test_a_person_at_the_terminal_sees_the_run_and_every_message(tmp_path):
    written(tmp_path / "traj.parquet", columns(duration=10.0))
    words = ["execute", "traj.parquet", "-o", "run.parquet", "--realtime"]
    # Another test may keep this computer busy.
    words += ["--robot", "mock:?lag=0.4", "--following-error", "200"]
    text, code = watched(tmp_path, *words)
    assert code == 0, text
    for said in ("streaming; Ctrl-C decelerates", "executing", "worst so far", "ended", "done"):
        assert said in text, said
    quiet, code = watched(tmp_path, *words, "--force", "-q")
    assert code == 0
    assert "executing" not in quiet


@pytest.mark.slow
def test_ctrl_c_ends_the_run_and_the_view_with_it(tmp_path):
    written(tmp_path / "traj.parquet", columns(duration=40.0))
    words = ["execute", "traj.parquet", "-o", "run.parquet", "--realtime"]
    words += ["--robot", "mock:?lag=0.4", "--following-error", "200"]
    text, code = watched(tmp_path, *words, interrupt=b"executing")
    assert code == 130, text
    assert "SIGINT" in text
    assert "Traceback" not in text


@pytest.mark.slow
def test_into_a_pipe_nothing_is_drawn(tmp_path):
    written(tmp_path / "traj.parquet", columns(duration=2.0))
    done = subprocess.run(
        [DMPCLI, "execute", "traj.parquet", "-o", "run.parquet", "--realtime", "--robot",
         "mock:?lag=0.4", "--following-error", "200"],
        cwd=tmp_path, capture_output=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert b"executing" not in done.stderr
    assert b"\x1b" not in done.stderr


def test_a_view_that_cannot_be_had_costs_nothing(monkeypatch):
    monkeypatch.setattr(watching, "watched", lambda: True)

    def fail(*_, **__):
        raise OSError("no processes left")

    monkeypatch.setattr(watching.subprocess, "Popen", fail)
    view = watching.RunView("executing", logged(0).rows, 0.02)
    with watching.live(lambda: view, True) as ended:
        ended("done")


class Screen:
    """A process that draws, as far as the loop's side knows it."""

    pid = 4711

    def __init__(self, said=b"", ended=None):
        ours, theirs = os.pipe()
        os.write(theirs, said)
        self.stdout, self._theirs = os.fdopen(ours, "rb", buffering=0), theirs
        self.stdin, self.ended, self.calls = io.StringIO(), ended, []
        self.hangs = False

    def poll(self):
        return self.ended

    def wait(self, patience=None):
        self.calls.append(f"wait {patience}")
        if self.hangs and patience is not None:
            raise subprocess.TimeoutExpired("view", patience)

    def kill(self):
        self.calls.append("kill")

    def leave(self):
        os.close(self._theirs)
        self.stdout.close()


@pytest.fixture
def screen():
    made = []

    def make(*given, **more):
        made.append(Screen(*given, **more))
        return made[-1]

    yield make
    for one in made:
        one.leave()


def test_the_view_is_waited_for_until_it_says_that_it_is_ready(screen, monkeypatch):
    seen = screen(live_view.READY + b"more")
    watching._await(seen)
    assert os.read(seen.stdout.fileno(), 99) == b"more"
    monkeypatch.setattr(watching, "_PATIENCE", 0.01)
    watching._await(screen())  # and not for ever


def test_the_view_is_told_a_line_at_a_time_and_why_the_run_ended(screen, monkeypatch):
    asked = []
    monkeypatch.setattr(
        os,
        "sched_setscheduler",
        lambda pid, kind, given: asked.append((pid, kind, given)),
        raising=False,
    )
    seen = screen()
    assert watching._written(seen, live_view.ABOVE, 'a "word"')
    watching._ended(seen, "done")
    assert seen.stdin.getvalue() == '+"a \\"word\\""\n="done"\n'
    assert asked == [(4711, os.SCHED_OTHER, os.sched_param(0))]


def test_a_view_that_is_gone_is_told_nothing(screen):
    gone = screen(ended=0)
    assert not watching._written(gone, live_view.ABOVE, "a")
    assert gone.stdin.getvalue() == ""
    closed = screen()
    closed.stdin.close()
    assert not watching._written(closed, live_view.ABOVE, "a")
    closed.stdin = None
    assert not watching._written(closed, live_view.ABOVE, "a")


def test_a_view_has_its_time_to_end_and_is_then_ended(screen):
    seen = screen()
    watching._end(seen)
    assert (seen.stdin.closed, seen.stdout.closed) == (True, True)
    assert seen.calls == [f"wait {watching._PATIENCE}"]
    stuck = screen()
    stuck.hangs, stuck.stdin = True, None
    watching._end(stuck)
    assert stuck.calls == [f"wait {watching._PATIENCE}", "kill", "wait None"]


def test_while_it_is_watched_rows_and_messages_go_to_the_view(screen, monkeypatch):
    monkeypatch.setattr(watching, "watched", lambda: True)
    seen, started = screen(live_view.READY), []

    def popen(words, **given):
        started.append((words, given))
        return seen

    monkeypatch.setattr(watching.subprocess, "Popen", popen)
    monkeypatch.setattr(os, "sched_setscheduler", lambda *_: None, raising=False)
    log = logged(0)
    with watching.live(lambda: watching.RunView("executing", log.rows, 0.02, 3.0), True) as ended:
        assert log.rows.mirror is not None
        add(log, range(3))
        [(words, given)] = started
        file = int(words[3])
        assert given["pass_fds"] == (file,)
        assert (given["stdin"], given["stdout"], given["text"]) == (-1, -1, True)
        assert given["start_new_session"]
        view = RowView.of_json(words[4])
        assert (view.title, view.period, view.whole) == ("executing", 0.02, 3.0)
        assert SharedRow(file, view).read()["pose"][0] == 2.0
        ended("done")
        assert seen.stdin.getvalue().endswith('="done"\n')
    assert log.rows.mirror is None
    assert seen.stdin.closed
    assert seen.calls == [f"wait {watching._PATIENCE}"]


def test_nothing_is_watched_where_nobody_asks_or_sits_there(monkeypatch):
    def never():
        raise AssertionError

    monkeypatch.setattr(watching, "watched", lambda: True)
    with watching.live(never, False) as ended:
        ended("done")
    monkeypatch.setattr(watching, "watched", lambda: False)
    with watching.live(never, True) as ended:
        ended("done")


def test_a_view_of_plans_shows_the_share_of_all_of_them():
    bench = Bench(plan(stroke(1.0)))
    view = watching.of_plan(bench.loop)
    assert (view.title, view.rows, view.period) == ("executing", bench.loop.log.rows, 0.02)
    assert view.whole == pytest.approx(51 * 0.02)
    assert (view.of_rows().groups, view.of_rows().texts) == (
        view.rows.groups,
        list(view.rows.texts),
    )


def test_pipes_that_are_broken_or_closed_end_nothing_else(screen):
    for error in (OSError, ValueError):

        def fail(error=error):
            raise error

        seen = screen()
        pipe, seen.stdin = seen.stdout, SimpleNamespace(close=fail)
        seen.stdout = SimpleNamespace(close=fail)
        watching._end(seen)
        assert seen.calls == [f"wait {watching._PATIENCE}"]
        seen.stdout = pipe

"""execute --goal-from: the goal moves while the stroke is drawn."""

import json
import socket
import threading
from functools import partial

import numpy as np
import pytest

from dmpcli.instruments.goal_sources import DATAGRAM
from dmpcli.records import file_io, record, schemas
from tests.commands.running import ended
from tests.commands.test_execute import columns, written

execute = partial(ended, "execute")
GOAL = np.array([-551.03 - 109.0, 131.399, -17.56])


@pytest.fixture
def traj(tmp_path):
    return written(tmp_path / "traj.parquet", columns(duration=4.0))


@pytest.fixture
def goals(tmp_path):
    path = tmp_path / "goals.csv"
    path.write_text("t,x,y,z\n1,-650,140,-17.5\n2,-655,125,-30\n3,-665,125,-17.6\n")
    return path


def run_of(path):
    return record.decode(file_io.read(path), schemas.RUN)


def test_the_run_ends_at_the_last_goal_that_was_taken_and_holds_them_all(traj, goals, tmp_path):
    out = tmp_path / "run.parquet"
    done = execute(traj, "-o", out, "--goal-from", goals)
    assert "off the plane: -12.44 mm" in done.stderr
    assert "2 goals taken from" in done.stderr
    kept = run_of(out)
    facts = kept.provenance.facts["goals"]
    assert [one["t"] for one in facts["taken"]] == [1.0, 3.0]
    np.testing.assert_allclose(facts["last"], [-665.0, 125.0, -17.56], atol=1e-9)
    assert facts["not_taken"] == {"off the plane": 1}
    np.testing.assert_allclose(kept.position("sent")[-1], facts["last"], atol=1e-9)
    np.testing.assert_allclose(kept.position()[-1], facts["last"], atol=0.05)
    assert set(kept.columns["xg"]) == {GOAL[0], -650.0, -665.0}
    assert {one["role"] for one in kept.provenance.inputs} == {"trajectory", "goals"}
    again = tmp_path / "again.parquet"
    execute(traj, "-o", again, "--goal-from", goals)
    assert again.read_bytes() == out.read_bytes()


def test_the_report_measures_a_stroke_against_the_goal_that_it_was_led_to(traj, goals, tmp_path):
    out = tmp_path / "run.parquet"
    execute(traj, "-o", out, "--goal-from", goals, "-q")
    (row,) = json.loads(ended("report", out, "--json").stdout)["files"][0]["strokes"]
    np.testing.assert_allclose(row["goal"], [-665.0, 125.0, -17.56], atol=1e-9)


@pytest.mark.slow
def test_pressed_the_goal_moves_along_the_plane_and_the_force_is_held(traj, goals, tmp_path):
    out = tmp_path / "run.parquet"
    pressed = ["--coupling", "force", "--clearance", "25"]
    execute(traj, "-o", out, "--goal-from", goals, *pressed)
    kept = run_of(out)
    drawn = kept.columns["phase"] == "stroke"
    assert kept.provenance.facts["contact"]["rms_error"] < 0.2
    assert kept.provenance.facts["contact"]["share"] > 0.99
    end = kept.position("sent")[np.flatnonzero(drawn)[-1]]
    np.testing.assert_allclose(end[:2], [-665.0, 125.0], atol=0.02)
    assert len(np.flatnonzero(kept.columns["phase"] == "retract")) > 20


def test_goals_come_as_datagrams(traj, tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    over = threading.Event()

    def send():
        number = 0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not over.wait(0.001):
                number += 1
                content = DATAGRAM.pack(b"DMPg", number, -650.0, 140.0, -17.56)
                sender.sendto(content, ("127.0.0.1", port))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        out = tmp_path / "run.parquet"
        execute(traj, "-o", out, "--goal-from", f"udp://:{port}")
    finally:
        over.set()
        thread.join()
    np.testing.assert_allclose(run_of(out).position("sent")[-1], [-650.0, 140.0, -17.56], atol=1e-9)
    assert run_of(out).provenance.options["goal_from"] == "udp"


def test_where_nobody_sends_it_is_told_and_drawn_as_planned(traj, tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    out = tmp_path / "run.parquet"
    done = execute(traj, "-o", out, "--goal-from", f"udp://:{port}")
    assert "no goal comes: for 1 s" in done.stderr
    assert "no goal was taken" in done.stderr
    np.testing.assert_array_equal(run_of(out).position("sent")[-1], GOAL)


def said(*words, expect):
    return ended("execute", *words, "--dry-run", expect=expect).stderr.splitlines()[-1]


def test_what_cannot_have_a_goal_that_moves_is_refused(traj, goals, tmp_path):
    bent = columns(duration=4.0)
    lean = np.linspace(0.0, 0.1, len(bent["t"]))
    bent |= {"nx": np.sin(lean), "ny": 0.0 * lean, "nz": np.cos(lean)}
    curved = written(tmp_path / "curved.parquet", bent, normal=None)
    assert "curved surface" in said(curved, "--goal-from", goals, expect=3)
    two = [columns(4.0, name=name) for name in "ab"]
    both = {key: np.concatenate([one[key] for one in two]) for key in two[0]}
    several = written(tmp_path / "two.parquet", both)
    assert "2 are to be drawn" in said(several, "--goal-from", goals, expect=2)
    bare = written(tmp_path / "bare.parquet", columns(4.0), normal=None)
    assert "which plane" in said(bare, "--goal-from", goals, expect=2)
    played = ["--robot", "elite://127.0.0.9?mode=file", "--goal-from", goals]
    assert "whole plan by itself" in said(traj, *played, expect=2)
    assert "udp://HOST:PORT" in said(traj, "--goal-from", "udp://127.0.0.1", expect=2)
    assert "missing.csv" in said(traj, "--goal-from", tmp_path / "missing.csv", expect=2)

"""Many strokes in one run, judged by the poses in the run file against geometry computed here."""

import json
import os
import signal
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.records import file_io, record, schemas
from dmpcli.records.record import Provenance, Record
from tests.commands.running import ended
from tests.minimum_jerk import minimum_jerk

PERIOD = 0.02
ORIGIN = np.array([-550.0, 130.0, -17.5])
LEAN = Rotation.from_euler("xy", [8.0, -12.0], degrees=True).as_matrix()
NORMAL = LEAN @ [0.0, 0.0, 1.0]
FACTS = {"k": [100.0] * 6, "d": [20.0] * 6, "tau": 2.0, "alpha_e": [5.0] * 6}
FACTS |= {"model": "modified"}
PLACES = {"a": (0, 0, 0.0), "b": (70, -60, 0.6), "c": (-90, 30, -1.0), "d": (40, 80, 2.5)}
LIMITS = (250.0, 2250.0, 50_000.0, 0.785, 15.0, 333.0)
"""Defaults of execute: speed, acceleration, jerk of the tip and of the rotation."""


def columns(name, place, seconds=4.0, rate=50.0, lean=LEAN):
    """One sine period of 60 mm by 10 mm on the leaning plane, from (x, y) and heading in it."""
    x, y, heading = place
    t = np.arange(round(seconds * rate) + 1) / rate
    u = minimum_jerk(t / seconds)
    local = np.stack([60.0 * u, 10.0 * np.sin(2 * np.pi * u), 0.0 * u], axis=-1)
    flat = Rotation.from_euler("z", heading).apply(local) + [x, y, 0.0]
    p = ORIGIN + flat @ lean.T
    pen = lean @ Rotation.from_euler("z", heading).as_matrix() @ np.diag([1.0, -1.0, -1.0])
    angles = np.tile(Rotation.from_matrix(pen).as_euler("XYZ"), (len(t), 1))
    out = {"id": np.array([name] * len(t), dtype=object), "t": t}
    out |= dict(zip("xyz", p.T, strict=True))
    return out | dict(zip(("rx", "ry", "rz"), angles.T, strict=True))


def save(path, cols, schema=schemas.TRAJECTORY, facts=FACTS):
    path.write_bytes(record.encode(Record(schema, cols, Provenance("generalize", {}, (), facts))))
    return path


def made(folder, places=PLACES, failed=(), part_size=2, seconds=4.0):
    """A batch as generalize writes it: parts in pair order, and the table of pairs."""
    folder.mkdir()
    names = [*places, *failed]
    strokes = {name: columns(name, place, seconds) for name, place in places.items()}
    part_of = {}
    good = list(places)
    for number, first in enumerate(range(0, len(good), part_size)):
        members = good[first : first + part_size]
        each = [strokes[name] for name in members]
        part = f"part-{number:05d}.parquet"
        save(folder / part, {k: np.concatenate([c[k] for c in each]) for k in each[0]})
        part_of |= dict.fromkeys(members, part)
    ends = {"0": 0, "g": -1}
    pairs = {
        "id": np.array(names, dtype=object),
        "part": np.array([part_of.get(name, "") for name in names], dtype=object),
        "status": np.array(
            ["ok" if name in strokes else f"pair {name}: 3 mm off the plane" for name in names],
            dtype=object,
        ),
    }
    pairs |= {
        axis + end: np.array([strokes[n][axis][i] if n in strokes else np.nan for n in names])
        for end, i in ends.items()
        for axis in "xyz"
    }
    pairs |= {
        f"n{axis}": np.full(len(names), value) for axis, value in zip("xyz", NORMAL, strict=True)
    }
    save(folder / "pairs.parquet", pairs, schemas.PAIRS)
    return folder


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    return made(tmp_path_factory.mktemp("many") / "batch")


execute = partial(ended, "execute")


def run_of(path):
    return record.decode(file_io.read(path), schemas.RUN)


@pytest.fixture(scope="module")
def drawn(batch, tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "run.parquet"
    execute(batch, "-o", out)
    return run_of(out)


def rows_of(run, name):
    return run.columns["id"] == name


def height(position):
    """Distance from the plane that the strokes lie on, by its equation."""
    return (position - ORIGIN) @ NORMAL


def goal_of(name, place):
    cols = columns(name, place)
    return np.array([cols[axis][-1] for axis in "xyz"])


@pytest.mark.slow
def test_all_strokes_are_drawn_in_pair_order_as_planned(drawn):
    ids = [name for name in drawn.columns["id"] if name is not None]
    assert list(dict.fromkeys(ids)) == list(PLACES)
    for name, place in PLACES.items():
        rows = rows_of(drawn, name)
        expected = columns(name, place)
        planned = np.stack([expected[axis] for axis in "xyz"], axis=-1)
        np.testing.assert_array_equal(drawn.position("sent")[rows], planned)
        actual, fine = drawn.position()[rows], columns(name, place, rate=2000.0)
        path = np.stack([fine[axis] for axis in "xyz"], axis=-1)
        apart = np.linalg.norm(actual[:, None] - path[None], axis=-1).min(axis=1)
        assert apart.max() < 0.2, "the mock cuts corners by its lag"
        assert np.abs(height(actual)).max() < 0.02
    facts = drawn.provenance.facts
    assert facts["drawn"] == list(PLACES)
    assert facts["remaining"] == []
    assert (facts["reason"], facts["completed"]) == ("done", True)


def test_the_arm_reaches_each_end_before_the_pen_is_lifted(drawn):
    phases = drawn.columns["phase"]
    lifted = np.flatnonzero((phases[1:] == "retract") & (phases[:-1] == "stroke"))
    assert len(lifted) == len(PLACES)
    for row, (name, place) in zip(lifted, PLACES.items(), strict=True):
        end = goal_of(name, place)
        off = np.linalg.norm(drawn.position()[row : row + 10] - end, axis=1)
        assert off.min() < 0.02
        side = drawn.position() - end
        side = np.linalg.norm(side - np.outer(side @ NORMAL, NORMAL), axis=1)
        retract = np.arange(row + 4, row + 4 + 30)
        assert side[retract].max() < 0.02, "straight off, along the normal"


def test_the_pen_is_never_below_the_clearance_in_a_transfer(drawn):
    phases = drawn.columns["phase"]
    away = height(drawn.position())
    assert set(phases) == {"stroke", "retract", "transfer", "approach", "stop"}
    assert away[phases == "transfer"].min() > 20.0 - 0.05
    assert away.min() > -0.02
    assert away[-1] == pytest.approx(20.0, abs=0.05), "it ends off the work"


def test_ids_are_null_where_no_stroke_is_drawn(drawn):
    phases, ids = drawn.columns["phase"], drawn.columns["id"]
    assert all(name is None for name in ids[np.isin(phases, ("retract", "transfer", "approach"))])
    assert all(name is not None for name in ids[phases == "stroke"])


def test_every_limit_is_kept_over_all_ways_by_finite_differences(drawn):
    np.testing.assert_allclose(np.diff(drawn.columns["deadline"]), PERIOD, atol=1e-9)
    turn = Rotation.from_matrix(drawn.rotation("sent"))
    steps = np.diff(drawn.position("sent"), axis=0), (turn[1:] * turn[:-1].inv()).as_rotvec()
    for step, limits in zip(steps, (LIMITS[:3], LIMITS[3:]), strict=True):
        for order, limit in enumerate(limits):
            rate = np.diff(np.pad(step, ((2, 2), (0, 0))), order, axis=0) / PERIOD ** (order + 1)
            assert np.linalg.norm(rate, axis=1).max() <= limit * 1.0001


@pytest.mark.slow
def test_each_way_keeps_its_own_speed(batch, tmp_path):
    out = tmp_path / "run.parquet"
    execute(batch, "-o", out, "--transfer-speed", 60, "--retract-speed", 15, "--clearance", 12)
    run = run_of(out)
    speed = np.linalg.norm(np.diff(run.position("sent"), axis=0), axis=1) / PERIOD
    phases = run.columns["phase"][1:]
    assert 55.0 < speed[phases == "transfer"].max() <= 60.0 + 1e-6
    assert 14.0 < speed[phases == "retract"].max() <= 15.0 + 1e-6
    away = height(run.position())[run.columns["phase"] == "transfer"]
    assert 12.0 - 0.05 < away.min() < 13.0


@pytest.mark.slow
def test_the_ids_that_are_asked_for_are_drawn_in_the_order_given(batch, tmp_path):
    out = tmp_path / "run.parquet"
    execute(batch, "-o", out, "--id", "d", "--id", "a")
    run = run_of(out)
    ids = [name for name in run.columns["id"] if name is not None]
    assert list(dict.fromkeys(ids)) == ["d", "a"]
    assert run.provenance.options["id"] == ["d", "a"]
    roles = [entry["role"] for entry in run.provenance.inputs]
    assert roles == ["pairs", "trajectory", "trajectory"]


@pytest.mark.slow
def test_the_same_run_gives_the_same_bytes(batch, tmp_path):
    for name in ("a", "b"):
        execute(batch, "-o", tmp_path / name, "--id", "a", "--id", "b")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_pairs_without_trajectory_are_named_and_the_others_drawn(tmp_path):
    some = dict(list(PLACES.items())[:2])
    folder = made(tmp_path / "batch", some, failed=[f"f{i}" for i in range(7)])
    out = tmp_path / "run.parquet"
    said = execute(folder, "-o", out, "-q").stderr
    assert "7 pairs have no trajectory and are not drawn: f0, f1, f2, f3, f4 and 2 more" in said
    assert "3 mm off the plane" in said
    facts = run_of(out).provenance.facts
    assert facts["drawn"] == ["a", "b"]
    assert facts["failed"] == [f"f{i}" for i in range(7)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (("--id", "x"), 2, "no stroke has the id x; it has a, b, f"),
        (("--id", "a", "--id", "f"), 2, "pair f has no trajectory: pair f: 3 mm off"),
        (("--id", "a", "--id", "a"), 2, "--id a: is given twice"),
        (("--clearance", 0.5), 2, "--clearance"),
        (("--transfer-speed", 0), 2, "--transfer-speed"),
        (("--workspace", -900, 0, -500, 500, -100, 0), 3, "in the"),
        (("--robot", "mock:?x=-400"), 3, "over the work with --approach"),
        (("--max-speed", 20), 3, "2 of 2 strokes fail: a, b"),
        (("--robot", "mock:?estop_at=0"), 3, "emergency stop"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_moves(tmp_path, options, code, words):
    folder = made(tmp_path / "batch", dict(list(PLACES.items())[:2]), failed=["f"])
    out = tmp_path / "run.parquet"
    said = execute(folder, "-o", out, *options, expect=code).stderr
    assert words in said.strip().splitlines()[-1]
    assert not out.exists()


def test_a_batch_without_any_trajectory_is_refused(tmp_path):
    folder = made(tmp_path / "batch", {}, failed=["f", "g"])
    said = execute(folder, "-o", tmp_path / "run.parquet", expect=2).stderr
    assert "no pair has a trajectory; the first, f: pair f: 3 mm off the plane" in said


def test_a_part_that_lacks_a_stroke_of_the_table_is_named(tmp_path):
    folder = made(tmp_path / "batch")
    save(folder / "part-00001.parquet", columns("c", PLACES["c"]))
    said = execute(folder, "-o", tmp_path / "run.parquet", expect=2).stderr
    assert "part-00001.parquet: holds no stroke d" in said


def test_an_arm_that_stands_on_the_work_is_led_over_it_when_asked(batch, tmp_path):
    out = tmp_path / "run.parquet"
    robot = f"mock:?x={ORIGIN[0] + 20}&y={ORIGIN[1]}&z={ORIGIN[2] + 10}"
    execute(batch, "-o", out, "--robot", robot, "--approach", 30, "--id", "b")
    run = run_of(out)
    lead = run.columns["phase"] != "stroke"
    lead &= np.arange(len(run)) < np.argmax(run.columns["phase"] == "stroke")
    way = run.position()[lead]
    assert way[0] == pytest.approx([ORIGIN[0] + 20, ORIGIN[1], ORIGIN[2] + 10])
    aside = np.linalg.norm(way[:, :2] - way[0, :2], axis=1)
    start = np.array([columns("b", PLACES["b"])[axis][0] for axis in "xyz"])
    far = np.linalg.norm(way - start, axis=1) > 30.0
    assert height(way)[(aside > 1.0) & far].min() > 19.9
    speed = np.linalg.norm(np.diff(run.position("sent")[lead], axis=0), axis=1) / PERIOD
    assert speed.max() <= 30.0 + 1e-6


@pytest.mark.slow
def test_a_tenth_of_the_speed_slows_strokes_and_ways(batch, tmp_path):
    fast, slow = tmp_path / "fast", tmp_path / "slow"
    execute(batch, "-o", fast, "--id", "a", "--id", "b")
    execute(batch, "-o", slow, "--id", "a", "--id", "b", "--speed", 0.1)
    for phase in ("stroke", "transfer", "retract", "approach"):
        durations = [np.count_nonzero(run_of(p).columns["phase"] == phase) for p in (fast, slow)]
        assert 7.0 < durations[1] / durations[0] < 10.1, phase


def test_one_stroke_of_a_file_is_lifted_only_when_asked(tmp_path):
    one = save(
        tmp_path / "t.parquet", columns("a", PLACES["a"]), facts=FACTS | {"normal": NORMAL.tolist()}
    )
    out = tmp_path / "run.parquet"
    execute(one, "-o", out)
    assert set(run_of(out).columns["phase"]) == {"stroke", "stop"}
    assert run_of(out).provenance.options["id"] == "a"
    execute(one, "-o", out, "--clearance", 15)
    run = run_of(out)
    assert "retract" in run.columns["phase"]
    assert height(run.position())[-1] == pytest.approx(15.0, abs=0.02)


def test_several_strokes_of_one_file_are_drawn_too(tmp_path):
    each = [columns(name, PLACES[name]) for name in "ab"]
    whole = {k: np.concatenate([c[k] for c in each]) for k in each[0]}
    both = save(tmp_path / "t.parquet", whole, facts=FACTS | {"normal": NORMAL.tolist()})
    out = tmp_path / "run.parquet"
    execute(both, "-o", out)
    assert run_of(out).provenance.facts["drawn"] == ["a", "b"]
    assert height(run_of(out).position())[run_of(out).columns["phase"] == "transfer"].min() > 19.9


@pytest.mark.slow
def test_a_dry_run_tells_a_line_per_stroke_and_of_many_the_worst(batch, tmp_path):
    said = execute(batch, "--dry-run").stderr.splitlines()
    assert said[0].startswith("4 strokes: ")
    assert [line.split()[0] for line in said[2:6]] == list(PLACES)
    assert said[-1] == "may be executed"
    rng = np.random.default_rng(1)
    places = {str(i): (*rng.uniform(-150, 150, 2), 0.0) for i in range(30)}
    many = made(tmp_path / "many", places, part_size=7)
    said = execute(many, "--dry-run", "--max-jerk", 150, expect=3).stderr.splitlines()
    assert said[0].startswith("30 strokes: ")
    assert len(said) < 28
    assert sum("TOO MUCH" in line for line in said) == 20
    assert "refused: 30 of 30" in said


# --- pressing


@pytest.mark.thorough
def test_the_coupling_presses_during_strokes_only(batch, tmp_path):
    out = tmp_path / "run.parquet"
    execute(batch, "-o", out, "--coupling", "force", "--force-setpoint", 5)
    run = run_of(out)
    phases = run.columns["phase"]
    force = run.stack(schemas.FORCE) @ NORMAL
    for name in PLACES:
        rows = rows_of(run, name) & (phases == "stroke")
        assert abs(force[rows].mean() - 5.0) < 0.2, name
        assert force[rows].min() > 2.0, name
    assert np.abs(force[phases == "transfer"]).max() < 0.5
    assert height(run.position())[phases == "transfer"].min() > 20.0 - 0.05
    off = ~np.isin(phases, ("stroke", "approach", "stop"))
    assert np.all(run.columns["coupling"][off] == 0.0)
    assert run.columns["coupling"][phases == "stroke"].max() < 0.0
    sent = np.linalg.norm(np.diff(run.position("sent"), axis=0), axis=1) / PERIOD
    assert sent.max() <= 250.0
    accelerated = np.linalg.norm(np.diff(run.position("sent"), 2, axis=0), axis=1) / PERIOD**2
    assert accelerated.max() <= 2250.0
    assert run.provenance.facts["drawn"] == list(PLACES)


@pytest.mark.slow
def test_a_stroke_that_finds_no_contact_ends_the_run_and_says_what_is_left(batch, tmp_path):
    out = tmp_path / "run.parquet"
    options = ("--coupling", "force", "--robot", "mock:?plate=none")
    said = execute(batch, "-o", out, *options, expect=3).stderr.splitlines()[-1]
    assert "no contact" in said
    assert "0 of 4 strokes are drawn; the rest: --id a --id b --id c --id d" in said
    assert run_of(out).provenance.facts["remaining"] == list(PLACES)


# --- what stops a run


@pytest.mark.slow
def test_after_an_emergency_stop_the_rest_is_named_and_can_be_drawn(batch, tmp_path):
    out, rest = tmp_path / "run.parquet", tmp_path / "rest.parquet"
    said = execute(batch, "-o", out, "--robot", "mock:?estop_at=14", expect=3).stderr
    last = said.splitlines()[-1]
    assert "emergency stop" in last
    assert "2 of 4 strokes are drawn; the rest: --id c --id d" in last
    run = run_of(out)
    assert run.provenance.facts["drawn"] == ["a", "b"]
    x, y, z = run.position()[-1]
    robot = f"mock:?x={x}&y={y}&z={z}"
    execute(
        batch, "-o", rest, *last.split("the rest: ")[1].split(), "--approach", 50, "--robot", robot
    )
    assert run_of(rest).provenance.facts["drawn"] == ["c", "d"]


@pytest.mark.slow
def test_ctrl_c_in_the_air_decelerates_on_the_path_and_the_rest_is_named(tmp_path):
    """In real time, in a process of its own; the signal comes where the simulated run was."""
    batch, out = made(tmp_path / "batch", seconds=1.5), tmp_path / "run.parquet"
    # A long look-ahead: on a busy computer a short one ends the run for being late.
    command = [str(batch), "-o", str(out), "--robot", "mock:?lag=0.2"]
    execute(*command)
    drawn = run_of(out)
    when = drawn.t[drawn.columns["phase"] == "transfer"]
    at = float(when[when < when[0] + 2.0].mean())
    with subprocess.Popen(
        [sys.executable, "-m", "dmpcli", "execute", *command, "--realtime"],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    ) as process:
        assert "streaming" in process.stderr.readline()
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(at)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 130, errors
    last = errors.splitlines()[-1]
    assert "decelerated along the path; 1 of 4 strokes are drawn; the rest: --id b" in last
    run = run_of(out)
    assert run.columns["phase"][-1] == "stop"
    assert run.provenance.facts["drawn"] == ["a"]
    assert run.provenance.facts["remaining"] == ["b", "c", "d"]
    stopped = run.columns["phase"] == "stop"
    way, sent = drawn.position("sent"), run.position("sent")[stopped]
    off = [np.linalg.norm(way - p, axis=1).min() for p in sent]
    assert max(off) < 2.5, "set-points of the path are up to 4 mm apart"
    moved = np.linalg.norm(np.diff(run.position()[-3:], axis=0), axis=1) / np.diff(run.t[-3:])
    assert moved.max() < 1.0, "at rest"


# --- report


@pytest.mark.slow
def test_report_measures_each_stroke_of_a_run(batch, tmp_path):
    out = tmp_path / "run.parquet"
    execute(batch, "-o", out)
    result = CliRunner().invoke(app, ["report", str(out), "--json"])
    assert result.exit_code == 0, result.stderr
    (entry,) = json.loads(result.stdout)["files"]
    assert [row["stroke"] for row in entry["strokes"]] == [f"run[{name}]" for name in PLACES]
    for row in entry["strokes"]:
        # Two bulges of 10 mm: one height of 20 mm from crest to trough.
        assert row["wave"]["mean"] == pytest.approx(20.0, abs=0.1)
        assert row["goal_error"] < 0.1
    assert entry["states"] == {"ok": 4}


@pytest.mark.slow
def test_report_and_inspect_say_what_a_stopped_run_lacks(batch, tmp_path):
    out = tmp_path / "run.parquet"
    execute(batch, "-o", out, "--robot", "mock:?estop_at=14", expect=3)
    said = CliRunner().invoke(app, ["report", str(out)])
    assert said.exit_code == 0, said.stderr
    assert "2 drawn, 2 not" in said.stdout
    said = CliRunner().invoke(app, ["inspect", str(out)])
    assert said.exit_code == 0, said.stderr
    assert "remaining" in said.stdout

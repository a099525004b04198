import dataclasses
import json
import os
import signal
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.errors import InputError
from dmpcli.records import file_io, record, schemas, tool
from dmpcli.records.record import Provenance, Record
from dmpcli.simulation.mock import PEN
from dmpcli.workflows.execute import ExecutionRequest, check_output
from tests.commands.running import ended
from tests.minimum_jerk import minimum_jerk

START = np.array([-551.030, 131.399, -17.560])
FACTS = {"k": [100.0] * 6, "d": [20.0] * 6, "tau": 5.0, "alpha_e": [5.0] * 6}
REALTIME = ["--realtime", "--robot", "mock:?lag=0.2"]


def columns(duration=10.0, rate=50.0, name="0", oriented=True):
    t = np.arange(round(duration * rate) + 1) / rate
    u = minimum_jerk(t / duration)
    out = {
        "id": np.array([name] * len(t), dtype=object),
        "t": t,
        "x": START[0] - 109.0 * u,
        "y": START[1] + 25.0 * np.sin(2 * np.pi * u),
        "z": START[2] + 0.0 * u,
    }
    if oriented:
        out |= {"rx": np.full(len(t), np.pi), "ry": 0.0 * u, "rz": 0.4 * u}
    return out


def written(path, cols, normal=(0.0, 0.0, 1.0), schema=schemas.TRAJECTORY):
    facts = FACTS if normal is None else FACTS | {"normal": list(normal)}
    path.write_bytes(record.encode(Record(schema, cols, Provenance("generalize", {}, (), facts))))
    return path


@pytest.fixture
def traj(tmp_path):
    return written(tmp_path / "traj.parquet", columns())


execute = partial(ended, "execute")


def run_of(path):
    return record.decode(file_io.read(path), schemas.RUN)


def refused(*arguments, code, output=None):
    """Run the command to its error: one or two lines, nothing on stdout, no output touched."""
    result = execute(*arguments, expect=code)
    lines = result.stderr.strip().splitlines()
    assert 1 <= len(lines) <= 2, result.stderr
    assert lines[0].startswith("dmpcli: ")
    assert result.stdout == ""
    if output is not None:
        assert not output.exists()
    return lines[-1]


def test_a_run_holds_what_was_planned_sent_and_done(traj, tmp_path):
    out = tmp_path / "run.parquet"
    execute(traj, "-o", out)
    run = run_of(out)
    stroke = run.columns["phase"] == "stroke"
    planned = record.decode(file_io.read(traj)).position()
    np.testing.assert_array_equal(run.position("plan")[stroke], planned)
    np.testing.assert_array_equal(run.position("sent")[stroke], planned)
    assert np.linalg.norm(run.position()[-1] - planned[-1]) < 0.05
    assert np.linalg.norm(run.position()[stroke] - planned, axis=1).max() > 0.5, "the mock lags"
    np.testing.assert_allclose(run.columns["t_plan"][stroke], np.arange(501) * 0.02, atol=1e-9)
    np.testing.assert_allclose(run.columns["rz_plan"][stroke][-1], 0.4)
    assert set(run.columns["state"]) == {"ready"}
    assert not run.has("fx")
    facts = run.provenance.facts
    assert facts["reason"] == "done"
    assert (facts["completed"], facts["missed"], facts["simulated"]) == (True, 0, True)
    assert facts["trajectory"]["tau"] == 5.0
    assert "lateness" not in facts
    assert run.provenance.inputs == ({"role": "trajectory", "sha256": file_io.read(traj).sha256},)


@pytest.mark.slow
def test_the_same_run_gives_the_same_bytes(traj, tmp_path):
    for name in ("a", "b"):
        extra = ("--coupling", "force", "--force-setpoint", 5)
        execute(traj, "-o", tmp_path / name, *extra)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.slow
def test_standard_input_and_output(traj, tmp_path):
    command = [sys.executable, "-m", "dmpcli", "execute", "-", "-o", "-"]
    done = subprocess.run(command, input=traj.read_bytes(), capture_output=True, check=True)
    piped = tmp_path / "piped.parquet"
    piped.write_bytes(done.stdout)
    execute(traj, "-o", tmp_path / "named.parquet")
    assert piped.read_bytes() == (tmp_path / "named.parquet").read_bytes()


@pytest.mark.slow
def test_half_the_speed_takes_twice_the_time(traj, tmp_path):
    execute(traj, "-o", tmp_path / "run.parquet", "--speed", 0.5)
    run = run_of(tmp_path / "run.parquet")
    assert np.count_nonzero(run.columns["phase"] == "stroke") == 1001
    assert run.provenance.options["speed"] == 0.5


def test_a_missing_orientation_holds_the_arms(tmp_path):
    traj = written(tmp_path / "traj.parquet", columns(oriented=False))
    execute(traj, "-o", tmp_path / "run.parquet", "--robot", "mock:?rx=3.0&ry=0.1&rz=-0.5")
    run = run_of(tmp_path / "run.parquet")
    assert not run.has("rx_plan")
    for name, angle in (("rx_sent", 3.0), ("ry_sent", 0.1), ("rz_sent", -0.5)):
        np.testing.assert_allclose(run.columns[name], angle, atol=1e-9)


def test_a_dry_run_shows_the_verdict_and_writes_nothing(traj, tmp_path):
    out = tmp_path / "run.parquet"
    result = execute(traj, "-o", out, "--dry-run")
    assert "may be executed" in result.stderr
    assert "acceleration" in result.stderr
    assert result.stdout == ""
    assert not out.exists()
    result = execute(traj, "--dry-run", "--max-speed", 20, expect=3)
    assert "TOO MUCH" in result.stderr
    assert result.stderr.splitlines()[-1].startswith("dmpcli: speed 35.8")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--max-speed", 20), "--max-speed"),
        (("--max-acceleration", 20), "--max-acceleration"),
        (("--max-jerk", 20), "--max-jerk"),
        (("--max-rotation-speed", 0.05), "--max-rotation-speed"),
        (("--max-rotation-acceleration", 0.02), "--max-rotation-acceleration"),
        (("--max-rotation-jerk", 0.02), "--max-rotation-jerk"),
        (("--workspace", -600, 0, 0, 300, -50, 50), "workspace in x"),
        (("--robot", "mock:?x=-540"), "--approach"),
        (("--robot", "mock:?rz=0.1"), "--approach"),
        (("--robot", "mock:?estop_at=0"), "emergency stop"),
    ],
)
def test_what_breaks_a_limit_is_refused_before_anything_moves(traj, tmp_path, options, words):
    out = tmp_path / "run.parquet"
    assert words in refused(traj, "-o", out, *options, code=3, output=out)


@pytest.mark.parametrize(("rows", "remedy"), [((150, 501), "--ease-in"), ((0, 300), "--ease-out")])
def test_a_stroke_in_motion_at_an_end_is_refused(tmp_path, rows, remedy):
    cut = {name: column[slice(*rows)] for name, column in columns().items()}
    traj = written(tmp_path / "traj.parquet", cut)
    out = tmp_path / "run.parquet"
    assert remedy in refused(traj, "-o", out, code=3, output=out)


def test_an_approach_leads_to_the_start(traj, tmp_path):
    out = tmp_path / "run.parquet"
    execute(traj, "-o", out, "--robot", "mock:?x=-520&rz=0.1", "--approach", 30)
    run = run_of(out)
    phases = list(dict.fromkeys(run.columns["phase"]))
    assert phases == ["transfer", "approach", "stroke", "stop"]
    sent = run.position("sent")
    speed = np.linalg.norm(np.diff(sent, axis=0), axis=1) / 0.02
    ways = np.isin(run.columns["phase"][1:], ("transfer", "approach"))
    assert speed[ways].max() <= 30.0 + 1e-6
    # Up, across, and down: never along the plate, on which the pen may stand.
    across = np.linalg.norm(np.diff(sent[:, :2], axis=0), axis=1) > 1e-6
    on_the_way = ways & across
    assert on_the_way.sum() > 50
    np.testing.assert_allclose(sent[1:][on_the_way, 2], START[2] + 20.0, atol=1e-6)
    assert run.columns["z"][-1] == pytest.approx(START[2], abs=0.01), "the pen stays at the end"


def test_a_small_gap_is_bridged_smoothly(traj, tmp_path):
    out = tmp_path / "run.parquet"
    execute(traj, "-o", out, "--robot", "mock:?x=-550&y=132")
    sent = run_of(out).position("sent")
    np.testing.assert_allclose(sent[0], [-550.0, 132.0, -17.56], atol=1e-9)
    assert np.linalg.norm(np.diff(sent, 2, axis=0), axis=1).max() / 0.02**2 < 2250.0


# --- bad input: exit code 2, named, nothing touched


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--speed", 0), "--speed = 0"),
        (("--speed", "nan"), "--speed"),
        (("--speed", 1e-9), "--speed = 1e-09"),
        (("--speed", 11), "--speed = 11"),
        (("--robot", "mock:?x=-500", "--approach", 1e-6), "200000 set-points"),
        (("--period", -0.02), "--period"),
        (("--period", 1.0), "--period 1"),
        (("--max-jerk", "inf"), "--max-jerk"),
        (("--workspace", 0, -1, 0, 1, 0, 1), "workspace"),
        (("--robot", "elite://10.0.0.1?look=1"), "look: there is no such option; elite has"),
        (("--robot", "alien://10.0.0.1"), "no such instrument; a robot is one of mock:,"),
        (("--robot", "nonsense"), "nonsense"),
        (("--force-setpoint", 5), "--coupling force"),
        (("--coupling", "force", "--force-setpoint", 50), "is not below --max-force"),
        (("--max-force", 5), "nothing feels a force"),
        (("--id", "7"), "the id 7"),
        (("--preset", "nothing"), "nothing"),
        (("--tool", "missing.json"), "missing.json"),
    ],
)
def test_a_wrong_option_is_named(traj, tmp_path, options, words):
    out = tmp_path / "run.parquet"
    assert words in refused(traj, "-o", out, *options, code=2, output=out)


def test_an_output_is_needed_for_more_than_a_dry_run(traj):
    assert "--dry-run" in refused(traj, code=2)


def test_an_unstable_coupling_is_refused_by_name(traj, tmp_path):
    config = tmp_path / "c.toml"
    config.write_text("[execute]\ncoupling_mass = 0.01\ncoupling_damping = 2.0\n")
    options = ("--coupling", "force", "--force-setpoint", 5, "--config", config)
    out = tmp_path / "run.parquet"
    assert "unstable" in refused(traj, "-o", out, *options, code=2, output=out)


def test_gains_that_the_named_contact_makes_swing_are_refused_before_anything_moves(traj, tmp_path):
    config = tmp_path / "c.toml"
    config.write_text("[execute]\ncoupling_damping = 0.2\n")
    contact = ("--stiffness", 5, "--delay", 0.1)
    options = ("--coupling", "force", "--config", config, *contact)
    out = tmp_path / "run.parquet"
    said = refused(traj, "-o", out, *options, code=2, output=out)
    assert "unstable on a contact of 5 N/mm behind 0.1 s" in said


@pytest.mark.parametrize("weight", [6.0, 30.0])
def test_a_heavy_tool_makes_gains_swing_that_a_light_one_does_not(traj, tmp_path, weight):
    """The sensor feels its inertia, which on a soft contact is most of what it feels."""
    with open("sample_runs/bench_pen.json") as file:
        heavy = json.load(file)
    heavy["payload"]["weight"] = weight
    (tmp_path / "tool.json").write_text(json.dumps(heavy))
    config = tmp_path / "c.toml"
    config.write_text("[execute]\ncoupling_damping = 0.06\n")
    options = ("--coupling", "force", "--config", config, "--stiffness", 0.5, "--delay", 0.06)
    options += ("--tool", tmp_path / "tool.json", "--dry-run")
    if weight < 20.0:
        execute(traj, *options)
    else:
        said = refused(traj, *options, code=2)
        assert "unstable on a contact of 0.5 N/mm behind 0.06 s" in said


@pytest.mark.parametrize("force", [[-1.0], [np.nan], [2e4]])
def test_a_force_that_is_none_is_named_by_row(tmp_path, force):
    cols = columns()
    cols["fn"] = np.full(len(cols["t"]), 3.0)
    cols["fn"][6] = force[0]
    traj = written(tmp_path / "traj.parquet", cols)
    out = tmp_path / "run.parquet"
    said = refused(traj, "-o", out, "--coupling", "force", code=2, output=out)
    assert "column 'fn', row 7" in said


@pytest.mark.slow
def test_the_trajectorys_own_force_is_pressed_and_its_lifted_part_is_not(tmp_path):
    cols = columns()
    t = np.asarray(cols["t"])
    up = np.interp(t, [3.6, 4.4, 5.6, 6.4], [0.0, 3.0, 3.0, 0.0])
    cols["z"] = np.asarray(cols["z"]) + 3.0 * (up / 3.0) ** 2 * (3.0 - 2.0 * up / 3.0)
    cols["fn"] = np.where(up > 0.0, 0.0, np.where(t < 5.0, 3.0, 4.0))
    traj = written(tmp_path / "traj.parquet", cols)
    out = tmp_path / "run.parquet"
    result = execute(traj, "-o", out, "--coupling", "force")
    run = run_of(out)
    assert set(run.columns["fn"]) == {0.0, 3.0, 4.0}
    assert "lost" not in set(run.columns["contact"])
    stroke = run.columns["phase"] == "stroke"
    late = stroke & (run.columns["t_plan"] > 8.0)
    assert run.columns["fz"][late].mean() == pytest.approx(4.0, abs=0.1)
    assert abs(run.columns["fz"][stroke & (np.abs(run.columns["t_plan"] - 5.0) < 0.4)]).max() < 0.5
    assert "contact at" not in result.stderr


def test_a_plane_is_needed_to_press_on(tmp_path):
    traj = written(tmp_path / "traj.parquet", columns(), normal=None)
    options = ("--coupling", "force", "--force-setpoint", 5)
    out = tmp_path / "run.parquet"
    assert "normal" in refused(traj, "-o", out, *options, code=2, output=out)


def changed(name, row, value):
    cols = columns()
    cols[name] = cols[name].copy()
    cols[name][row] = value
    return cols


@pytest.mark.parametrize(
    ("cols", "words"),
    [
        (changed("t", 100, 1.0), "column 't', row 101"),
        (changed("t", 100, 1.98), "column 't', row 101"),
        (changed("ry", 7, np.nan), "column 'ry', row 8"),
        ({k: v[:1] for k, v in columns().items()}, "one row"),
    ],
    ids=["backward", "repeated", "half an orientation", "one row"],
)
def test_a_broken_file_names_column_and_row(tmp_path, cols, words):
    traj = written(tmp_path / "traj.parquet", cols)
    out = tmp_path / "run.parquet"
    line = refused(traj, "-o", out, code=2, output=out)
    assert words in line
    assert "traj.parquet" in line


def test_a_file_of_another_schema_is_refused(tmp_path):
    cols = {k: v for k, v in columns().items() if k != "id"}
    other = written(tmp_path / "demo.parquet", cols, schema=schemas.DEMONSTRATION)
    assert "trajectory file is needed" in refused(other, "-o", tmp_path / "r.parquet", code=2)


def test_one_of_several_strokes_is_picked_by_id(tmp_path):
    first, second = columns(name="a"), columns(duration=5.0, name="b")
    traj = written(
        tmp_path / "traj.parquet", {k: np.concatenate([first[k], second[k]]) for k in first}
    )
    out = tmp_path / "run.parquet"
    assert "it has a, b" in refused(traj, "-o", out, "--id", "c", code=2, output=out)
    execute(traj, "-o", out, "--id", "b")
    assert np.count_nonzero(run_of(out).columns["phase"] == "stroke") == 251
    assert run_of(out).provenance.options["id"] == "b"


@pytest.fixture
def batch(tmp_path):
    folder = tmp_path / "batch"
    folder.mkdir()
    first, second = columns(name="a"), columns(duration=5.0, name="b")
    both = {k: np.concatenate([first[k], second[k]]) for k in first}
    written(folder / "part-00000.parquet", both, normal=None)
    pairs = {
        "id": np.array(["a", "b", "c"], dtype=object),
        "duration": np.array([10.0, 5.0, 5.0]),
        "part": np.array(["part-00000.parquet", "part-00000.parquet", ""], dtype=object),
        "status": np.array(["ok", "ok", "start is 3 mm off the plane"], dtype=object),
        "nx": np.zeros(3),
        "ny": np.zeros(3),
        "nz": np.ones(3),
    }
    ends = {"0": START, "g": START - np.array([109.0, 0.0, 0.0])}
    pairs |= {a + e: np.full(3, p[i]) for e, p in ends.items() for i, a in enumerate("xyz")}
    written(folder / "pairs.parquet", pairs, schema=schemas.PAIRS)
    return folder


@pytest.mark.slow
def test_one_stroke_of_a_batch_is_picked_by_id(batch, tmp_path):
    out = tmp_path / "run.parquet"
    assert "3 mm off the plane" in refused(batch, "-o", out, "--id", "c", code=2, output=out)
    execute(batch, "-o", out, "--id", "b", "--coupling", "force", "--force-setpoint", 4)
    (stroke,) = run_of(out).provenance.facts["strokes"]
    assert (stroke["id"], stroke["normal"]) == ("b", [0.0, 0.0, 1.0])


EXTREME = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from([0.0, -0.0, 5e-324, 1e-300, 1e-9, 1e9, 1e300, -1e300, 1.7e308]),
)
NUMBERS = {
    "--speed": 1,
    "--period": 1,
    "--approach": 1,
    "--clearance": 1,
    "--transfer-speed": 1,
    "--retract-speed": 1,
    "--start-tolerance": 1,
    "--workspace": 6,
    "--max-speed": 1,
    "--max-acceleration": 1,
    "--max-jerk": 1,
    "--max-rotation-speed": 1,
    "--max-rotation-acceleration": 1,
    "--max-rotation-jerk": 1,
    "--following-error": 1,
    "--max-force": 1,
    "--force-setpoint": 1,
}


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    return written(tmp_path_factory.mktemp("short") / "traj.parquet", columns(duration=2.0))


@pytest.mark.slow
@settings(max_examples=40)
@given(option=st.sampled_from(sorted(NUMBERS)), data=st.data())
def test_no_finite_number_ends_in_a_traceback(short, option, data):
    values = [repr(data.draw(EXTREME)) for _ in range(NUMBERS[option])]
    if option == "--force-setpoint":
        values += ["--coupling", "force"]
    if option in ("--transfer-speed", "--retract-speed"):
        values += ["--clearance", "20"]
    asked = ["execute", str(short), "-o", "-", "--robot", "mock:?x=-550", option, *values]
    result = CliRunner().invoke(app, asked)
    assert result.exit_code in (0, 2, 3, 4), result.exception
    assert isinstance(result.exception, SystemExit | None), result.exception


# --- while it runs


@pytest.mark.parametrize(
    ("robot", "code", "words"),
    [
        ("mock:?estop_at=3", 3, "emergency stop"),
        ("mock:?refuse_at=3", 4, "refused a set-point"),
        ("mock:?speed=10", 3, "following error"),
    ],
)
def test_a_fault_stops_the_run_and_keeps_its_rows(traj, tmp_path, robot, code, words):
    out = tmp_path / "run.parquet"
    result = execute(traj, "-o", out, "--robot", robot, expect=code)
    assert words in result.stderr.splitlines()[-1]
    run = run_of(out)
    assert f"{out}: {len(run)} rows kept" in result.stderr
    assert 50 < len(run) < 400
    assert words in run.provenance.facts["reason"]
    assert not run.provenance.facts["completed"]


def test_a_run_that_goes_on_is_not_disturbed_by_another_of_its_name(traj, tmp_path, monkeypatch):
    def never(*_, **__):
        raise AssertionError("the instruments were reached")

    monkeypatch.setattr("dmpcli.control.workcell.connect", never)
    (tmp_path / "run.parquet.journal").touch()
    result = execute(traj, "-o", tmp_path / "run.parquet", "--realtime", expect=2)
    assert "dmpcli recover" in result.stderr


def test_a_sensor_that_falls_silent_stops_the_run(traj, tmp_path):
    out = tmp_path / "run.parquet"
    result = execute(traj, "-o", out, "--sensor", "mock:?silent_at=3", expect=4)
    assert "silent" in result.stderr
    assert 2.8 < run_of(out).t[-1] < 3.2


@pytest.mark.slow
def test_a_tool_file_without_zero_has_it_taken_at_rest(traj, tmp_path):
    file = tmp_path / "tool.json"
    file.write_bytes(tool.encode(PEN.with_zero(None)))
    out = tmp_path / "run.parquet"
    execute(traj, "-o", out, "--sensor", "mock:", "--tool", file)
    run = run_of(out)
    force = run.stack(schemas.FORCE)
    assert np.abs(force.mean(axis=0)).max() < 0.05, "the mock's zero of 3.5 N is gone"
    assert [entry["role"] for entry in run.provenance.inputs] == ["trajectory", "tool"]


def test_a_force_over_the_limit_stops_the_run(traj, tmp_path):
    out = tmp_path / "run.parquet"
    options = ("--sensor", "mock:?plate=-15", "--max-force", 10)
    result = execute(traj, "-o", out, *options, expect=3)
    assert "force 1" in result.stderr
    assert len(run_of(out)) == 1


@pytest.mark.slow
def test_a_sensor_is_logged_compensated(traj, tmp_path):
    """The plate pushes back up with 5 N/mm times 1 mm; tool weight and zero are gone."""
    out = tmp_path / "run.parquet"
    execute(traj, "-o", out, "--sensor", "mock:?plate=-16.56")
    assert run_of(out).columns["fz"].mean() == pytest.approx(5.0, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("height", [-18.56, -17.56, -16.56])
def test_force_coupling_holds_the_set_point_on_a_plate_a_millimetre_off(traj, tmp_path, height):
    out = tmp_path / "run.parquet"
    options = ("--coupling", "force", "--force-setpoint", 5, "--robot", f"mock:?plate={height}")
    result = execute(traj, "-o", out, *options)
    run = run_of(out)
    stroke = run.columns["phase"] == "stroke"
    force = run.columns["fz"][stroke & (run.columns["contact"] == "drawing")]
    said = run.provenance.facts["contact"]
    assert said["mean"] == pytest.approx(force.mean(), abs=0.05)
    assert (said["absent"], said["share"], said["threshold"]) == (0.0, 1.0, 0.5)
    assert said["stiffness"] == pytest.approx(5.0, rel=0.1)
    assert said["landing_peak"] < 7.5
    assert f"force along the normal {said['mean']:.2f} N in the mean" in result.stderr
    assert "no contact on 0 % of the stroke" in result.stderr
    assert "look-ahead" not in result.stderr
    assert np.sqrt(np.mean((force - 5.0) ** 2)) < 0.15
    assert force.min() > 4.0
    assert run.position()[-1, 2] > height + 4.0, "it has come clear of the work"
    depth = height - run.columns["z"][stroke]
    assert depth[-100:].mean() == pytest.approx(1.0, abs=0.02), "5 N on 5 N/mm"
    gains = run.provenance.facts["coupling"]
    assert gains["k"] == pytest.approx(gains["d"] ** 2 / 4)
    assert gains["alpha_e"] == pytest.approx(gains["k"] / gains["d"])
    assert gains["tau"] == 5.0


@pytest.mark.slow
def test_behind_a_long_look_ahead_the_coupling_is_slowed_and_it_is_said(traj, tmp_path):
    out = tmp_path / "run.parquet"
    preset = tmp_path / "slow.toml"
    preset.write_text("[execute]\nfollowing_error = 20\n")
    options = ("--coupling", "force", "--force-setpoint", 3, "--config", preset)
    result = execute(traj, "-o", out, *options, "--robot", "mock:?lag=0.28")
    facts = run_of(out).provenance.facts
    assert facts["lookahead"] == pytest.approx(0.3)
    assert facts["coupling"]["damping"] == pytest.approx(0.9 * 5.0 * 0.31, rel=0.15)
    assert "behind a look-ahead of 0.3 s" in result.stderr
    assert facts["contact"]["absent"] == 0.0


@pytest.mark.slow
def test_where_there_is_nothing_to_press_on_the_stroke_is_not_drawn(traj, tmp_path):
    out = tmp_path / "run.parquet"
    options = ("--coupling", "force", "--force-setpoint", 5, "--robot", "mock:?plate=none")
    result = execute(traj, "-o", out, *options, expect=3)
    assert "no contact within 10 mm" in result.stderr
    run = run_of(out)
    assert set(run.columns["phase"]) <= {"approach", "stop"}
    assert run.columns["coupling"].min() == pytest.approx(-10.0, abs=0.1)
    assert "lost" in set(run.columns["contact"])
    assert run.provenance.facts["contact_events"][-1]["state"] == "lost"


def test_only_a_simulated_run_replaces_an_older_one(traj, tmp_path):
    out = tmp_path / "run.parquet"
    out.write_bytes(b"older")
    request = ExecutionRequest(str(traj), (), str(out), "mock:", None, None, None, *[False] * 4)
    with pytest.raises(InputError, match="--force replaces it"):
        check_output(request, repeatable=False)
    check_output(dataclasses.replace(request, force=True), repeatable=False)
    assert out.read_bytes() == b"older"
    execute(traj, "-o", out)
    assert len(run_of(out)) > 500


# --- signals and real time, in a process of its own


def started(*arguments):
    process = subprocess.Popen(
        [sys.executable, "-m", "dmpcli", "execute", *map(str, arguments)],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    assert "streaming" in process.stderr.readline()
    return process


def after(process, seconds, number):
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(seconds)
    process.send_signal(number)


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_decelerates_and_keeps_the_run(traj, tmp_path, number, code):
    out = tmp_path / "run.parquet"
    process = started(traj, "-o", out, *REALTIME)
    after(process, 1.6, number)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == code, errors
    assert "decelerated along the path" in errors.splitlines()[-1]
    run = run_of(out)
    assert run.columns["phase"][-1] == "stop"
    assert "stroke" in run.columns["phase"]
    assert 0.5 < run.columns["t_plan"][-1] < 9.0
    sent = run.position("sent")
    last = np.linalg.norm(np.diff(run.position()[-3:], axis=0), axis=1) / np.diff(run.t[-3:])
    assert last.max() < 1.0, "at rest"
    u = minimum_jerk(run.columns["t_plan"] / 10.0)
    on_path = np.abs(sent[:, 0] - (START[0] - 109.0 * u))
    assert on_path.max() < 0.01
    assert run.provenance.facts["lateness"]["p50"] < 0.02
    assert not run.provenance.facts["completed"]
    assert f"{out}: {len(run)} rows kept" in errors


@pytest.mark.slow
def test_a_second_ctrl_c_stops_at_once(traj, tmp_path):
    out = tmp_path / "run.parquet"
    process = started(traj, "-o", out, *REALTIME)
    after(process, 1.6, signal.SIGINT)
    after(process, 0.1, signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130, errors
    assert "second signal" in errors.splitlines()[-1]
    run = run_of(out)
    assert "second signal" in run.provenance.facts["reason"]
    assert len(run) > 50


def test_the_command_line_loads_no_heavy_library():
    code = (
        "import sys, json; import dmpcli.commands.execute; heavy = {'numpy', 'scipy', 'pandas',"
        " 'pyarrow', 'rich', 'matplotlib'}; print(json.dumps(sorted(heavy & set(sys.modules))))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert json.loads(done.stdout) == []


@pytest.mark.thorough
def test_running_loads_no_scipy(traj, tmp_path):
    code = (
        "import sys; from dmpcli.cli import app;"
        f"app(['execute', {str(traj)!r}, '-o', {str(tmp_path / 'r.parquet')!r}],"
        " standalone_mode=False);"
        "print([m for m in ('scipy', 'matplotlib', 'rich') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert done.stdout.decode().strip() == "[]"

"""execute --robot-model: the arm's joints are judged before anything moves."""

import json
from functools import partial

import pyarrow.parquet as pq
import pytest

from tests.commands.running import invoke
from tests.commands.test_execute import columns, written

MODEL = ["--robot-model", "ec66"]


execute = partial(invoke, "execute")


@pytest.fixture
def near(tmp_path):
    return written(tmp_path / "near.parquet", columns())


@pytest.fixture
def far(tmp_path):
    cols = columns()
    return written(tmp_path / "far.parquet", cols | {"x": cols["x"] - 400.0})


def test_a_dry_run_shows_reach_joint_angles_and_joint_speeds(near):
    done = execute(near, "--dry-run", *MODEL)
    assert done.exit_code == 0
    rows = {line.split("  ")[0]: line for line in done.stderr.splitlines()}
    assert rows["distance out of the arm's reach"].endswith("ok")
    assert any(name.startswith("speed of joint ") and "°/s" in rows[name] for name in rows)
    assert "may be executed" in done.stderr
    assert "joint" not in execute(near, "--dry-run").stderr


def test_an_arm_that_cannot_reach_is_not_moved(far, tmp_path):
    for options in (["--dry-run"], ["-o", tmp_path / "run.parquet"]):
        done = execute(far, *options, *MODEL)
        assert done.exit_code == 3
        assert "distance out of the arm's reach" in done.stderr.splitlines()[-1]
    assert not (tmp_path / "run.parquet").exists()


@pytest.mark.slow
def test_the_run_of_an_arm_that_reaches_is_that_without_the_check(near, tmp_path):
    for name, options in (("plain", []), ("checked", MODEL)):
        assert execute(near, "-o", tmp_path / name, *options, "-q").exit_code == 0
    plain, checked = (pq.read_table(tmp_path / name) for name in ("plain", "checked"))
    joints = [f"q{i}" for i in range(1, 7)]  # of the arm that was named
    assert [name for name in checked.column_names if name not in plain.column_names] == joints
    assert checked.drop_columns(joints).equals(plain)


def test_the_tool_file_says_where_the_flange_is(near, tmp_path):
    frame = {"position": [0, 0, 900], "rotation": [0, 0, 0]}
    payload = {"weight": 1.0, "centre_of_mass": [0, 0, 0], "inclination": [0, 0], "zero": None}
    tool = tmp_path / "tool.json"
    for weighed in (payload, None):  # nothing is felt, so it may weigh what it likes
        document = {"schema": "tool", "version": 2, "payload": weighed}
        tool.write_text(json.dumps(document | {"flange_to_tcp": frame, "flange_to_sensor": frame}))
        assert execute(near, "--dry-run", *MODEL, "--tool", tool).exit_code == 3
    done = execute(near, "--dry-run", "--sensor", "mock:", "--tool", tool)
    assert done.exit_code == 2
    assert "payload: is missing" in done.stderr


def test_a_lower_speed_mends_what_a_joint_cannot_follow(tmp_path):
    cols = columns(duration=0.3)
    path = written(tmp_path / "fast.parquet", {**cols, "rz": 7.5 * cols["rz"]})
    wide = ["--max-speed", 1e6, "--max-acceleration", 1e8, "--max-jerk", 1e9]
    wide += ["--max-rotation-speed", 1e3, "--max-rotation-acceleration", 1e6]
    wide += ["--max-rotation-jerk", 1e8]
    done = execute(path, "--dry-run", *MODEL, *wide)
    assert done.exit_code == 3
    last = done.stderr.splitlines()[-1]
    assert "speed of joint 6" in last
    factor = float(last.split(" times its speed")[0].split()[-1])
    assert execute(path, "--dry-run", *MODEL, *wide, "--speed", factor).exit_code == 0


def test_an_unknown_model_is_the_users_mistake(near):
    done = execute(near, "--dry-run", "--robot-model", "ec99")
    assert done.exit_code == 2
    assert "there is ec66" in done.stderr

"""Files of version 0.1.0, kept small, are read by today's program.

They were written by that version from its mock lab; `settings.toml` holds every key that it knew.
"""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import dmpcli
from tests.commands.running import ended

KEPT = Path(__file__).with_name("version_0_1")
PAIR = ((-701.698, 132.420, -17.538), (-751.698, 130.0, -17.518))
EASED = {"ease_in": 0.5, "ease_out": 0.5}


def positions(path):
    table = pq.read_table(path)
    return np.column_stack([table[name].to_numpy() for name in "xyz"])


def test_they_stay_small():
    assert sum(path.stat().st_size for path in KEPT.rglob("*.*")) < 200_000


@pytest.mark.parametrize("name", ["demonstration", "trajectory", "run"])
def test_recordings_trajectories_and_runs_hold_what_parquet_says(name):
    read = dmpcli.read(KEPT / f"{name}.parquet")
    np.testing.assert_array_equal(read.position, positions(KEPT / f"{name}.parquet"))
    assert read.rotation.shape == (len(read.t), 3, 3)


def test_a_skill_draws_what_it_drew():
    skill = dmpcli.read(KEPT / "skill.json")
    drawn = dmpcli.generalize(skill, *PAIR, **EASED)
    np.testing.assert_allclose(drawn.position, positions(KEPT / "trajectory.parquet"), atol=1e-9)
    original = dmpcli.read(KEPT / "original.json")
    assert (original.model, len(original.basis)) == ("original", 20)
    assert len(dmpcli.generalize(original, *PAIR)) > 50


def test_a_batch_is_read_reported_and_executed(tmp_path):
    batch = dmpcli.read(KEPT / "batch")
    assert batch.ids == ["1", "2", "3"]
    assert batch.status[:2] == ["ok", "ok"]
    stored = positions(KEPT / "batch" / "part-00000.parquet")
    known = np.concatenate([batch[0].position, batch[1].position])
    np.testing.assert_array_equal(known, stored)
    said = json.loads(ended("report", KEPT / "batch", "--json").stdout)
    assert [row["stroke"] for row in said["files"][0]["strokes"]] == ["batch[1]", "batch[2]"]
    ended("execute", KEPT / "batch", "-o", tmp_path / "run.parquet", "-q")


def test_a_trajectory_is_executed_and_all_of_it_reported(tmp_path):
    ended("execute", KEPT / "trajectory.parquet", "-o", tmp_path / "run.parquet", "-q")
    names = ["demonstration.parquet", "trajectory.parquet", "run.parquet", "skill.json"]
    said = json.loads(ended("report", *(KEPT / name for name in names), "--json").stdout)
    assert [entry["schema"] for entry in said["files"]] == [
        "demonstration",
        "trajectory",
        "run",
        "skill",
    ]
    heights = [row["wave"]["mean"] for entry in said["files"] for row in entry["strokes"]]
    np.testing.assert_allclose(heights, [20.862, 20.845, 20.452], atol=6e-4)  # as it said itself


def test_a_run_without_joints_leaves_as_ever_and_by_an_arm_in_joint_space(tmp_path):
    ended("export", KEPT / "run.parquet", "-o", tmp_path / "run.csv", "-q")
    said = ended("export", KEPT / "run.parquet", "-o", tmp_path / "run.joints.csv", expect=2)
    assert "holds no joint angles" in said.stderr
    arm = ["--robot-model", "ec66"]
    ended("export", KEPT / "run.parquet", "-o", tmp_path / "run.joints.csv", *arm, "-q")
    lines = [
        len((tmp_path / name).read_text().splitlines()) for name in ("run.csv", "run.joints.csv")
    ]
    assert lines[0] == lines[1] > 100


def test_a_journal_is_recovered(tmp_path):
    ended("recover", KEPT / "lost.journal", "-o", tmp_path / "found.parquet", "-q")
    found = dmpcli.read(tmp_path / "found.parquet")
    assert len(found) > 20
    assert np.all(np.diff(found.t) > 0.0)


def test_a_tool_and_its_poses_are_used(tmp_path):
    ended(
        *("record", "-o", tmp_path / "d.parquet", "--tool", KEPT / "tool.json"),
        *("--duration", "2", "-q"),
    )
    ended("calibrate", "-o", tmp_path / "tool.json", "--from", KEPT / "poses.parquet", "-q")
    old, new = (
        json.loads(path.read_text()) for path in (KEPT / "tool.json", tmp_path / "tool.json")
    )
    assert new["payload"]["weight"] == pytest.approx(old["payload"]["weight"], abs=1e-9)


@pytest.mark.slow
def test_every_key_of_the_old_settings_is_known(tmp_path):
    said = ["--config", KEPT / "settings.toml", "-q"]
    demo, skill, drawn = (tmp_path / name for name in ("d.parquet", "s.json", "t.parquet"))
    ended("record", "-o", demo, *said)
    ended("fit", demo, "-o", skill, "--preset", "paper", *said)
    pair = [*("--start", *PAIR[0]), *("--goal", *PAIR[1])]
    ended("generalize", skill, "-o", drawn, *pair, "--ease-in", "1", "--ease-out", "1", *said)
    ended("execute", drawn, "-o", tmp_path / "run.parquet", *said)


@pytest.mark.parametrize("path", sorted(KEPT.glob("*.*")), ids=lambda path: path.name)
def test_inspect_tells_what_each_is(path):
    if path.suffix == ".journal":
        assert "dmpcli recover" in ended("inspect", path, expect=2).stderr
        return
    found = json.loads(ended("inspect", path, "--json").stdout)["found"]
    assert found["ours"] or path.suffix == ".toml"

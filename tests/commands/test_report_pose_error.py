"""``report`` of two TUM files: evo's APE, RPE, alignment and path length, from the same files."""

import json

import numpy as np
import pytest

from dmpcli.spatial import rotations
from tests.commands.running import invoke
from tests.outside_judge import judge

HEAD = "# timestamp tx ty tz qx qy qz qw\n"


def tum(path, began, dt, n, noise, seed):
    """Write a wave with a turning tool as a TUM file, s and m, by a clock that began then."""
    random = np.random.default_rng(seed)
    t = dt * np.arange(n)
    s = t / 8.0
    position = np.column_stack([110 * s, 24 * np.sin(2 * np.pi * s), 3 * s]) / 1000.0
    position += noise / 1000.0 * random.standard_normal(position.shape)
    angles = np.column_stack([0.3 * s, 0.2 * np.sin(4 * s), s])
    q = rotations.to_quaternion(
        rotations.exp(angles + 0.01 * noise * random.standard_normal((n, 3)))
    )
    rows = np.column_stack([began + t, position, q])
    path.write_text(HEAD + "\n".join(" ".join(f"{x:.9f}" for x in row) for row in rows) + "\n")
    return path


@pytest.fixture
def two(tmp_path):
    return (
        tum(tmp_path / "truth.tum", 1700000000.0, 0.02, 400, 0.0, 1),
        tum(tmp_path / "measured.tum", 1700000000.504, 0.013, 560, 0.4, 2),
    )


def measured(*files):
    done = invoke("report", *files, "--layout", "tum", "--json", "-q")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)["files"][1]["pose_error"]


def test_two_recordings_are_compared_by_the_clock_that_both_have(two):
    row = measured(*two)
    assert (row["stroke"], row["against"]) == ("measured", "truth")
    assert row["pairs"] < row["of"] == 400
    # Half a second later by the same clock is another place of the wave.
    assert row["ape"]["position"]["rmse"] > 3.0
    assert row["aligned"]["ape"]["position"]["rmse"] < row["ape"]["position"]["rmse"]


def test_two_clocks_that_never_meet_give_no_pose_error(tmp_path, two):
    other = tum(tmp_path / "later.tum", 1700009999.0, 0.02, 400, 0.0, 1)
    assert measured(two[0], other) is None


def test_few_pairs_are_told(tmp_path, two):
    slow = tum(tmp_path / "slow.tum", 1700000000.011, 0.025, 300, 0.0, 1)
    done = invoke("report", two[0], slow, "--layout", "tum", "-q")
    row = measured(two[0], slow)
    assert (row["pairs"] < 0.9 * row["of"]) == ("look at the clocks" in done.stdout)
    assert "Pose error" in done.stdout


@judge("evo", "evo")
def test_evo_says_the_same_of_the_same_files(two):
    from evo.core import metrics, sync
    from evo.tools import file_interface

    row = measured(*two)
    reference, estimate = (file_interface.read_tum_trajectory_file(str(path)) for path in two)
    assert row["reference_length"] / 1000.0 == pytest.approx(reference.path_length, abs=1e-6)
    assert row["length"] / 1000.0 == pytest.approx(estimate.path_length, abs=1e-6)
    reference, estimate = sync.associate_trajectories(reference, estimate)
    assert row["pairs"] == reference.num_poses

    def same(ours, metric, relation, factor):
        judged = metric(relation)
        judged.process_data((reference, estimate))
        for name, value in judged.get_all_statistics().items():
            scale = factor**2 if name == "sse" else factor
            assert ours[name] == pytest.approx(scale * value, abs=1e-6 * scale, rel=1e-6), name

    relations = metrics.PoseRelation
    for key, metric in (("ape", metrics.APE), ("rpe", metrics.RPE)):
        same(row[key]["position"], metric, relations.translation_part, 1000.0)
        same(row[key]["rotation"], metric, relations.rotation_angle_deg, 1.0)
    turned, moved, _ = estimate.align(reference)
    same(row["aligned"]["ape"]["position"], metrics.APE, relations.translation_part, 1000.0)
    same(row["aligned"]["ape"]["rotation"], metrics.APE, relations.rotation_angle_deg, 1.0)
    found = rotations.from_quaternion(np.array([row["aligned"]["rotation"]]))[0]
    assert found == pytest.approx(turned, abs=1e-6)
    assert np.array(row["aligned"]["position"]) / 1000.0 == pytest.approx(moved, abs=1e-6)

"""``report`` of two TUM files: evo's APE, RPE, alignment and path length, from the same files."""

import json
from pathlib import Path

import numpy as np
import pytest

from dmpcli.spatial import rotations
from tests.commands.running import invoke
from tests.outside_judge import judge

HEAD = "# timestamp tx ty tz qx qy qz qw\n"

EVO = Path(__file__).parent / "evo.json"
"""What evo 1.38.1 said of the two files, so that `make test` need not install it."""


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
    done = invoke("report", two[0], other, "--layout", "tum")
    assert "later: by its clock it begins 9991 s after truth ends" in done.stderr
    done = invoke("report", other, two[0], "--layout", "tum")
    assert "truth: by its clock it ends 9991 s before later begins" in done.stderr


def test_few_pairs_are_told(tmp_path, two):
    slow = tum(tmp_path / "slow.tum", 1700000000.011, 0.025, 300, 0.0, 1)
    done = invoke("report", two[0], slow, "--layout", "tum", "-q")
    row = measured(two[0], slow)
    assert (row["pairs"] < 0.9 * row["of"]) == ("look at the clocks" in done.stdout)
    assert "Pose error" in done.stdout


def evos(files):
    """What evo says of two TUM files, in the units of `report`: mm and degrees."""
    from evo.core import metrics, sync
    from evo.tools import file_interface

    reference, estimate = (file_interface.read_tum_trajectory_file(str(path)) for path in files)
    lengths = [1000.0 * one.path_length for one in (reference, estimate)]
    reference, estimate = sync.associate_trajectories(reference, estimate)
    relations = metrics.PoseRelation

    def judged(metric, one):
        found = {}
        for key, relation, factor in (
            ("position", relations.translation_part, 1000.0),
            ("rotation", relations.rotation_angle_deg, 1.0),
        ):
            measured_by = metric(relation)
            measured_by.process_data((reference, one))
            said = measured_by.get_all_statistics()
            found[key] = {
                name: (factor**2 if name == "sse" else factor) * float(value)
                for name, value in said.items()
            }
        return found

    found = {"pairs": reference.num_poses, "reference_length": lengths[0], "length": lengths[1]}
    found |= {"ape": judged(metrics.APE, estimate), "rpe": judged(metrics.RPE, estimate)}
    turned, moved, _ = estimate.align(reference)
    found["aligned"] = {"ape": judged(metrics.APE, estimate), "turned": turned.tolist()}
    found["aligned"]["moved"] = (1000.0 * moved).tolist()
    return found


def same(ours, theirs, rel=1e-6):
    """Hold a row of the report against what evo says."""
    for key in ("pairs", "reference_length", "length"):
        assert ours[key] == pytest.approx(theirs[key], rel=1e-9), key
    aligned = (ours["aligned"]["ape"], theirs["aligned"]["ape"])
    for mine, its in ((ours["ape"], theirs["ape"]), (ours["rpe"], theirs["rpe"]), aligned):
        for part in ("position", "rotation"):
            assert mine[part].keys() == its[part].keys()
            for name, value in its[part].items():
                assert mine[part][name] == pytest.approx(value, abs=1e-6, rel=rel), (part, name)
    found = rotations.from_quaternion(np.array([ours["aligned"]["rotation"]]))[0]
    assert found == pytest.approx(np.array(theirs["aligned"]["turned"]), abs=1e-6)
    assert ours["aligned"]["position"] == pytest.approx(theirs["aligned"]["moved"], abs=1e-6)


def test_report_says_what_evo_said_of_the_same_files(two):
    same(measured(*two), json.loads(EVO.read_text()))


@judge("evo", "evo")
def test_evo_says_the_same_of_the_same_files(two):
    theirs = evos(two)
    same(measured(*two), theirs)
    kept = json.loads(EVO.read_text())
    for part in ("ape", "rpe"):
        for key in ("position", "rotation"):
            assert theirs[part][key] == pytest.approx(kept[part][key], rel=1e-9)

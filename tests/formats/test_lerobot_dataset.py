"""LeRobot v3 datasets: float32 on an even grid, as its own tools want them."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError
from dmpcli.formats import lerobot_dataset
from dmpcli.formats.motion import MotionStroke
from dmpcli.workflows.motions import evenly
from tests.formats.motions import along, angle_between, motion, wave
from tests.outside_judge import judge

SINGLE = 2e-4
"""mm: half a step of float32 below 4 m, in m, is 1.2e-4 mm."""


def written(folder, *strokes, fps=50):
    given = evenly(motion(*strokes), fps)
    lerobot_dataset.write(given, folder, fps, "draw a wave")
    return given


def test_each_stroke_is_an_episode_and_comes_back_in_single_precision(tmp_path):
    given = written(tmp_path / "ds", wave(), wave(name="b", offset=300.0, seconds=3.0))
    with pytest.raises(InputError, match="holds 2 episodes, 0 to 1; choose one with --episode"):
        lerobot_dataset.read(tmp_path / "ds", None)
    for number, one in enumerate(given.strokes):
        back, _ = lerobot_dataset.read(tmp_path / "ds", str(number))
        np.testing.assert_allclose(back.t, one.t, atol=1e-6)
        np.testing.assert_allclose(back.position, one.position, atol=SINGLE)
        assert angle_between(back.rotation, one.rotation).max() < 1e-6


def test_the_grid_is_even_and_lies_on_the_stroke():
    one = wave()
    (even,) = evenly(motion(one), 30.0).strokes
    np.testing.assert_allclose(np.diff(even.t), 1 / 30)
    position, R = along(even.t, one)
    np.testing.assert_allclose(even.position, position, atol=1e-9)
    assert angle_between(even.rotation, R).max() < 1e-9


def test_state_is_metres_and_a_quaternion_that_never_leaps_and_action_comes_next(tmp_path):
    one = wave()
    turn = Rotation.from_rotvec(np.outer(np.linspace(0, 7, len(one)), [0.6, 0, 0.8]))
    turning = MotionStroke(one.t, one.position, turn.as_matrix())
    (even,) = written(tmp_path / "ds", turning).strokes
    table = pq.read_table(tmp_path / "ds" / "data" / "chunk-000" / "file-000.parquet")
    state = np.array(table.column("observation.state").to_pylist())
    action = np.array(table.column("action").to_pylist())
    np.testing.assert_allclose(state[:, :3], even.position / 1000, atol=1e-7)
    np.testing.assert_allclose(
        Rotation.from_quat(state[:, 3:]).as_matrix(), even.rotation, atol=1e-6
    )
    assert np.abs(np.diff(state[:, 3:], axis=0)).max() < 0.1
    np.testing.assert_array_equal(action[:-1], state[1:])
    names = json.loads((tmp_path / "ds" / "meta" / "info.json").read_text())["features"]
    assert names["observation.state"]["names"] == ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"]


def test_the_index_of_tasks_is_their_text_as_pandas_reads_it(tmp_path):
    written(tmp_path / "ds", wave())
    tasks = pd.read_parquet(tmp_path / "ds" / "meta" / "tasks.parquet")
    assert tasks.index.tolist() == ["draw a wave"]
    assert tasks["task_index"].tolist() == [0]


def test_statistics_are_numpys(tmp_path):
    given = written(tmp_path / "ds", wave(), wave(name="b", offset=300.0))
    x = np.concatenate([one.position[:, 0] for one in given.strokes]) / 1000
    stats = json.loads((tmp_path / "ds" / "meta" / "stats.json").read_text())["observation.state"]
    np.testing.assert_allclose(stats["mean"][0], x.mean(), rtol=1e-6)
    np.testing.assert_allclose(stats["std"][0], x.std(), rtol=1e-5)
    assert stats["count"] == [len(x)]


def test_a_wrench_and_a_missing_orientation_are_kept_so(tmp_path):
    one = wave()
    bare = MotionStroke(one.t, one.position, wrench=np.outer(one.t, np.arange(6.0)))
    (even,) = written(tmp_path / "ds", bare).strokes
    back, _ = lerobot_dataset.read(tmp_path / "ds", None)
    assert back.rotation is None
    np.testing.assert_allclose(back.wrench, even.wrench, rtol=1e-6, atol=1e-6)


@judge("lerobot_doctor", "lerobot-doctor")
def test_lerobot_doctor_finds_no_failure(tmp_path):
    written(tmp_path / "ds", *(wave(name=f"{i}", offset=3.0 * i) for i in range(4)))
    done = subprocess.run(
        [sys.executable, "-m", "lerobot_doctor.cli", "check", str(tmp_path / "ds"), "--json"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    counts = re.search(r'"PASS": (\d+).*?"FAIL": (\d+)', done.stdout, re.DOTALL)
    assert int(counts[1]) >= 7
    assert int(counts[2]) == 0


@pytest.mark.parametrize(
    ("path", "content", "words"),
    [
        ("meta/info.json", "{", "damaged"),
        ("meta/info.json", '{"codebase_version": 3}', "damaged"),
        ("data/chunk-000/file-000.parquet", "PAR1", "damaged"),
    ],
)
def test_a_damaged_dataset_is_refused_by_name(tmp_path, path, content, words):
    written(tmp_path / "ds", wave())
    (tmp_path / "ds" / path).write_text(content)
    with pytest.raises(InputError, match=words):
        lerobot_dataset.read(tmp_path / "ds", None)


def test_another_state_is_refused_with_the_option_that_says_it(tmp_path):
    written(tmp_path / "ds", wave())
    path = tmp_path / "ds" / "meta" / "info.json"
    path.write_text(path.read_text().replace('"x_m"', '"shoulder"'))
    with pytest.raises(InputError, match="--layout lerobot --map x="):
        lerobot_dataset.read(tmp_path / "ds", None)


@pytest.mark.parametrize(
    ("was", "becomes", "words"),
    [
        ('"total_episodes": 1', '"total_episodes": 1e999', "damaged"),
        ('"qw"', '"qw", "grip"', r"holds 7 numbers a sample, 8 are described"),
    ],
)
def test_a_description_that_does_not_fit_its_data_is_refused(tmp_path, was, becomes, words):
    written(tmp_path / "ds", wave())
    path = tmp_path / "ds" / "meta" / "info.json"
    text = path.read_text()
    assert was in text
    path.write_text(text.replace(was, becomes))
    with pytest.raises(InputError, match=words):
        lerobot_dataset.read(tmp_path / "ds", None)


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["type_of_another_column", "signalling_nan"])
def test_a_damaged_table_is_refused_by_a_process_that_ends(name, tmp_path):
    """Arrow's filtering in threads never returned from the first; the second warned of a cast."""
    written(tmp_path / "d", wave(), fps=10)
    [data] = (tmp_path / "d" / "data").rglob("*.parquet")
    data.write_bytes((Path(__file__).parent / "damaged" / f"{name}.parquet").read_bytes())
    words = [sys.executable, "-m", "dmpcli", "import", "d", "-o", "b.parquet"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2, done.stderr
    assert len(done.stderr.splitlines()) == 1, done.stderr

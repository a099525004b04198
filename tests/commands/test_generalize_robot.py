"""generalize --robot-model: pairs that an arm cannot draw are refused as any other pair is."""

import json

import numpy as np
import pytest

from dmpcli.kinematics import chain, models
from dmpcli.kinematics.reachability import Reach
from dmpcli.records import file_io
from tests.commands.test_generalize import PAIR, read, run, write_skill
from tests.dmp.strokes import paper_stroke

MODEL = ["--robot-model", "ec66"]
FAR = ["--start", -901.698, 132.420, -17.538, "--goal", -1007.597, 129.739, -17.518]


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    return write_skill(tmp_path_factory.mktemp("skill") / "s.json", paper_stroke(turning=True))


def tool_file(path, length):
    frame = {"position": [0, 0, length], "rotation": [0, 0, 0]}
    payload = {"weight": 1.0, "centre_of_mass": [0, 0, 0], "inclination": [0, 0], "zero": None}
    document = {"schema": "tool", "version": 1, "payload": payload}
    path.write_text(json.dumps(document | {"flange_to_tcp": frame, "flange_to_sensor": frame}))
    return path


def pair_table(path, offsets):
    start, goal = np.array(PAIR[1:4], dtype=float), np.array(PAIR[5:8], dtype=float)
    rows = [",".join(map(str, [*(start + [x, 0, 0]), *(goal + [x, 0, 0])])) for x in offsets]
    path.write_text("\n".join(["x0,y0,z0,xg,yg,zg", *rows, ""]))
    return path


def test_a_pair_in_reach_is_drawn_as_without_the_model_and_the_file_says_which_arm(
    learned, tmp_path
):
    plain, checked = tmp_path / "plain", tmp_path / "checked"
    assert run(learned, "-o", plain, *PAIR).exit_code == 0
    done = run(learned, "-o", checked, *PAIR, *MODEL)
    assert done.exit_code == 0
    assert "the flange is taken as the TCP" in done.stderr
    assert np.array_equal(read(plain).position(), read(checked).position())
    assert read(checked).provenance.options["robot_model"] == "ec66"
    assert "robot_model" not in read(plain).provenance.options


def test_a_pair_that_passes_can_be_followed_by_the_chain_itself(learned, tmp_path):
    assert run(learned, "-o", tmp_path / "t", *PAIR, *MODEL).exit_code == 0
    drawn = read(tmp_path / "t")
    arm = models.model("ec66")
    q = Reach(arm).follow(drawn.position()[None], drawn.rotation()[None], 0.02).joints[0]
    at = chain.forward(arm, q)
    position, rotation = at.position, at.rotation
    assert np.abs(position - drawn.position()).max() < 1e-9
    assert np.abs(rotation - drawn.rotation()).max() < 1e-9
    assert (np.abs(np.diff(q, axis=0)) / 0.02 <= arm.speeds).all()


def test_one_pair_out_of_reach_is_refused_and_nothing_is_written(learned, tmp_path):
    done = run(learned, "-o", tmp_path / "t", *FAR, *MODEL)
    assert done.exit_code == 3
    assert "the ec66 misses the pose by" in done.stderr
    assert not (tmp_path / "t").exists()


def test_too_short_a_duration_is_refused_with_the_joint(learned, tmp_path):
    done = run(learned, "-o", tmp_path / "t", *PAIR, "--duration", 0.2, *MODEL)
    assert done.exit_code == 3
    assert "°/s" in done.stderr
    assert "times the duration would do" in done.stderr


def test_the_remedy_fits_what_is_wrong(learned, tmp_path):
    fast = run(learned, "-o", tmp_path / "t", *PAIR, *MODEL, "--duration", 0.2)
    assert fast.stderr.strip().endswith("give a longer --duration")
    far = run(learned, "-o", tmp_path / "t", *FAR, *MODEL)
    assert far.stderr.strip().endswith("; move start and goal")


def test_with_stop_the_first_bad_pair_ends_all(learned, tmp_path):
    table = pair_table(tmp_path / "p.csv", [0, -400, 10])
    done = run(learned, "-o", tmp_path / "b", "--pairs", table, *MODEL)
    assert done.exit_code == 3
    assert f"dmpcli: {table}: line 3, pair 2: out of reach" in done.stderr
    assert not (tmp_path / "b").exists()


def test_with_skip_each_pair_has_its_status(learned, tmp_path):
    table = pair_table(tmp_path / "p.csv", [0, -400, 10, 500])
    options = ["--pairs", table, "--on-error", "skip", *MODEL]
    done = run(learned, "-o", tmp_path / "b", *options)
    assert done.exit_code == 0
    status = read(tmp_path / "b" / "pairs.parquet").columns["status"]
    assert [str(s) == "ok" for s in status] == [True, False, True, True]
    assert "out of reach: at t = " in str(status[1])
    ids = set(map(str, read(tmp_path / "b" / "part-00000.parquet").columns["id"]))
    assert ids == {"1", "3", "4"}
    again = run(learned, "-o", tmp_path / "c", *options)
    assert again.exit_code == 0
    for name in ("pairs.parquet", "part-00000.parquet"):
        assert (tmp_path / "b" / name).read_bytes() == (tmp_path / "c" / name).read_bytes()


def test_where_every_pair_is_out_of_reach_the_folder_says_why_of_each(learned, tmp_path):
    table = pair_table(tmp_path / "p.csv", [-400, 500])
    done = run(learned, "-o", tmp_path / "b", "--pairs", table, "--on-error", "skip", *MODEL)
    assert done.exit_code == 0  # one of them is in reach
    table = pair_table(tmp_path / "p.csv", [-400, -450])
    done = run(learned, "-o", tmp_path / "c", "--pairs", table, "--on-error", "skip", *MODEL)
    assert done.exit_code == 3
    assert "no pair can be drawn" in done.stderr.splitlines()[-1]
    status = read(tmp_path / "c" / "pairs.parquet").columns["status"]
    assert all("out of reach" in str(each) for each in status)
    assert json.loads((tmp_path / "c" / file_io.MANIFEST).read_text())["drawn"] == 0


def test_the_geometry_of_a_tool_is_enough_where_nothing_is_felt(learned, tmp_path):
    tool = tool_file(tmp_path / "tool.json", 150.0)
    whole = json.loads(tool.read_text())
    tool.write_text(json.dumps(whole | {"version": 2, "payload": None}))
    done = run(learned, "-o", tmp_path / "t", *PAIR, *MODEL, "--tool", tool)
    assert done.exit_code == 0, done.stderr


def test_the_tool_file_moves_the_flange(learned, tmp_path):
    tool = tool_file(tmp_path / "tool.json", 150.0)
    done = run(learned, "-o", tmp_path / "t", *PAIR, *MODEL, "--tool", tool)
    assert done.exit_code == 0
    assert "taken as the TCP" not in done.stderr
    assert [i["role"] for i in read(tmp_path / "t").provenance.inputs] == ["skill", "tool"]
    long = tool_file(tmp_path / "long.json", 900.0)
    assert run(learned, "-o", tmp_path / "u", *PAIR, *MODEL, "--tool", long).exit_code == 3


def test_strokes_without_orientation_are_checked_and_that_is_said(tmp_path):
    flat = paper_stroke()
    path = write_skill(tmp_path / "s.json", type(flat)(flat.t, flat.position))
    done = run(path, "-o", tmp_path / "t", *PAIR, *MODEL)
    assert done.exit_code == 0
    assert "no orientation" in done.stderr
    assert read(tmp_path / "t").rotation() is None
    assert run(path, "-o", tmp_path / "u", *FAR, *MODEL).exit_code == 3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--robot-model", "ec99"], "'ec99': not known; there is ec66"),
        (["--tool", "tool.json"], "--tool: says where the flange of --robot-model is"),
        ([*MODEL, "--tool", "none.json"], "none.json"),
    ],
)
def test_wrong_options_are_the_users_mistake(learned, tmp_path, options, words):
    done = run(learned, "-o", tmp_path / "t", *PAIR, *options)
    assert done.exit_code == 2
    assert words in done.stderr

"""generalize at the command line: one pair, many pairs, planes, and what gets refused."""

import json
from functools import partial

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.records import file_io, record, schemas, skill
from dmpcli.records.record import Provenance
from tests.commands.running import invoke
from tests.dmp.strokes import GOAL, START, circle, paper_stroke

PAIR = ["--start", -701.698, 132.420, -17.538, "--goal", -807.597, 129.739, -17.518]


run = partial(invoke, "generalize")


def write_skill(path, stroke, **choices):
    result = fit([stroke], FitOptions(**choices))
    one = skill.Reproduction(sha256="0", duration=10.0, rms=0, largest=0, end=0, smoothing=0)
    path.write_bytes(skill.encode(result.skill, [one], Provenance("fit")))
    return path


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    return write_skill(tmp_path_factory.mktemp("skill") / "s.json", paper_stroke(turning=True))


def read(path):
    return record.decode(file_io.read(path))


def test_one_pair_is_one_file_with_what_execute_needs(learned, tmp_path):
    done = run(learned, "-o", tmp_path / "t.parquet", *PAIR)
    assert done.exit_code == 0
    found = read(tmp_path / "t.parquet")
    assert found.schema is schemas.TRAJECTORY
    assert {"k", "d", "tau", "alpha_e", "normal", "start", "goal", "model"} <= set(
        found.provenance.facts
    )
    assert found.t[-1] == pytest.approx(10.0)
    assert np.linalg.norm(found.position()[-1] - PAIR[5:]) <= 0.01
    assert found.provenance.inputs[0]["role"] == "skill"


def test_reproduce_draws_at_the_demonstrated_ends(learned, tmp_path):
    assert run(learned, "-o", tmp_path / "t.parquet", "--reproduce").exit_code == 0
    facts = read(tmp_path / "t.parquet").provenance.facts
    np.testing.assert_allclose(facts["start"], START, atol=1e-4)
    np.testing.assert_allclose(facts["goal"], GOAL, atol=1e-4)


def test_the_same_inputs_give_the_same_bytes(learned, tmp_path):
    for name in ("a", "b"):
        run(learned, "-o", tmp_path / name, *PAIR, "--ease-in", 0.3)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_duration_rate_and_easing_shape_the_time_axis(learned, tmp_path):
    options = ["--duration", 4, "--rate", 125, "--ease-in", 0.4, "--ease-out", 0.8]
    run(learned, "-o", tmp_path / "t", *PAIR, *options)
    t = read(tmp_path / "t").t
    assert t[-1] == pytest.approx(4.6, abs=0.008)
    np.testing.assert_allclose(np.diff(t), 1 / 125, rtol=1e-9)


def test_a_skill_without_orientation_leaves_it_missing(tmp_path):
    flat = paper_stroke()
    path = write_skill(tmp_path / "s.json", type(flat)(flat.t, flat.position))
    run(path, "-o", tmp_path / "t", *PAIR)
    assert read(tmp_path / "t").rotation() is None
    done = run(path, "-o", tmp_path / "u", *PAIR, "--start-orientation", 3, 0, 0)
    assert done.exit_code == 2
    assert "demonstrated without" in done.stderr


def plane(tmp_path, z, normal=(0, 0, 1)):
    path = tmp_path / "plane.json"
    path.write_text(json.dumps({"point": [0, 0, z], "normal": list(normal)}))
    return path


def test_start_and_goal_are_moved_onto_a_given_plane_and_that_is_said(learned, tmp_path):
    done = run(learned, "-o", tmp_path / "t", *PAIR, "--surface", plane(tmp_path, -17.0))
    assert done.exit_code == 0
    assert "start moved 0.538 mm and goal 0.518 mm onto the surface" in done.stderr
    np.testing.assert_allclose(read(tmp_path / "t").position()[:, 2], -17.0, atol=1e-9)


def test_a_plane_seen_from_below_is_flipped_and_that_is_said(learned, tmp_path):
    done = run(
        learned, "-o", tmp_path / "t", *PAIR, "--surface", plane(tmp_path, -17.5, (0, 0, -2))
    )
    assert "the normal is flipped" in done.stderr
    assert read(tmp_path / "t").provenance.facts["normal"][2] == pytest.approx(1.0)


def test_a_pair_off_the_plane_is_refused_by_distance(learned, tmp_path):
    done = run(learned, "-o", tmp_path / "t", *PAIR, "--surface", plane(tmp_path, -10.0))
    assert done.exit_code == 2
    assert "7.538 mm off the surface, more than --snap-tol 1" in done.stderr
    assert not (tmp_path / "t").exists()


def test_a_pair_that_stands_upright_is_refused_with_exit_code_3(learned, tmp_path):
    done = run(learned, "-o", tmp_path / "t", "--start", 0, 0, 0, "--goal", 0.01, 0, 50)
    assert done.exit_code == 3
    assert "stands upright" in done.stderr


@pytest.mark.parametrize(
    ("args", "message"),
    [
        ([], "give --start X Y Z and --goal X Y Z"),
        (["--start", 1, 2, 3], "give --start X Y Z and --goal X Y Z"),
        (["--start", 1, 2, 3, "--goal", 1, 2, 3], "start and goal are one point"),
        (["--start", "nan", 2, 3, "--goal", 4, 5, 6], "--start: nan is not a finite number"),
        ([*PAIR, "--duration", -2], "--duration = -2.0"),
        ([*PAIR, "--duration", "nan"], "--duration = nan"),
        ([*PAIR, "--rate", 0], "--rate = 0.0"),
        ([*PAIR, "--amplitude", "double"], "--amplitude = 'double'"),
        ([*PAIR, "--ease-in", 15, "--ease-out", 6], "--ease-in and --ease-out together"),
        ([*PAIR, "--reproduce"], "--reproduce takes the demonstrated ends"),
        ([*PAIR, "--pairs", "p.csv"], "leave --start and --goal out"),
        (["--pairs", "none.csv"], "none.csv: no such file"),
        ([*PAIR, "--surface", "none.json"], "none.json: no such file"),
        (["--pairs", "p", "--on-error", "pray"], "--on-error pray: must be stop or skip"),
        ([*PAIR, "--on-error", "skip"], "--on-error: belongs to --pairs"),
        ([*PAIR, "--duration", 80000, "--rate", 100], "more than 1000000 samples"),
        (["--start", 1e308, 0, 0, "--goal", -1e308, 0, 0], "--start: 1e+308 is beyond 1e+06"),
        (["--pairs", "p", "--start-orientation", 3, 0, 0], "--pairs names the orientations"),
    ],
)
def test_wrong_options_are_refused_and_touch_nothing(learned, tmp_path, args, message):
    done = run(learned, "-o", tmp_path / "t", *args)
    assert done.exit_code == 2
    assert message in done.stderr
    assert list(tmp_path.iterdir()) == []


def write_pairs(path, rows, columns="id,x0,y0,z0,xg,yg,zg,duration"):
    path.write_text("\n".join([columns, *rows]) + "\n")
    return path


PARTS = [f"part-0000{number}.parquet" for number in range(9)]
GOOD = ["a,0,0,0,100,0,0,5", "b,10,0,0,60,40,0,", "c,0,5,0,-80,0,0,7.5"]
BAD = ["d,1,nan,3,4,5,6,7", "e,1,2,3,1,2,3,4", "f,0,0,0,0,0,70,2"]


def test_many_pairs_are_a_folder_in_pair_order_with_a_status_each(learned, tmp_path):
    table = write_pairs(tmp_path / "p.csv", GOOD)
    assert run(learned, "-o", tmp_path / "batch", "--pairs", table).exit_code == 0
    part = read(tmp_path / "batch" / "part-00000.parquet")
    assert list(dict.fromkeys(part.columns["id"])) == ["a", "b", "c"]
    status = read(tmp_path / "batch" / "pairs.parquet").columns
    assert list(status["status"]) == ["ok"] * 3
    np.testing.assert_allclose(status["duration"], [5, 10, 7.5])
    run(learned, "-o", tmp_path / "b.parquet", "--start", 10, 0, 0, "--goal", 60, 40, 0)
    one = read(tmp_path / "b.parquet")
    rows = part.columns["id"] == "b"
    np.testing.assert_allclose(part.position()[rows], one.position(), atol=1e-9)
    np.testing.assert_allclose(part.columns["rz"][rows], one.columns["rz"], atol=1e-12)


def test_parts_hold_two_thousand_pairs_and_older_parts_go(learned, tmp_path):
    rows = [f"{i},0,0,0,100,{i % 7},0,0.2" for i in range(4100)]
    table = write_pairs(tmp_path / "p.csv", rows)
    run(learned, "-o", tmp_path / "batch", "--pairs", table, "--rate", 20)
    names = sorted(path.name for path in (tmp_path / "batch").iterdir())
    assert names == ["_manifest.json", "pairs.parquet", *PARTS[:3]]
    last = read(tmp_path / "batch" / "part-00002.parquet")
    assert last.columns["id"][0] == "4000"
    run(learned, "-o", tmp_path / "batch", "--pairs", write_pairs(tmp_path / "p.csv", rows[:5]))
    names = sorted(path.name for path in (tmp_path / "batch").iterdir())
    assert names == ["_manifest.json", "pairs.parquet", "part-00000.parquet"]


def test_stop_refuses_the_table_before_anything_is_written(learned, tmp_path):
    for bad, code, message in zip(
        BAD,
        (2, 2, 3),
        ("p.csv: line 5, column 'y0': 'nan'", "pair e: start and goal are one", "pair f: the line"),
        strict=True,
    ):
        table = write_pairs(tmp_path / "p.csv", [*GOOD, bad])
        done = run(learned, "-o", tmp_path / "batch", "--pairs", table)
        assert done.exit_code == code
        assert message in done.stderr
        assert not (tmp_path / "batch").exists()


def test_skip_draws_the_good_pairs_and_names_every_bad_one(learned, tmp_path):
    table = write_pairs(tmp_path / "p.csv", [*GOOD, *BAD])
    done = run(learned, "-o", tmp_path / "batch", "--pairs", table, "--on-error", "skip")
    assert done.exit_code == 0
    assert "3 strokes drawn, 3 pairs skipped" in done.stderr
    for name in ("line 5, column 'y0'", "pair e", "pair f"):
        assert name in done.stderr
    status = read(tmp_path / "batch" / "pairs.parquet").columns["status"]
    assert [s == "ok" for s in status] == [True] * 3 + [False] * 3


def test_a_table_without_one_good_pair_is_refused(learned, tmp_path):
    table = write_pairs(tmp_path / "p.csv", BAD)
    done = run(learned, "-o", tmp_path / "batch", "--pairs", table, "--on-error", "skip")
    assert done.exit_code == 2
    assert "no pair can be drawn" in done.stderr
    assert not (tmp_path / "batch").exists()


def test_a_batch_cannot_be_a_file_or_a_pipe(learned, tmp_path):
    table = write_pairs(tmp_path / "p.csv", GOOD)
    (tmp_path / "file").touch()
    for output, message in ((tmp_path / "file", "is a file"), ("-", "need a folder")):
        done = run(learned, "-o", output, "--pairs", table)
        assert done.exit_code == 2
        assert message in done.stderr


def test_closed_strokes_take_any_pair(tmp_path):
    path = write_skill(tmp_path / "s.json", circle())
    done = run(path, "-o", tmp_path / "t", "--start", 1, 2, 3, "--goal", 1, 2, 3)
    assert done.exit_code == 0
    assert np.linalg.norm(read(tmp_path / "t").position()[-1] - [1, 2, 3]) < 0.05


@pytest.mark.parametrize("content", [b"{}", b"not json", b"PAR1", b'{"schema": "skill"}'])
def test_what_is_no_skill_is_refused(tmp_path, content):
    (tmp_path / "s.json").write_bytes(content)
    done = run(tmp_path / "s.json", "-o", tmp_path / "t", *PAIR)
    assert done.exit_code == 2
    assert done.stderr.startswith("dmpcli: ")
    assert "s.json" in done.stderr


number = st.floats(-1e4, 1e4) | st.floats() | st.just(0.0)


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(start=st.tuples(number, number, number), goal=st.tuples(number, number, number))
def test_any_pair_is_drawn_finite_or_refused_in_one_line(learned, tmp_path, start, goal):
    output = tmp_path / "t"
    output.unlink(missing_ok=True)
    done = run(learned, "-o", output, "--start", *start, "--goal", *goal, "--rate", 10)
    assert done.exit_code in (0, 2, 3)
    if done.exit_code == 0:
        assert np.all(np.isfinite(read(output).position()))
    else:
        assert len(done.stderr.strip().splitlines()) == 1
        assert not output.exists()


@pytest.mark.parametrize("option", ["--amplitude=scale", "--orientation=surface"])
def test_what_the_original_model_cannot_give_is_refused(tmp_path, option):
    path = write_skill(tmp_path / "s.json", paper_stroke(), model="original")
    done = run(path, "-o", tmp_path / "t", *PAIR, option)
    assert done.exit_code == 2
    assert "the original DMP" in done.stderr


def test_a_closed_stroke_cannot_scale_with_a_distance(tmp_path):
    path = write_skill(tmp_path / "s.json", circle())
    done = run(path, "-o", tmp_path / "t", *PAIR, "--amplitude", "scale")
    assert done.exit_code == 2
    assert "a closed stroke has no" in done.stderr


def test_a_wall_keeps_the_given_normal_and_the_asked_tool_decides(learned, tmp_path):
    wall = tmp_path / "plane.json"
    wall.write_text(json.dumps({"point": [0, 0, 0], "normal": [-1, 0, 0]}))
    pair = ["--start", 0, 0, 0, "--goal", 0, 90, 0, "--surface", wall]
    for extra in ([], ["--start-orientation", 0, 1.5708, 0]):
        done = run(learned, "-o", tmp_path / "t", *pair, *extra)
        assert "flipped" not in done.stderr
        assert read(tmp_path / "t").provenance.facts["normal"] == pytest.approx([-1, 0, 0])
    done = run(learned, "-o", tmp_path / "t", *pair, "--start-orientation", 0, -1.5708, 0)
    assert "flipped" in done.stderr


def test_an_older_batch_stays_whole_when_a_new_one_is_refused(learned, tmp_path):
    table = write_pairs(tmp_path / "p.csv", GOOD)
    run(learned, "-o", tmp_path / "batch", "--pairs", table)
    before = {p.name: p.read_bytes() for p in (tmp_path / "batch").iterdir()}
    document = json.loads(learned.read_text())
    document["k"][0] = 90.0
    (tmp_path / "odd.json").write_text(json.dumps(document))
    done = run(tmp_path / "odd.json", "-o", tmp_path / "batch", "--pairs", table)
    assert done.exit_code == 3
    assert {p.name: p.read_bytes() for p in (tmp_path / "batch").iterdir()} == before


def test_pairs_may_be_parquet(learned, tmp_path):
    import pandas as pd

    frame = pd.DataFrame([[0.0, 0, 0, 90, 0, 0]], columns=["x0", "y0", "z0", "xg", "yg", "zg"])
    frame.to_parquet(tmp_path / "p.parquet")
    done = run(learned, "-o", tmp_path / "batch", "--pairs", tmp_path / "p.parquet")
    assert done.exit_code == 0

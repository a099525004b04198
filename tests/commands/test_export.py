"""``dmpcli export``: what each kind of file gives, and what is refused."""

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from dmpcli import cli
from dmpcli.formats.registry import FORMATS
from dmpcli.kinematics.chain import forward
from dmpcli.kinematics.models import model
from dmpcli.records import record
from dmpcli.records.file_io import read as read_file
from dmpcli.settings.export import WORDS

REFERENCE = "sample_runs/reference.parquet"
PAIR = ["--start", "-701.698", "132.42", "-17.538", "--goal", "-807.597", "129.739", "-17.518"]


def run(*args):
    return CliRunner().invoke(cli.app, [str(arg) for arg in args])


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    skill, drawn, ran = folder / "s.json", folder / "t.parquet", folder / "r.parquet"
    pairs = folder / "pairs.csv"
    pairs.write_text(
        "id,x0,y0,z0,xg,yg,zg\n" + "".join(f"p{i},{400 + i},0,0,{500 + i},0,0\n" for i in range(3))
    )
    for args in (
        ["fit", REFERENCE, "-o", skill],
        ["generalize", skill, "-o", drawn, *PAIR, "--ease-in", 0.5, "--ease-out", 0.5],
        ["execute", drawn, "-o", ran],
        ["generalize", skill, "-o", folder / "batch", "--pairs", pairs],
    ):
        done = run(*args)
        assert done.exit_code == 0, done.stderr
    return folder


def table(path):
    head, *rows = path.read_text().splitlines()
    names = head.split(",")
    cells = [row.split(",") for row in rows]
    return {
        name: np.array([float(c[i]) if c[i] else np.nan for c in cells])
        for i, name in enumerate(names)
        if name != "id"
    }


def test_the_options_and_the_registry_name_the_same_formats():
    assert tuple(FORMATS) == WORDS


@pytest.mark.slow
def test_a_run_lies_on_its_plan_at_the_same_times(files, tmp_path):
    done = run("export", files / "r.parquet", "-o", tmp_path / "r.csv")
    assert done.exit_code == 0, done.stderr
    drawn = table(tmp_path / "r.csv")
    plan = record.decode(read_file(files / "t.parquet"))
    at = np.column_stack([np.interp(drawn["t [s]"], plan.t, axis) for axis in plan.position().T])
    actual = np.column_stack([drawn[f"{n} [mm]"] for n in "xyz"])
    off = np.linalg.norm(actual - at, axis=1)
    # With the look-ahead of the mock left on, it is late by millimetres.
    ran = record.decode(read_file(files / "r.parquet"))
    lookahead = ran.provenance.facts["lookahead"]
    assert lookahead > 0.0
    late = np.column_stack(
        [np.interp(drawn["t [s]"] + lookahead, plan.t, axis) for axis in plan.position().T]
    )
    assert off.max() < 0.2 < 0.8 < np.linalg.norm(actual - late, axis=1).max()


def test_a_batch_leaves_as_one_table_or_a_file_of_each(files, tmp_path):
    assert run("export", files / "batch", "-o", tmp_path / "b.csv").exit_code == 0
    rows = (tmp_path / "b.csv").read_text().splitlines()
    assert {row.split(",")[0].strip('"') for row in rows[1:]} == {"p0", "p1", "p2"}
    done = run("export", files / "batch", "-o", tmp_path / "b-{id}.tum")
    assert done.exit_code == 0, done.stderr
    assert sorted(p.name for p in tmp_path.glob("*.tum")) == [f"b-p{i}.tum" for i in range(3)]
    alone = run("export", files / "batch", "-o", tmp_path / "one.tum", "--id", "p1")
    assert alone.exit_code == 0
    assert (tmp_path / "one.tum").read_bytes() == (tmp_path / "b-p1.tum").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["csv", "tum", "ply", "obj", "ngc", "script", "src", "mod"])
def test_the_same_file_gives_the_same_bytes(files, tmp_path, suffix):
    for name in "ab":
        done = run("export", files / "t.parquet", "-o", tmp_path / name / f"o.{suffix}")
        assert done.exit_code == 2  # the folder is not there
        (tmp_path / name).mkdir()
        done = run("export", files / "t.parquet", "-o", tmp_path / name / f"o.{suffix}")
        assert done.exit_code == 0, done.stderr
    first, second = ((tmp_path / name / f"o.{suffix}").read_bytes() for name in "ab")
    assert first == second


def test_an_arms_joints_leave_by_their_suffix(files, tmp_path):
    path = tmp_path / "o.joints.csv"
    done = run("export", files / "t.parquet", "-o", path, "--robot-model", "ec66")
    assert done.exit_code == 0, done.stderr
    assert len(table(path)) == 7
    done = run("export", files / "t.parquet", "-o", path)
    assert done.exit_code == 2
    assert "--robot-model ec66" in done.stderr


@pytest.mark.slow
def test_a_run_leaves_with_the_joints_that_its_file_holds(files, tmp_path):
    """By kinematics of the mock's own poses; forward again they are these poses."""
    ran = tmp_path / "r.parquet"
    assert run("execute", files / "t.parquet", "-o", ran, "--robot-model", "ec66").exit_code == 0
    held = record.decode(read_file(ran))
    assert held.provenance.facts["joints"] == {"arm": "ec66", "measured": False}
    q = held.stack([f"q{i}" for i in range(1, 7)])
    at = forward(model("ec66"), q)
    place, turn = at.position, at.rotation
    np.testing.assert_allclose(place, held.position(), atol=1e-6)
    np.testing.assert_allclose(turn, held.rotation(), atol=1e-8)
    done = run("export", ran, "-o", tmp_path / "o.joints.csv")
    assert done.exit_code == 0, done.stderr
    assert "by kinematics, no robot told them" in done.stderr
    left = table(tmp_path / "o.joints.csv")
    poses = run("export", ran, "-o", tmp_path / "o.csv")
    assert poses.exit_code == 0
    drawn = table(tmp_path / "o.csv")
    np.testing.assert_array_equal(left["t [s]"], drawn["t [s]"])
    again = forward(
        model("ec66"), np.column_stack([left[f"q{i} [rad]"] for i in range(1, 7)])
    ).position
    np.testing.assert_allclose(
        again, np.column_stack([drawn[f"{n} [mm]"] for n in "xyz"]), atol=1e-6
    )
    other = run("export", ran, "-o", tmp_path / "p.joints.csv", "--robot-model", "ur5e")
    assert other.exit_code == 2
    assert "holds the joints of an ec66" in other.stderr
    done = run("export", ran, "-o", tmp_path / "set", "--format", "lerobot")
    assert done.exit_code == 0, done.stderr
    [episode] = (tmp_path / "set" / "data").rglob("*.parquet")
    wide = np.array(pq.read_table(episode)["observation.joints"].to_pylist())
    assert wide.shape == (len(wide), 6)
    assert np.abs(wide[0] - [left[f"q{i} [rad]"][0] for i in range(1, 7)]).max() < 1e-6


def test_another_programs_recording_leaves_too(tmp_path):
    source = tmp_path / "in.tum"
    t = np.linspace(0, 4, 101)
    rows = np.column_stack([t, 0.1 * t, 0.05 * np.sin(t), 0 * t, 1 + 0 * t, 0 * t, 0 * t, 0 * t])
    np.savetxt(source, rows)
    done = run("export", source, "-o", tmp_path / "out.csv", "--layout", "tum")
    assert done.exit_code == 0, done.stderr
    found = table(tmp_path / "out.csv")
    np.testing.assert_allclose(found["x [mm]"], 100 * t, atol=1e-9)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["-o", "x.parquet"], "suffix '.parquet' is of no format; there are .csv, .tum"),
        (["-o", "x"], "has no suffix"),
        (["-o", "x.csv", "--format", "xml"], "must be one of csv, tum"),
        (["-o", "x.csv", "--blend", "1"], "--blend: says nothing of csv"),
        (["-o", "x.csv", "--robot-model", "ec66"], "--robot-model: says nothing of csv"),
        (["-o", "x.csv", "--id", "nine"], "has no such stroke; it has 1"),
        (["-o", "x.csv", "--orientation", "0", "0", "0"], "--orientation: "),
        (["-o", "x.ngc", "--blend", "-1"], "--blend -1: must be 0 to 100 mm"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_written(
    files, tmp_path, monkeypatch, args, words
):
    drawn = files / "t.parquet"
    monkeypatch.chdir(tmp_path)
    done = run("export", drawn, *args)
    assert done.exit_code == 2, done.stderr
    assert words in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize(
    "args",
    [
        ["fit", REFERENCE],
        ["record"],
        ["generalize", "s.json", *PAIR],
        ["generalize", "s.json", "--reproduce"],
        ["execute", "t.parquet"],
        ["recover", "x.journal"],
        ["calibrate", "--tool", "tool.json"],
        ["touch"],
        ["register", "part.stl", "points.csv"],
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("suffix", [".xyz", ".tum"])
def test_no_command_writes_its_file_under_the_suffix_of_another_kind(tmp_path, args, suffix):
    done = run(*args, "-o", tmp_path / f"out{suffix}")
    assert done.exit_code == 2
    assert f"{suffix!r} is not its suffix; name it out." in done.stderr
    assert not list(tmp_path.iterdir())

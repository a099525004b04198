"""``dmpcli import``: what comes in is what left, and each kind of file becomes a demonstration."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from dmpcli import cli
from dmpcli.extras import ROS, SVG
from dmpcli.formats import mcap_file
from dmpcli.records import record, schemas
from dmpcli.records.file_io import read as read_file
from tests.extras_here import needs
from tests.formats.motions import angle_between, motion, wave
from tests.records.foreign import QUATERNION, XYZ, R, T, table

REFERENCE = "sample_runs/reference.parquet"


def run(*args):
    return CliRunner().invoke(cli.app, [str(arg) for arg in args])


def imported(path):
    return record.decode(read_file(path), schemas.DEMONSTRATION)


@pytest.mark.parametrize(
    ("suffix", "options"),
    [("csv", []), ("csv", ["--layout", "dmpcli"]), ("tum", ["--layout", "tum"])],
)
def test_what_left_in_doubles_comes_back_to_1e_9(tmp_path, suffix, options):
    there, back = tmp_path / f"o.{suffix}", tmp_path / "b.parquet"
    assert run("export", REFERENCE, "-o", there).exit_code == 0
    done = run("import", there, "-o", back, *options)
    assert done.exit_code == 0, done.stderr
    first, second = record.decode(read_file(REFERENCE)), imported(back)
    np.testing.assert_allclose(second.t, first.t, atol=1e-9)
    np.testing.assert_allclose(second.position(), first.position(), atol=1e-9)
    assert angle_between(second.rotation(), first.rotation()).max() < 1e-9
    assert second.provenance.command == "import"
    assert len(second.provenance.inputs[0]["sha256"]) == 64


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["script", "src", "mod", "ngc"])
def test_a_program_comes_back_within_a_hundredth(tmp_path, suffix):
    there, back = tmp_path / f"o.{suffix}", tmp_path / "b.parquet"
    assert run("export", REFERENCE, "-o", there).exit_code == 0
    done = run("import", there, "-o", back)
    assert done.exit_code == 0, done.stderr
    first, second = record.decode(read_file(REFERENCE)), imported(back)
    at = np.column_stack([np.interp(first.t, second.t, p) for p in second.position().T])
    np.testing.assert_allclose(at, first.position(), atol=0.01)
    if suffix == "ngc":
        assert second.rotation() is None
    else:
        turned = np.degrees(angle_between(second.rotation(), first.rotation()[:1]))
        assert turned.max() < 0.01


@needs(SVG)
def test_a_drawing_becomes_a_demonstration_that_fit_takes(tmp_path):
    path = tmp_path / "wave.svg"
    path.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="200mm" height="100mm" '
        'viewBox="0 0 200 100"><path d="M 20 50 C 60 -30, 100 130, 160 50"/></svg>'
    )
    done = run("import", path, "-o", tmp_path / "d.parquet", "--speed", 40)
    assert done.exit_code == 0, done.stderr
    assert "1 path, 140.0 x" in done.stderr
    found = imported(tmp_path / "d.parquet")
    np.testing.assert_allclose(found.position()[[0, -1]], [[20, 50, 0], [160, 50, 0]], atol=1e-9)
    done = run("fit", tmp_path / "d.parquet", "-o", tmp_path / "s.json")
    assert done.exit_code == 0, done.stderr


def test_several_files_become_a_file_each(tmp_path):
    for name in "ab":
        (tmp_path / f"{name}.csv").write_text(table("t,x,y,z", T, *XYZ.T))
    files = [tmp_path / "a.csv", tmp_path / "b.csv"]
    done = run("import", *files, "-o", tmp_path / "all.parquet")
    assert done.exit_code == 2
    assert "{name}" in done.stderr
    done = run("import", *files, "-o", tmp_path / "d-{name}.parquet")
    assert done.exit_code == 0, done.stderr
    assert (tmp_path / "d-a.parquet").read_bytes() == (tmp_path / "d-b.parquet").read_bytes()


@pytest.mark.slow
def test_the_strokes_of_a_program_are_chosen_or_written_one_by_one(tmp_path):
    from dmpcli.formats import urscript
    from dmpcli.formats.toolpath import ProgramOptions

    path = tmp_path / "two.script"
    strokes = motion(wave(name="a"), wave(name="b", offset=200.0))
    path.write_bytes(urscript.encode(strokes, ProgramOptions(), "two"))
    done = run("import", path, "-o", tmp_path / "d.parquet")
    assert done.exit_code == 2
    assert "holds 2 strokes: a, b; choose one with --episode" in done.stderr
    assert run("import", path, "-o", tmp_path / "d-{id}.parquet").exit_code == 0
    assert run("import", path, "-o", tmp_path / "b.parquet", "--episode", "b").exit_code == 0
    position = imported(tmp_path / "d-b.parquet").position()
    np.testing.assert_array_equal(position, imported(tmp_path / "b.parquet").position())
    np.testing.assert_allclose(position[0], strokes.strokes[1].position[0], atol=1e-4)


def lerobot_like(path, episodes=2):
    """A Parquet as LeRobot v3 has it: list columns, several episodes one after the other."""
    rows = len(T) * episodes
    state = np.tile(np.hstack([XYZ / 1000, QUATERNION]), (episodes, 1)).astype(np.float32)
    columns = {
        "observation.state": pa.FixedSizeListArray.from_arrays(pa.array(state.ravel()), 7),
        "timestamp": pa.array(np.tile(T, episodes).astype(np.float32)),
        "episode_index": pa.array(np.repeat(np.arange(episodes), len(T))),
    }
    pq.write_table(pa.table(columns), path)
    return rows


def test_list_columns_and_episodes_of_a_dataset_are_read(tmp_path):
    path, back = tmp_path / "file-000.parquet", tmp_path / "d.parquet"
    lerobot_like(path)
    done = run("import", path, "-o", back, "--layout", "lerobot")
    assert done.exit_code == 2
    assert "tells 2 recordings apart: 0, 1; choose one with --episode" in done.stderr
    done = run("import", path, "-o", back, "--layout", "lerobot", "--episode", "7")
    assert done.exit_code == 2
    assert "has 0, 1" in done.stderr
    done = run(
        *("import", path, "-o", back, "--layout", "lerobot", "--episode", "1"),
        *("--rotation", "quaternion"),
        *(f"--map=q{a}=observation.state[{3 + i}]" for i, a in enumerate("xyzw")),
    )
    assert done.exit_code == 0, done.stderr
    found = imported(back)
    np.testing.assert_allclose(found.position(), XYZ, atol=1e-3)
    assert angle_between(found.rotation(), R.as_matrix()).max() < 1e-6


def test_a_bad_row_of_an_episode_is_named_as_in_the_whole_file(tmp_path):
    text = table(
        "episode,t,x,y,z", np.repeat([0, 1], len(T)), np.tile(T, 2), *np.tile(XYZ, (2, 1)).T
    )
    lines = text.splitlines()
    lines[len(T) + 3] = "1,0.1,bad,0,0"
    path = tmp_path / "two.csv"
    path.write_text("\n".join(lines))
    done = run("import", path, "-o", tmp_path / "d.parquet", "--episode", "1")
    assert done.exit_code == 2
    assert f"line {len(T) + 4}" in done.stderr


def test_dropped_duplicates_are_the_first_of_repeated_stamps(tmp_path):
    text = table("t,x,y,z", np.r_[T[:9], T[8], T[9:]], *np.r_[XYZ[:9], XYZ[8:9], XYZ[9:]].T)
    (tmp_path / "a.csv").write_text(text)
    for name, options in (("a", ["--drop-duplicates"]), ("b", ["--repeated-stamps", "first"])):
        done = run("import", tmp_path / "a.csv", "-o", tmp_path / f"{name}.parquet", *options)
        assert done.exit_code == 0, done.stderr
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()


@pytest.mark.parametrize(
    ("name", "text", "options", "words"),
    [
        ("a.ngc", "G1 X1 F60\nG1 X2", ["--layout", "ur"], "--layout: says nothing of a gcode"),
        ("a.csv", "t,x,y,z\n", ["--lift", "3"], "--lift: says nothing of a table"),
        ("a.script", "movel(p[0,0,0,0,0,0])\n", ["--speed", "3"], "--speed: says nothing of"),
        ("a.script", "import os\n", [], "line 1: 'import os' is not read"),
        ("a.csv", "", [], "is empty"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path, name, text, options, words):
    (tmp_path / name).write_text(text)
    done = run("import", tmp_path / name, "-o", tmp_path / "d.parquet", *options)
    assert done.exit_code == 2, done.stderr
    assert words in done.stderr
    assert not (tmp_path / "d.parquet").exists()


@pytest.mark.slow
@needs(ROS)
def test_a_place_that_no_reader_of_demonstrations_takes_is_refused(tmp_path):
    one = wave()
    one.position[3, 2] = 1e12
    (tmp_path / "o.mcap").write_bytes(mcap_file.encode(motion(one)))
    done = run("import", tmp_path / "o.mcap", "-o", tmp_path / "b.parquet")
    assert done.exit_code == 2
    assert "sample 4: the position is beyond" in done.stderr
    assert not (tmp_path / "b.parquet").exists()


def test_a_program_of_days_is_refused_with_the_rate_that_would_do(tmp_path):
    path = tmp_path / "o.ngc"
    path.write_text("G21 G90\nG1 X0 Y0 F1e-3\nG1 X900 Y0\n")
    done = run("import", path, "-o", tmp_path / "b.parquet")
    assert done.exit_code == 2
    assert "lower --rate" in done.stderr


def test_the_wrench_of_an_exported_table_comes_back(tmp_path):
    felt = np.column_stack([np.sin(T + i) for i in range(6)])
    columns = dict(zip("xyz", XYZ.T, strict=True)) | {"t": T}
    columns |= dict(zip(schemas.WRENCH, felt.T, strict=True))
    made = record.Record(schemas.DEMONSTRATION, columns, record.Provenance("record"))
    there, table_, back = (tmp_path / name for name in ("d.parquet", "d.csv", "b.parquet"))
    there.write_bytes(record.encode(made))
    assert run("export", there, "-o", table_).exit_code == 0
    done = run("import", table_, "-o", back)
    assert done.exit_code == 0, done.stderr
    assert "read as the wrench on the tool, at the TCP, in base axes" in done.stderr
    np.testing.assert_allclose(imported(back).stack(schemas.WRENCH), felt, atol=1e-12)
    again = run("export", table_, "-o", tmp_path / "e.csv")
    assert again.exit_code == 0
    assert (tmp_path / "e.csv").read_bytes() == table_.read_bytes()


def test_a_wrench_whose_units_are_not_said_is_not_taken_and_that_is_told(tmp_path):
    path = tmp_path / "d.csv"
    path.write_text(table("t,x,y,z,fx,fy,fz,tx,ty,tz", T, *XYZ.T, *[0 * T] * 6))
    done = run("import", path, "-o", tmp_path / "b.parquet")
    assert done.exit_code == 0
    assert "fx ... tz are not read: [N] and [N·m] in their names" in done.stderr
    assert not imported(tmp_path / "b.parquet").has(*schemas.WRENCH)

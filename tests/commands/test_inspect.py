"""``dmpcli inspect`` through the real command line: ours, damaged, and from elsewhere."""

import json
import shlex
from functools import partial

import jsonschema
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.commands.running import invoke
from tests.records.foreign import XYZ, R, T, table
from tests.records.meshes import box, grid, obj, written
from tests.records.test_foreign_recordings import FILES
from tests.reporting.example_files import demonstration, paper_files, put, trajectory, wave

dmpcli = partial(invoke, "inspect")


def found(*words, stdin=None):
    result = dmpcli(*words, "--json", stdin=stdin)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)["found"]


def test_our_files_tell_schema_columns_units_ranges_and_provenance(tmp_path):
    told = found(put(tmp_path, "demo", demonstration()))
    assert (told["schema"], told["version"], told["rows"]) == ("demonstration", 1, 501)
    assert told["duration"] == pytest.approx(10.0)
    assert told["rate"] == pytest.approx(50.0)
    columns = {column["name"]: column for column in told["columns"]}
    assert columns["x"]["unit"] == "mm"
    assert columns["x"]["least"] == pytest.approx(-660.021)
    assert columns["x"]["largest"] == pytest.approx(-551.03)
    assert told["provenance"]["command"] == "record"
    assert told["provenance"]["facts"]["simulated"] is True


@pytest.mark.parametrize("name", ["demo", "modified", "drawn"])
def test_every_kind_of_record_is_described_in_a_hundred_columns(tmp_path, name):
    result = dmpcli(paper_files(tmp_path)[name])
    assert result.exit_code == 0
    assert max(map(len, result.stdout.splitlines())) <= 100
    for word in ("version 1", "sha256", "unit", "50 Hz"):
        assert word in result.stdout


def test_the_rate_is_that_of_all_rows_however_they_came(tmp_path):
    uneven = demonstration()
    t = uneven.columns["t"]
    t[1:-1] += np.where(np.arange(len(t) - 2) % 3, -0.004, 0.004)
    told = json.loads(dmpcli(put(tmp_path, "demo", uneven), "--json").stdout)["found"]
    assert told["rate"] == pytest.approx(50.0)


def test_several_strokes_in_a_file_are_counted(tmp_path):
    path = put(tmp_path, "two", trajectory(np.vstack([wave(), wave()]), ids=["a", "b"]))
    assert found(path)["strokes"] == 2
    assert "2 strokes" in dmpcli(path).stdout


def test_standard_input_is_read(tmp_path):
    with open(put(tmp_path, "demo", demonstration()), "rb") as stream:
        assert found("-", stdin=stream.read())["schema"] == "demonstration"


def test_presets_tell_their_sections_and_units():
    from dmpcli.settings import layers

    folder = layers.resources.files("dmpcli") / "presets"
    told = found(folder / "paper.toml")
    assert told["schema"] == "preset"
    assert told["content"]["[units] length"] == "mm"
    assert told["content"]["[fit] basis"] == 80


def test_planes_and_reports_are_known_by_content(tmp_path):
    plane = tmp_path / "a.json"
    plane.write_text('{"schema": "plane", "version": 1, "point": [0, 0, 1], "normal": [0, 0, 1]}')
    told = found(plane)
    assert told["ours"]
    assert told["content"] == {"point": [0, 0, 1], "normal": [0, 0, 1]}
    plane.write_text('{"colour": "red"}')
    assert not found(plane)["ours"]


def test_a_foreign_table_tells_how_fit_could_read_it(tmp_path):
    log = tmp_path / "ur.csv"
    header = "timestamp " + " ".join(f"actual_TCP_pose_{i}" for i in range(6))
    log.write_text(header + "\n0.0 1 2 3 0 0 0\n0.1 1 2 4 0 0 0\n")
    told = found(log)
    assert not told["ours"]
    assert told["rows"] == 2
    assert told["mapping"]["z"] == "actual_TCP_pose_2"
    assert "--layout ur" in dmpcli(log).stdout

    log.write_text("time,x,y,pz,who\n0,1,2,3,me\n1,2,3,4,me\n")
    assert "--map t=time --map z=pz" in dmpcli(log).stdout
    log.write_text("a,b\n1,2\n")
    assert "no column looks like t, x, y, z" in dmpcli(log).stdout

    other = tmp_path / "other.parquet"
    pq.write_table(
        pa.table({"t": [0.0, 1.0], "x": [1.0, None], "y": [0, 1], "z": ["a", "b"]}), other
    )
    told = found(other)
    assert told["format"] == "Parquet"
    assert [column["missing"] for column in told["columns"]][:3] == [0, 1, 0]
    assert "fit refuses it: column 'x', row 2: an empty cell" in dmpcli(other).stdout


@pytest.mark.parametrize("name", ["skill", "plane", "tool"])
def test_published_schemas_are_valid_json_schemas(name):
    result = dmpcli("--schema", name)
    assert result.exit_code == 0
    jsonschema.Draft202012Validator.check_schema(json.loads(result.stdout))


def test_bad_input_is_one_clear_error(tmp_path):
    cut = tmp_path / "cut.parquet"
    with open(put(tmp_path, "demo", demonstration()), "rb") as stream:
        cut.write_bytes(stream.read()[:-50])
    empty, binary = tmp_path / "empty.csv", tmp_path / "binary"
    empty.write_text("")
    binary.write_bytes(bytes(range(256)))
    newer, toml = tmp_path / "newer.json", tmp_path / "bad.toml"
    newer.write_text('{"schema": "skill", "version": 99}')
    toml.write_text("= 3")
    for words, told in (
        ([cut], "cut.parquet"),
        ([empty], "empty"),
        ([binary], "binary"),
        ([newer], "newer"),
        ([toml], "bad.toml"),
        ([tmp_path / "none"], "no such file"),
        ([tmp_path], "directory"),
        ([], "FILE"),
        (["--schema", "recipe"], "skill, plane"),
    ):
        result = dmpcli(*words)
        assert result.exit_code == 2, words
        assert result.stdout == ""
        assert told in result.stderr
        assert len(result.stderr.strip().splitlines()) <= 2


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("stl", "binary STL"),
        ("stl_ascii", "text STL"),
        ("obj", "OBJ"),
        ("ply", "PLY"),
        ("off", "OFF"),
    ],
)
def test_meshes_tell_their_size_pieces_borders_and_fineness(tmp_path, kind, name):
    path = tmp_path / "part"
    path.write_bytes(written(*grid(n=9, half=40.0), kind))
    told = found(path)
    assert (told["format"], told["ours"]) == (name, False)
    content = told["content"]
    assert (content["vertices"], content["faces"], content["pieces"]) == (81, 128, 1)
    assert (content["border_edges"], content["borders"]) == (32, 1)
    assert content["size"] == pytest.approx([80.0, 80.0, 2 * 40.0**2 / 240], abs=1e-5)
    assert content["likely_unit"] == "mm"
    # Chords of edges of 10 mm, and diagonals, on z = (x² - y²) / 240.
    assert content["error_largest"] == pytest.approx(10.0**2 / 960, rel=0.2)
    assert content["noisy_share"] == 0.0
    text = dmpcli(path).stdout
    assert max(map(len, text.splitlines())) <= 80
    assert "faces" in text


def test_a_closed_mesh_has_no_border_and_one_in_metres_is_suspected(tmp_path):
    V, F = box()
    path = tmp_path / "box.ply"
    path.write_bytes(written(1e-3 * V, F, "ply"))
    content = found(path)["content"]
    assert (content["borders"], content["pieces"], content["likely_unit"]) == (0, 1, "m")


def test_what_mending_did_to_a_mesh_is_told_and_the_rest_refused(tmp_path):
    V, F = grid()
    path = tmp_path / "part.obj"
    path.write_bytes(obj(np.vstack([V, [[0.0, 0.0, 9.0]]]), np.vstack([F, F[:1]])))
    content = found(path)["content"]
    assert content["faces_in_file"] == len(F) + 1
    assert content["faces"] == len(F)
    assert any("twice" in remark or "duplicate" in remark for remark in content["remarks"])
    path.write_bytes(obj(V, F + 1))
    result = dmpcli(path)
    assert result.exit_code == 2
    assert "part.obj" in result.stderr


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("part.step", b"ISO-10303-21;\nHEADER;\nENDSEC;\n", "a STEP file"),
        ("part.glb", b"glTF\2\0\0\0\x0c\0\0\0", "a GLB file"),
        ("part.gltf", b'{"asset": {"version": "2.0"}, "meshes": []}', "a glTF file"),
        ("part.dae", b"<?xml version='1.0'?>\n<COLLADA>", "a DAE file"),
    ],
)
def test_formats_of_parts_that_are_not_read_are_named_with_what_to_do(
    tmp_path, name, content, what
):
    path = tmp_path / name
    path.write_bytes(content)
    result = dmpcli(path)
    assert result.exit_code == 2
    assert f"{name}: is {what}" in result.stderr
    assert "export the part as STL, OBJ, PLY or OFF" in result.stderr


def test_a_closed_mesh_tells_its_area_and_volume_and_an_open_one_its_area(tmp_path):
    V, F = box()
    path = tmp_path / "box.off"
    path.write_bytes(written(V, F, "off"))
    content = found(path)["content"]
    assert content["area"] == pytest.approx(2200.0)
    assert content["volume"] == pytest.approx(6000.0)
    path.write_bytes(written(V, F[1:], "off"))
    assert found(path)["content"]["volume"] is None


def test_a_large_mesh_is_said_to_take_a_while(tmp_path, monkeypatch):
    from dmpcli.records import mesh

    path = tmp_path / "part.ply"
    path.write_bytes(written(*grid(), "ply"))
    assert "takes a while" not in dmpcli(path).stderr
    monkeypatch.setattr(mesh, "LONG", 1000)
    result = dmpcli(path, "--json")
    assert "part.ply: reading a mesh of 0 MB takes a while" in result.stderr
    assert json.loads(result.stdout)["found"]["format"] == "PLY"


def test_a_file_larger_than_memory_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "part.stl"
    with path.open("wb") as file:
        file.truncate(3 * 2**30)  # takes no room on the disk
    result = dmpcli(path)
    assert result.exit_code == 2
    assert "part.stl: has 3.0 GiB, more than the 2 GiB" in result.stderr


def test_a_recording_tells_what_fit_reads_and_would_trim_and_how(tmp_path):
    """5 s of rest, the wave in 8 s, 3 s of rest; a gap of 0.2 s on the way."""
    names = "timestamp," + ",".join(f"actual_TCP_pose_{i}" for i in range(6))
    before, after = np.arange(0.0, 5.0, 0.04), 13.0 + np.arange(0.04, 3.0, 0.04)
    t = np.concatenate([before, 5.0 + T, after])
    ends = [1 + len(before), *[1] * (len(T) - 2), 1 + len(after)]
    way, turn = np.repeat(XYZ, ends, axis=0), np.repeat(R.as_rotvec(), ends, axis=0)
    keep = np.ones(len(t), dtype=bool)
    keep[200:204] = False
    log = tmp_path / "log.csv"
    log.write_text(table(names, t[keep], *(way[keep] / 1000).T, *turn[keep].T))
    told = found(log)["recording"]
    assert told["rows"] == keep.sum()
    assert told["rate"] == pytest.approx(25.0)
    assert told["duration"] == pytest.approx(t[-1])
    [gap] = told["gaps"]
    assert gap["seconds"] == pytest.approx(0.2)
    assert gap["at"] == pytest.approx(t[199])
    size = np.subtract(told["largest"], told["least"])
    np.testing.assert_allclose(size, np.ptp(XYZ, axis=0), atol=1e-3)
    assert told["orientation"]["lean"] == pytest.approx(0.0, abs=1e-3)
    turned = np.degrees((R * R[0].inv()).magnitude().max())
    assert told["orientation"]["turn"] == pytest.approx(turned, abs=1e-3)
    assert told["fit"]["before"] == pytest.approx(5.0, abs=0.5)
    assert told["fit"]["after"] == pytest.approx(3.0, abs=0.5)
    assert told["told"][0].startswith("recognised as --layout ur")
    assert told["command"].endswith("log.csv -o skill.json")
    text = dmpcli(log).stdout
    for words in ("1 gap: 0.2 s at", "extent 110.0 48.0 0.0 mm", "fit would trim", "leans 0.0°"):
        assert words in text
    assert max(map(len, text.splitlines()[:6])) <= 80


def test_the_command_that_inspect_prints_is_the_one_that_reads(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text(table("clock,a,b,c", 1000 * T, *XYZ.T))
    options = ["--map", "t=clock", "--map", "x=a", "--map", "y=b", "--map", "z=c"]
    assert "t" in found(log)["recording"]["refused"]
    told = found(log, *options, "--time-unit", "ms")["recording"]
    words = shlex.split(told["command"])
    assert words[:2] == ["dmpcli", "fit"]
    words[words.index("skill.json")] = tmp_path / "skill.json"
    assert invoke(*words[1:]).exit_code == 0


def test_our_own_demonstrations_are_read_likewise(tmp_path):
    told = found(put(tmp_path, "demo", demonstration()))["recording"]
    assert told["rows"] == 501
    assert told["rate"] == pytest.approx(50.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(FILES))
def test_every_known_recorder_is_inspected_by_its_word(tmp_path, name):
    layout, text = FILES[name]
    log = tmp_path / "log.csv"
    log.write_text(text)
    told = found(log, "--layout", layout)["recording"]
    assert told["rows"] == len(T)
    assert told["command"].endswith(f"--layout {layout}")

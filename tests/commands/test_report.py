"""``dmpcli report`` through the real command line, on files with known wave heights."""

import csv
import json
import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from dmpcli.records import schemas
from dmpcli.records.record import Provenance, Record
from tests.commands.running import invoke
from tests.reporting.example_files import (
    CURVED_GOAL,
    CURVED_START,
    GOAL,
    NEW_GOAL,
    NEW_START,
    START,
    circle,
    curved_trajectory,
    demonstration,
    fillet_mesh,
    fillet_wave,
    paper_files,
    put,
    put_stl,
    trajectory,
    wave,
)

dmpcli = partial(invoke, "report")


def document(*words, stdin=None):
    result = dmpcli(*words, "--json", stdin=stdin)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def refused(*words, stdin=None):
    result = dmpcli(*words, stdin=stdin)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert len(result.stderr.strip().splitlines()) <= 2
    assert "Traceback" not in result.output
    return result.stderr


@pytest.fixture
def files(tmp_path):
    return paper_files(tmp_path)


def test_wave_heights_deviation_and_ends_of_the_papers_experiment(files):
    report = document(*files.values())
    assert (report["schema"], report["version"]) == ("report", 1)
    assert report["reference"] == "demo"
    rows = {entry["file"]: entry["strokes"][0] for entry in report["files"]}
    heights = {name: row["wave"]["mean"] for name, row in rows.items()}
    expected = [49.979, 47.7, 49.2, 98.1, 45.7, 49.9]
    assert list(heights.values())[:6] == pytest.approx(expected, abs=5e-3)
    assert heights["drawn"] == pytest.approx(49.9, abs=5e-3)
    assert rows["demo"]["deviation"] is None
    assert rows["demo"]["simulated"]
    # Half the difference in height at the crests, nothing at the ends.
    assert rows["modified"]["deviation"]["nearest_max"] == pytest.approx(0.39, abs=0.03)
    assert rows["carried"]["deviation"]["nearest_max"] < 0.06
    assert rows["carried"]["start_error"] == rows["carried"]["goal_error"] == 0.0
    assert rows["demo"]["start_error"] is None


def test_a_run_tells_its_deadlines_and_how_the_arm_followed(files):
    (entry,) = document(files["drawn"])["files"]
    told = entry["deadlines"]
    assert (told["missed"], told["cycles"]) == (1, 506)
    assert told["worst"] == pytest.approx(0.03)
    assert told["median"] == pytest.approx(1e-4)
    # Three cycles behind at the peak speed.
    peak = entry["strokes"][0]["peak_speed"]
    assert told["tracking_max"] == pytest.approx(0.06 * peak, rel=0.01)


def test_the_papers_tables_stand_beside_ours(files):
    assert document(*files.values())["paper"] == []
    first, second = document(*files.values(), "--paper")["paper"]
    assert [(r["role"], r["paper"]) for r in first["rows"]] == [
        ("demonstration", 49.979),
        ("original axis", 47.669),
        ("modified", 49.161),
    ]
    assert [r["difference"] for r in first["rows"]] == pytest.approx([0, 0.031, 0.039], abs=5e-3)
    assert [(r["role"], r["paper"]) for r in second["rows"]] == [
        ("demonstration", 49.979),
        ("original axis", 45.725),
        ("original distance", 45.725),
        ("modified", 49.158),
    ]
    assert first["notes"] == []
    (note,) = second["notes"]
    # What the literal factor does: -2.681 / -1.365.
    assert "1.964" in note
    assert "98.1" in note
    assert "45.725" in note


def test_without_the_papers_demonstration_there_is_no_paper_table(tmp_path, files):
    elsewhere = put(tmp_path, "other", demonstration(wave(START + 5.0, GOAL + 5.0)))
    assert document(elsewhere, files["modified"], "--paper")["paper"] == []
    assert document(files["modified"], "--paper")["paper"] == []


def test_tables_fit_eighty_columns_and_say_what_was_measured(files):
    result = dmpcli(*files.values(), "--paper")
    assert result.exit_code == 0
    assert max(map(len, result.stdout.splitlines())) <= 80
    assert "\x1b" not in result.stdout
    assert re.search(r"^modified +1 +49\.200 +0\.000 ", result.stdout, re.MULTILINE)
    for text in ("Table 1 of the paper", "Table 2 of the paper", "Deadlines", "simulated"):
        assert text in result.stdout


def test_what_a_person_drew_at_a_real_arm_is_not_measured_against_the_paper(tmp_path, files):
    real = demonstration(facts={"reference": None})
    del real.provenance.facts["reference"]
    assert document(put(tmp_path, "real", real), files["modified"], "--paper")["paper"] == []
    told = demonstration(facts={"simulated": False, "reference": {"shape": "csv"}})
    assert document(put(tmp_path, "told", told), files["modified"], "--paper")["paper"]


def test_each_wave_is_listed_where_there_are_several(tmp_path):
    path = put(tmp_path, "three", trajectory(wave(periods=3, height=20.0, n=2001)))
    assert re.search(r"three +(20\.000 *){5}", dmpcli(path).stdout)


@pytest.mark.slow
def test_the_folder_holds_json_csv_and_figures_and_is_the_same_twice(tmp_path, files):
    result = dmpcli(*files.values(), "-o", tmp_path / "deep" / "out", "-q")
    assert result.exit_code == 0
    assert result.stderr == ""
    out = tmp_path / "deep" / "out"
    written = {path.name: path.read_bytes() for path in out.iterdir()}
    assert {"report.json", "wave_heights.csv", "report.html", "time.svg"} <= set(written)
    assert json.loads(written["report.json"]) == document(*files.values())
    rows = list(csv.DictReader(written["wave_heights.csv"].decode().splitlines()))
    assert float(rows[0]["height_mm"]) == pytest.approx(49.979, abs=5e-3)
    assert len(rows) == 7
    assert not any(name.startswith(".") for name in written)
    dmpcli(*files.values(), "-o", out, "-q")
    assert {path.name: path.read_bytes() for path in out.iterdir()} == written


def test_neither_paths_nor_times_are_written(tmp_path, files):
    text = dmpcli(files["demo"], "--json").stdout
    assert str(tmp_path) not in text


def test_standard_input_and_tables_of_other_programs_are_read(tmp_path, files):
    (entry,) = document("-", stdin=Path(files["demo"]).read_bytes())["files"]
    assert entry["file"] == "standard input"
    lines = ["t x y z"] + [f"{0.02 * i} {x} {y} {z}" for i, (x, y, z) in enumerate(wave().tolist())]
    path = tmp_path / "hand.csv"
    path.write_text("\n".join(lines))
    (entry,) = document(path)["files"]
    assert entry["schema"] == "recording"
    assert entry["strokes"][0]["wave"]["mean"] == pytest.approx(49.979, abs=5e-3)


def test_a_closed_stroke_is_reported_without_waves(tmp_path):
    path = put(tmp_path, "ring", demonstration(circle()))
    (entry,) = document(path)["files"]
    assert entry["strokes"][0]["closed"]
    assert entry["strokes"][0]["wave"]["mean"] is None
    assert entry["strokes"][0]["length"] == pytest.approx(60 * np.pi, rel=1e-3)
    assert "closed" in dmpcli(path).stdout


def batch(folder, count):
    """A dataset folder as generalize writes it: two parts, and one pair that failed."""
    folder.mkdir()
    half = count // 2
    ids = [f"{i}" for i in range(count + 1)]
    for number, chosen in enumerate((ids[:half], ids[half:count])):
        paths = np.vstack([wave(NEW_START, NEW_GOAL, 20.0 + int(i)) for i in chosen])
        put(folder, f"part-{number:05d}", trajectory(paths, ids=chosen))
    columns = {"id": np.array(ids, dtype=object)}
    for suffix, point in (("0", NEW_START), ("g", NEW_GOAL)):
        columns |= {
            f"{n}{suffix}": np.full(count + 1, c) for n, c in zip("xyz", point, strict=True)
        }
    columns |= {n: np.full(count + 1, float(n == "nz")) for n in ("nx", "ny", "nz")}
    columns["duration"] = np.full(count + 1, 10.0)
    parts = ["part-00000.parquet"] * half + ["part-00001.parquet"] * (count - half) + [""]
    columns["part"] = np.array(parts, dtype=object)
    columns["status"] = np.array(["ok"] * count + ["too steep"], dtype=object)
    put(folder, "pairs", Record(schemas.PAIRS, columns, Provenance("generalize")))
    return folder


def test_a_small_batch_is_listed_by_id(tmp_path):
    (entry,) = document(batch(tmp_path / "few", 4))["files"]
    assert [row["stroke"] for row in entry["strokes"]] == [f"few[{i}]" for i in range(4)]
    means = [row["wave"]["mean"] for row in entry["strokes"]]
    assert means == pytest.approx([20, 21, 22, 23], abs=5e-3)
    assert entry["states"] == {"ok": 4, "too steep": 1}


@pytest.mark.slow
def test_a_large_batch_is_reported_by_statistics(tmp_path, files):
    folder = batch(tmp_path / "many", 24)
    entry = document(files["demo"], folder)["files"][1]
    assert entry["strokes"] == []
    assert entry["count"] == 24
    height = entry["statistics"]["wave_height"]
    assert [height[k] for k in ("least", "median", "largest")] == pytest.approx(
        [20, 31.5, 43], abs=5e-3
    )
    text = dmpcli(files["demo"], folder).stdout
    assert "many: 24 strokes" in text
    assert "24 drawn, 1 not; the first: too steep" in text


def test_a_given_plane_decides_what_across_means(tmp_path, files):
    plane = tmp_path / "plane.json"
    plane.write_text(
        json.dumps({"schema": "plane", "version": 1, "point": [0, 0, 0], "normal": [0, 1, 1]})
    )
    (entry,) = document(files["modified"], "--surface", plane)["files"]
    # Across a plane at 45° to the wave's own the wave looks 1/√2 as high.
    assert entry["strokes"][0]["wave"]["mean"] == pytest.approx(49.2 / np.sqrt(2), abs=0.2)


@pytest.fixture
def curved(tmp_path, files):
    flat = wave(CURVED_START, CURVED_GOAL, 45.0)
    original = curved_trajectory(flat, model="original", forcing_scale="distance")
    return {
        "demo": files["demo"],
        "along": put(tmp_path, "along", curved_trajectory(*fillet_wave(49.979))),
        "through": put(tmp_path, "through", original),
        "mesh": put_stl(tmp_path, "fillet", *fillet_mesh()),
    }


@pytest.mark.thorough
def test_on_a_mesh_modified_and_original_stand_side_by_side(tmp_path, curved):
    *strokes, mesh = curved.values()
    report = document(*strokes, "--surface", mesh)
    assert report["surface"]["file"] == "fillet.stl"
    taught, along, through = (entry["strokes"][0]["surface"] for entry in report["files"])
    assert taught is None
    assert along["wave_height"] == pytest.approx(49.979, abs=0.02)
    assert along["distance_max"] < 0.0065
    assert through["distance_max"] > 5.0
    text = dmpcli(*strokes, "--surface", mesh, "-q").stdout
    assert max(map(len, text.splitlines())) <= 80
    assert "On the surface (fillet.stl)" in text
    assert re.search(r"^along +49\.9[78]\d +0\.000 +0\.00", text, re.MULTILINE)
    out = tmp_path / "out"
    assert dmpcli(*strokes, "--surface", mesh, "-o", out, "-q").exit_code == 0
    assert (out / "surface.svg").exists()
    rows = list(csv.DictReader((out / "wave_heights.csv").read_text().splitlines()))
    assert [row["stroke"] for row in rows] == ["demo", "along", "through"]


@pytest.mark.slow
def test_a_surface_in_its_own_frame_and_unit_is_placed(tmp_path, curved):
    V, F = fillet_mesh()
    # Turned by 90° about z, moved, in metres: the pose says how to get back.
    local = np.column_stack([V[:, 1], -V[:, 0], V[:, 2]]) - [10.0, 20.0, 30.0]
    mesh = put_stl(tmp_path, "local", local / 1000.0, F)
    quarter = np.pi / 2
    pose = f"-20 10 30 0 0 {quarter}"
    options = ("--surface", mesh, "--surface-unit", "m", "--surface-pose", pose)
    (entry,) = document(curved["along"], *options)["files"]
    assert entry["strokes"][0]["surface"]["distance_max"] < 0.0066
    assert entry["strokes"][0]["surface"]["wave_height"] == pytest.approx(49.979, abs=0.02)


@pytest.mark.slow
def test_a_batch_on_a_surface_has_statistics_of_it(tmp_path):
    folder = batch(tmp_path / "many", 24)
    plane = tmp_path / "plane.json"
    z = NEW_START[2] - 1.0
    plane.write_text(
        json.dumps({"schema": "plane", "version": 1, "point": [0, 0, z], "normal": [0, 0, 1]})
    )
    (entry,) = document(folder, "--surface", plane)["files"]
    assert entry["statistics"]["surface_distance_max"]["median"] == pytest.approx(1.02, abs=0.01)
    assert "off the surface, mm" in dmpcli(folder, "--surface", plane).stdout


def test_a_surfaces_place_needs_a_surface(files):
    assert "--surface" in refused(files["modified"], "--surface-unit", "m")
    assert "--surface" in refused(files["modified"], "--surface-pose", "0 0 0 0 0 0")


def test_bad_input_is_one_clear_error(tmp_path, files):
    broken = tmp_path / "cut.parquet"
    broken.write_bytes(Path(files["demo"]).read_bytes()[:-100])
    assert "cut.parquet" in refused(files["demo"], broken)
    assert "no such file" in refused(tmp_path / "nothing.parquet")
    note = tmp_path / "note.json"
    note.write_text('{"schema": "recipe"}')
    assert "note.json" in refused(note)
    note.write_text("{")
    assert "not JSON" in refused(note)
    folder = tmp_path / "empty"
    folder.mkdir()
    assert "pairs.parquet" in refused(folder)
    assert "only once" in refused("-", "-")
    assert "is a file" in refused(files["demo"], "-o", broken)
    assert "4 samples" in refused(put(tmp_path, "short", trajectory(wave(n=4))))
    still = put(tmp_path, "still", demonstration(np.repeat(wave()[:1], 50, axis=0)))
    assert "still.parquet" in refused(still)


@pytest.mark.slow
def test_bad_input_touches_no_output(tmp_path, files):
    out = tmp_path / "out"
    assert dmpcli(files["demo"], "-o", out, "-q").exit_code == 0
    before = {path.name: path.stat().st_mtime_ns for path in out.iterdir()}
    refused(files["demo"], tmp_path / "nothing", "-o", out)
    assert {path.name: path.stat().st_mtime_ns for path in out.iterdir()} == before

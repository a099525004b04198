"""``dmpcli report`` over dataset folders through the real command line."""

import csv
import json
import shutil
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

from dmpcli import extras
from dmpcli.cli import app
from dmpcli.records import file_io, record, schemas
from dmpcli.reporting import figures
from tests.extras_here import needs
from tests.reporting.batches import put_batch
from tests.reporting.example_files import GOAL, START, demonstration, put, wave

T = 0.02 * np.arange(501)
FAILED = [
    "line 32, pair 31: no geodesic",
    "line 33, pair 32: no geodesic",
    "line 34, column 'x0': 'a, b' is not a finite number",
    "line 35, pair 34: start or goal lies 3.100 mm off the surface, more than --snap-tol 1",
    "line 36, pair 35: start or goal lies 7.250 mm off the surface, more than --snap-tol 1",
    "line 37, pair 36: start or goal lies 1.900 mm off the surface, more than --snap-tol 1",
]


def dmpcli(*words):
    return CliRunner().invoke(app, ["report", *map(str, words)])


def waves(heights, shift=0.0):
    step = np.array([0.0, 1.0, 0.0])
    return [
        {
            "t": T,
            "path": wave(START + (shift + i) * step, GOAL + (shift + i) * step, height),
            "normal": [0.0, 0.0, 1.0],
        }
        for i, height in enumerate(heights)
    ]


HEIGHTS = np.linspace(45.0, 52.0, 30)


@pytest.fixture
def demo(tmp_path):
    return put(tmp_path, "demo", demonstration())


@pytest.fixture
def folder(tmp_path):
    parts = [waves(HEIGHTS[:18]), waves(HEIGHTS[18:], 18.0)]
    return put_batch(tmp_path / "batch", parts, FAILED)


@pytest.fixture
def without_figures(monkeypatch):
    """They take most of a report's time, and other tests look at them."""
    monkeypatch.setattr(figures, "gallery", lambda shown: [])


def refused(*words):
    result = dmpcli(*words)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert len(result.stderr.strip().splitlines()) <= 2
    return result.stderr


def entry_of(*words):
    result = dmpcli(*words, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)["files"][-1]


def test_heights_are_distributed_and_the_worst_are_named(demo, folder):
    entry = entry_of(demo, folder)
    assert entry["count"] == 30
    assert entry["strokes"] == []
    height = entry["statistics"]["wave_height"]
    assert height["mean"] == pytest.approx(HEIGHTS.mean(), abs=5e-3)
    assert height["spread"] == pytest.approx(HEIGHTS.std(), abs=5e-3)
    assert height["quantiles"]["0.25"] == pytest.approx(np.quantile(HEIGHTS, 0.25), abs=5e-3)
    assert sum(entry["histograms"]["wave_height"]["counts"]) == 30
    # The lowest is farthest from the demonstration's 49.979 mm.
    assert [row["id"] for row in entry["worst"]["wave_height"]] == ["1", "2", "3", "4", "5"]
    worst = entry["worst"]["nearest_max"][0]
    assert (worst["id"], worst["part"]) == ("1", "part-00000.parquet")
    assert worst["value"] == pytest.approx(0.5 * (49.979 - 45.0), rel=0.1)
    # Ends are where they should be: none is the worst.
    assert entry["worst"]["goal_error"] == []


def test_without_a_demonstration_the_worst_height_is_farthest_from_the_median(tmp_path):
    heights = np.concatenate([np.full(29, 40.0), [43.0]])
    folder = put_batch(tmp_path / "one", [waves(heights)])
    assert entry_of(folder)["worst"]["wave_height"][0]["id"] == "30"


@pytest.mark.slow
def test_failures_are_counted_by_reason(demo, folder):
    entry = entry_of(demo, folder)
    assert [(row["count"], row["first"]) for row in entry["failures"]] == [
        (3, "34"),
        (2, "31"),
        (1, "33"),
    ]
    assert entry["failures"][0]["reason"] == (
        "start or goal lies off the surface, more than --snap-tol 1"
    )
    assert entry["states"]["ok"] == 30
    assert entry["states"]["no geodesic"] == 2
    text = dmpcli(demo, folder).stdout
    assert "30 drawn, 6 not" in text
    assert "no geodesic" in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.slow
def test_the_folder_holds_a_row_per_stroke_a_row_per_height_and_figures(
    tmp_path, demo, folder, monkeypatch
):
    out = tmp_path / "out"
    assert dmpcli(demo, folder, "-o", out, "-q").exit_code == 0
    written = {path.name: path.read_bytes() for path in out.iterdir()}
    assert {"batch_distribution.svg", "batch_worst.svg", "strokes.csv"} <= set(written)
    rows = list(csv.DictReader(written["strokes.csv"].decode().splitlines()))
    assert [row["id"] for row in rows] == [str(i + 1) for i in range(30)]
    assert [float(row["wave_height"]) for row in rows] == pytest.approx(list(HEIGHTS), abs=5e-3)
    assert rows[20]["part"] == "part-00001.parquet"
    assert rows[0]["surface_tilt_max"] == ""
    heights = list(csv.DictReader(written["wave_heights.csv"].decode().splitlines()))
    assert [row["stroke"] for row in heights] == ["demo"] + [f"batch[{i + 1}]" for i in range(30)]
    assert dmpcli(demo, folder, "-o", out, "-q").exit_code == 0
    assert {path.name: path.read_bytes() for path in out.iterdir()} == written
    # A report without a batch leaves none of its files behind, whatever it draws itself.
    monkeypatch.setattr(figures, "gallery", lambda shown: [])
    assert dmpcli(demo, "-o", out, "-q").exit_code == 0
    assert not [path.name for path in out.iterdir() if path.name.startswith(("batch", "strokes"))]


@pytest.mark.slow
def test_ids_are_cells_of_their_own(tmp_path, without_figures):
    folder = put_batch(tmp_path / "a, b", [waves(HEIGHTS)])
    out = tmp_path / "out"
    assert dmpcli(folder, "-o", out, "-q").exit_code == 0
    rows = list(csv.DictReader((out / "wave_heights.csv").read_text().splitlines()))
    assert rows[3]["stroke"] == "a, b[4]"
    assert float(rows[3]["height_mm"]) == pytest.approx(HEIGHTS[3], abs=5e-3)


@pytest.mark.slow
def test_on_a_plane_the_distance_to_it_is_part_of_the_report(tmp_path, demo, folder):
    plane = tmp_path / "plane.json"
    point = [0.0, 0.0, float(START[2]) - 3.0]
    plane.write_text(
        json.dumps({"schema": "plane", "version": 1, "point": point, "normal": [0, 0, 1]})
    )
    entry = entry_of(demo, folder, "--surface", plane)
    assert entry["statistics"]["surface_distance_max"]["median"] == pytest.approx(3.0, abs=0.05)
    assert "off the surface, mm" in dmpcli(demo, folder, "--surface", plane).stdout


def test_a_folder_without_table_or_manifest_is_told(demo, folder):
    (folder / "_manifest.json").unlink()
    result = dmpcli(demo, folder)
    assert result.exit_code == 0
    assert "_manifest.json is missing" in result.stderr
    (folder / "pairs.parquet").unlink()
    assert "pairs.parquet is missing" in refused(demo, folder)


def test_a_part_that_is_missing_or_damaged_is_named(tmp_path, demo, folder):
    part = folder / "part-00001.parquet"
    content = part.read_bytes()
    part.unlink()
    assert "part-00001.parquet: is missing" in refused(demo, folder)
    part.write_bytes(content[:-50])
    assert "part-00001.parquet" in refused(demo, folder)
    # As many bytes, but spoiled inside: found while it is read, and nothing is left behind.
    part.write_bytes(content[:300] + bytes(4000) + content[4300:])
    out = tmp_path / "deep" / "out"
    assert "part-00001.parquet" in refused(demo, folder, "-o", out)
    assert not (tmp_path / "deep").exists()


def test_a_part_of_another_batch_is_named(tmp_path, demo, folder):
    part = folder / "part-00001.parquet"
    shutil.copy(folder / "part-00000.parquet", part)
    assert "part-00001.parquet" in refused(demo, folder)
    # Even where nobody counted the bytes its pairs are not the table's.
    (folder / "_manifest.json").unlink()
    assert "holds pair '1' where pairs.parquet says '19'" in refused(demo, folder)
    found = record.decode(file_io.read(part), schemas.TRAJECTORY)
    found.provenance.options["rate"] = 99.0
    part.write_bytes(record.encode(found))
    assert "other inputs or options" in refused(demo, folder)


def test_a_part_that_the_manifest_does_not_list_is_named(demo, folder):
    shutil.copy(folder / "part-00000.parquet", folder / "part-00007.parquet")
    result = dmpcli(demo, folder)
    assert result.exit_code == 0
    assert "part-00007.parquet is not in _manifest.json" in result.stderr
    found = json.loads((folder / "_manifest.json").read_text())
    found["parts"] = found["parts"][:1]
    (folder / "_manifest.json").write_text(json.dumps(found))
    assert "part-00001.parquet: does not belong to _manifest.json" in refused(demo, folder)


def test_a_manifest_of_another_batch_is_named(demo, folder):
    found = json.loads((folder / "_manifest.json").read_text())
    found["options"] = {"rate": 99.0}
    (folder / "_manifest.json").write_text(json.dumps(found))
    assert "_manifest.json: was written for other inputs" in refused(demo, folder)


def test_a_part_that_lacks_a_pair_or_runs_backwards_is_named(tmp_path, demo):
    folder = put_batch(tmp_path / "short", [waves(HEIGHTS)])
    (folder / "_manifest.json").unlink()
    part = folder / "part-00000.parquet"
    found = record.decode(file_io.read(part), schemas.TRAJECTORY)
    few = {name: column[: 29 * 501] for name, column in found.columns.items()}
    part.write_bytes(record.encode(record.Record(found.schema, few, found.provenance)))
    assert "lacks pair '30'" in refused(demo, folder)
    found.columns["t"][501 + 7] = 0.0
    part.write_bytes(record.encode(found))
    assert "column 't', row 509: time does not increase" in refused(demo, folder)


TABLES = ("report.json", "strokes.csv", "wave_heights.csv")


def written(output, *words):
    result = dmpcli(*words, "-o", output, "-q")
    assert result.exit_code == 0
    return [result.stdout, *((output / name).read_bytes() for name in TABLES)]


@pytest.mark.slow
@pytest.mark.parametrize(
    "means", ["pure", pytest.param("compiled", marks=[needs(extras.FAST), pytest.mark.thorough])]
)
def test_any_number_of_processes_writes_the_same_bytes(
    tmp_path, demo, folder, means, without_figures
):
    one, two = (
        written(tmp_path / f"jobs-{jobs}", demo, folder, "--jobs", jobs, "--kernels", means)
        for jobs in (1, 2)
    )
    assert one == two


@needs(extras.FAST)
@pytest.mark.thorough
def test_kernels_print_what_numpy_prints_and_the_report_says_that_they_measured(
    tmp_path, demo, folder
):
    found = {
        means: written(tmp_path / means, demo, folder, "--kernels", means)
        for means in ("pure", "compiled", "auto")
    }
    assert found["auto"] == found["pure"]  # so few are not worth loading them
    documents = [json.loads(found[means][1])["files"][1] for means in ("pure", "compiled")]
    assert "kernels" not in documents[0]
    assert documents[1]["kernels"] == "compiled"
    assert [found["pure"][i] for i in (0, 2, 3)] == [found["compiled"][i] for i in (0, 2, 3)]


def test_kernels_that_are_asked_for_and_not_here_are_named(monkeypatch, demo, folder):
    monkeypatch.setitem(sys.modules, "numba", None)
    assert "pip install 'dmpcli[fast]'" in refused(demo, folder, "--kernels", "compiled")


def test_a_damaged_part_is_named_from_another_process_too(demo, folder):
    part = folder / "part-00001.parquet"
    whole = bytearray(part.read_bytes())
    whole[200:1200] = bytes(1000)
    part.write_bytes(whole)
    result = dmpcli(demo, folder, "--jobs", 2, "-q")
    assert result.exit_code == 2
    assert "part-00001.parquet" in result.stderr

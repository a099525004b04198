"""A table that names the surface of each pair, through the real command lines."""

import json
import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.records import file_io, record, skill
from dmpcli.records.record import Provenance
from tests.dmp.strokes import paper_stroke
from tests.records.meshes import grid

COLUMNS = "id,x0,y0,z0,xg,yg,zg,surface,surface_unit,pose,in,offset,duration"
POSE = "100 20 3 0 0 0.5"


def height(i, x, y):
    return 5.0 * np.sin((x + 10.0 * i) / 40.0) * np.cos(y / 50.0)


def dmpcli(*words, code=0):
    done = CliRunner().invoke(app, [*map(str, words)])
    assert done.exit_code == code, (done.exit_code, done.stderr)
    assert "Traceback" not in done.stderr
    return done


@pytest.fixture(scope="module")
def shop(tmp_path_factory):
    """A skill, four parts of one kind, a plane and a table of twelve pairs in two folders."""
    place = tmp_path_factory.mktemp("shop")
    result = fit([paper_stroke(turning=True)], FitOptions())
    one = skill.Reproduction(sha256="0", duration=10.0, rms=0, largest=0, end=0, smoothing=0)
    (place / "s.json").write_bytes(skill.encode(result.skill, [one], Provenance("fit")))
    (place / "job" / "parts").mkdir(parents=True)
    for i in range(4):
        V, F = grid(n=25, half=90.0, height=lambda x, y, i=i: height(i, x, y))
        unit = 1e-3 if i == 3 else 1.0
        trimesh.Trimesh(unit * V, F, process=False).export(place / "job" / f"parts/p{i}.stl")
    plane = {"point": [0.0, 0.0, 1.0], "normal": [0.0, 0.0, 1.0]}
    (place / "job" / "parts" / "plane.json").write_text(json.dumps(plane))
    pose = {"position": [100, 20, 3], "rotation": [0, 0, 0.5]}
    (place / "job" / "pose.json").write_text(json.dumps(pose))
    return place


def rows_of(count=12):
    """Rows as dicts: surfaces in turn, every other one placed, in the part's axes."""
    rng = np.random.default_rng(0)
    rows = []
    for k in range(count):
        i = k % 5
        x, y = rng.uniform(-50, -30), rng.uniform(-20, 20)
        ends = np.array([x, y, 0.0, x + 80.0, y + rng.uniform(-5, 5), 0.0])
        ends[2], ends[5] = (height(i, *ends[j : j + 2]) if i < 4 else 1.0 for j in (0, 3))
        rows.append(
            {
                "id": f"k{k}",
                "ends": ends.round(6),
                "surface": f"parts/p{i}.stl" if i < 4 else "parts/plane.json",
                "surface_unit": "m" if i == 3 else "",
                "pose": (POSE, "pose.json")[k % 4 == 1] if k % 2 else "",
                "in": "part" if k % 2 else "",
                "offset": "2" if k % 6 == 0 else "",
                "duration": "8" if k % 3 else "",
            }
        )
    return rows


def write(path, rows):
    lines = [
        ",".join([row["id"], *map(str, row["ends"]), *(row[c] for c in COLUMNS.split(",")[7:])])
        for row in rows
    ]
    path.write_text("\n".join([COLUMNS, *lines]) + "\n")
    return path


def draw(shop, folder, table, *options, code=0):
    words = ["generalize", shop / "s.json", "-o", folder, "--pairs", table, "--rate", 20]
    return dmpcli(*words, "--surfaces-per-part", 3, *options, code=code).stderr


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def drawn(shop):
    table = write(shop / "job" / "pairs.csv", rows_of())
    draw(shop, shop / "batch", table)
    return table, shop / "batch"


def strokes_of(folder):
    found = {}
    for path in sorted(folder.glob("part-*.parquet")):
        part = record.decode(file_io.read(path))
        ids = part.columns["id"]
        for name in dict.fromkeys(ids):
            rows = np.flatnonzero(ids == name)
            found[name] = {key: c[rows] for key, c in part.columns.items() if key != "id"}
    return found


@pytest.mark.slow
def test_each_stroke_is_the_one_that_is_drawn_alone(shop, drawn, tmp_path):
    strokes = strokes_of(drawn[1])
    for row in rows_of():
        ends = row["ends"].astype(str)
        words = ["--start", *ends[:3], "--goal", *ends[3:], "--rate", 20]
        words += ["--surface", shop / "job" / row["surface"]]
        for option, key in (("--surface-unit", "surface_unit"), ("--in", "in")):
            words += [option, row[key]] if row[key] else []
        if row["pose"]:
            at = row["pose"] if " " in row["pose"] else shop / "job" / row["pose"]
            words += ["--surface-pose", at]
        for option in ("offset", "duration"):
            words += [f"--{option}", row[option]] if row[option] else []
        dmpcli("generalize", shop / "s.json", "-o", tmp_path / "one.parquet", *words)
        alone = record.decode(file_io.read(tmp_path / "one.parquet"))
        for name in ("t", "x", "y", "z", "rx", "ry", "rz", "nx", "ny", "nz"):
            if name not in alone.columns:  # a plane's normal stands once, or for all
                assert row["surface"].endswith("plane.json")
                continue
            np.testing.assert_allclose(
                strokes[row["id"]][name], alone.columns[name], rtol=0, atol=1e-9, err_msg=row["id"]
            )


def test_the_table_says_what_each_pair_was_drawn_on(drawn):
    found = pq.read_table(drawn[1] / "pairs.parquet").to_pandas()
    assert found["id"].tolist() == [row["id"] for row in rows_of()]
    assert found["drawn_on"].tolist() == [row["surface"] for row in rows_of()]
    for name, sha256 in zip(found["drawn_on"], found["surface_sha256"], strict=True):
        assert file_io.read(drawn[0].parent / name).sha256 == sha256
    flat = found["drawn_on"] == "parts/plane.json"
    np.testing.assert_allclose(found["nz"][flat], 1.0)
    assert found["nz"][~flat].isna().all()
    assert str(drawn[0].parent) not in json.dumps(json.loads(content(drawn[1])["_manifest.json"]))


def test_a_part_holds_few_surfaces_and_its_pairs_in_the_order_of_the_table(drawn):
    found = pq.read_table(drawn[1] / "pairs.parquet").to_pandas()
    for name, rows in found.groupby("part"):
        assert rows["drawn_on"].nunique() <= 3
        ids = record.decode(file_io.read(drawn[1] / name)).columns["id"]
        assert list(dict.fromkeys(ids)) == rows["id"].tolist()


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("options", [("--jobs", 2), ("--surface-cache", "kept")])
def test_processes_shards_and_kept_meshes_change_no_byte(shop, drawn, tmp_path, options):
    options = [tmp_path / word if word == "kept" else word for word in options]
    draw(shop, tmp_path / "b", drawn[0], "--shard", "2/2", *options)
    draw(shop, tmp_path / "b", drawn[0], *options)
    assert content(tmp_path / "b") == content(drawn[1])
    shutil.rmtree(tmp_path / "b")
    draw(shop, tmp_path / "b", drawn[0], *options)
    assert content(tmp_path / "b") == content(drawn[1])


@pytest.mark.slow
def test_a_run_goes_on_but_not_from_parts_drawn_on_a_surface_that_has_changed(shop, tmp_path):
    job = shutil.copytree(shop / "job", tmp_path / "job")
    table = write(job / "pairs.csv", rows_of())
    draw(shop, tmp_path / "b", table)
    count = len(list((tmp_path / "b").glob("part-*")))
    assert f"{count} of {count} parts were there already" in draw(shop, tmp_path / "b", table)
    V, F = grid(n=25, half=90.0, height=lambda x, y: height(1, x, y) + 0.1)
    trimesh.Trimesh(V, F, process=False).export(job / "parts" / "p1.stl")
    told = draw(shop, tmp_path / "b", table)
    of = {row["id"] for row in rows_of() if row["surface"] == "parts/p1.stl"}
    parts = pq.read_table(tmp_path / "b" / "pairs.parquet").to_pandas()
    again = parts[parts["id"].isin(of)]["part"].nunique()
    assert f"{count - again} of {count} parts were there already" in told
    fresh = tmp_path / "fresh"
    draw(shop, fresh, table)
    assert content(fresh) == content(tmp_path / "b")


BAD = {
    "k1": ("surface", "parts/none.stl", "parts/none.stl: no such file"),
    "k2": ("surface", "", "name it in column 'surface'"),
    "k3": ("surface_unit", "foot", "column 'surface_unit'"),
    "k4": ("surface", "parts/empty.stl", "parts/empty.stl: holds no faces"),
    "k5": ("pose", "1 2 3", "a pose is six numbers"),
    "k6": ("pose", "0 0 30 0 0 0", "off the surface"),
    "k7": ("surface", "s.txt", "s.txt: "),
}


def bad_table(job):
    (job / "parts" / "empty.stl").write_text("solid nothing\nendsolid\n")
    (job / "s.txt").write_text("no surface at all")
    rows = rows_of()
    for row in rows:
        if row["id"] in BAD:
            row[BAD[row["id"]][0]] = BAD[row["id"]][1]
            row["offset"] = ""
    return write(job / "bad.csv", rows)


@pytest.mark.slow
def test_what_cannot_be_read_or_placed_fails_its_rows_by_name(shop, tmp_path):
    job = shutil.copytree(shop / "job", tmp_path / "job")
    told = draw(shop, tmp_path / "b", bad_table(job), "--on-error", "skip")
    found = pq.read_table(tmp_path / "b" / "pairs.parquet").to_pandas().set_index("id")["status"]
    for name, (_, _, what) in BAD.items():
        line = int(name[1:]) + 2
        assert found[name].startswith(f"line {line}, "), found[name]
        assert what in found[name], found[name]
        assert found[name] in told
    assert (found.drop(list(BAD)) == "ok").all()
    assert str(tmp_path) not in "".join(found)


@pytest.mark.slow
def test_stop_ends_with_the_first_bad_row_before_anything_is_drawn(shop, tmp_path):
    job = shutil.copytree(shop / "job", tmp_path / "job")
    told = draw(shop, tmp_path / "b", bad_table(job), code=2)
    assert "line 3, pair k1: parts/none.stl: no such file" in told
    assert not (tmp_path / "b").exists()
    rows = rows_of()
    rows[4]["surface"] = "parts/empty.stl"
    told = draw(shop, tmp_path / "b", write(job / "one.csv", rows), code=2)
    assert "line 6, pair k4: parts/empty.stl: holds no faces" in told
    assert "--on-error skip" in told
    assert not (tmp_path / "b" / "_manifest.json").exists()


@pytest.mark.slow
def test_the_command_line_fills_what_the_table_leaves_empty(shop, tmp_path):
    rows = [row for row in rows_of() if row["surface"] == "parts/p0.stl" and not row["pose"]]
    both = tmp_path / "both"
    for row in rows:
        row |= {"surface": "", "offset": ""}
    table = write(tmp_path / "pairs.csv", rows)
    draw(shop, both, table, "--surface", shop / "job" / "parts" / "p0.stl", "--offset", "1.5")
    for row in rows:
        row |= {"surface": str(shop / "job" / "parts" / "p0.stl"), "offset": "1.5"}
    draw(shop, tmp_path / "said", write(tmp_path / "said.csv", rows))
    a, b = strokes_of(both), strokes_of(tmp_path / "said")
    for row in rows:
        for name in ("x", "y", "z", "nz"):
            np.testing.assert_array_equal(a[row["id"]][name], b[row["id"]][name])


@pytest.mark.slow
def test_unknown_columns_are_told_once(shop, drawn, tmp_path):
    text = drawn[0].read_text().splitlines()
    (drawn[0].parent / "more.csv").write_text(
        "\n".join([f"{text[0]},colour", *(f"{line},red" for line in text[1:4])]) + "\n"
    )
    told = draw(shop, tmp_path / "b", drawn[0].parent / "more.csv")
    assert told.count("'colour': no such column is known") == 1


@pytest.mark.slow
def test_options_of_surfaces_say_something(shop, tmp_path):
    flat = tmp_path / "flat.csv"
    flat.write_text("x0,y0,z0,xg,yg,zg\n0,0,0,90,0,0\n")
    told = draw(shop, tmp_path / "b", flat, code=2)
    assert "--surfaces-per-part: the table names no surfaces" in told
    words = ["generalize", shop / "s.json", "-o", tmp_path / "b", "--pairs", flat]
    told = dmpcli(*words, "--surface-cache", tmp_path / "kept", code=2).stderr
    assert "--surface-cache: there is no surface to keep" in told
    part = ["--surface", shop / "job" / "parts" / "p0.stl", "--snap-tol", 20]
    dmpcli(*words, *part)
    plain = content(tmp_path / "b")
    for _ in range(2):
        dmpcli(*words, *part, "--surface-cache", tmp_path / "kept")
        assert content(tmp_path / "b") == plain
    assert len(list((tmp_path / "kept").iterdir())) == 1
    told = dmpcli(*words, *part, "--surface-cache", flat, code=2).stderr
    assert "flat.csv is no folder; name one, or leave it out" in told
    told = dmpcli(*words, *part, "--surface-cache", "s3://bucket/kept", code=2).stderr
    assert "--surface-cache: s3://bucket/kept is a store's; name a folder of this machine" in told
    dmpcli(*words, *part, "--surface-cache", f"file://{tmp_path}/named")
    assert len(list((tmp_path / "named").iterdir())) == 1


@pytest.mark.thorough
def test_report_holds_each_stroke_against_its_own_surface(shop, drawn, tmp_path):
    words = [drawn[1], "--pairs", drawn[0], "--json"]
    rows = json.loads(dmpcli("report", *words).stdout)["files"][0]["strokes"]
    assert len(rows) == 12
    assert all(row["surface"]["start_off"] < 1e-6 for row in rows)
    lifts = sorted(float(said["offset"] or 0.0) for said in rows_of())
    off = sorted(row["surface"]["distance_max"] for row in rows)
    np.testing.assert_allclose(off, lifts, atol=1e-3)
    # As many more are measured part by part, and alike.
    many = rows_of() + [dict(row, id=row["id"] + "b") for row in rows_of()]
    table = write(drawn[0].parent / "many.csv", many)
    draw(shop, tmp_path / "many", table)
    out = tmp_path / "r"
    entry = json.loads(
        dmpcli("report", tmp_path / "many", "--pairs", table, "--json", "-o", out).stdout
    )["files"][0]
    assert entry["count"] == 24
    worst = max(row["surface"]["tilt_max"] for row in rows)
    assert entry["statistics"]["surface_tilt_max"]["largest"] == pytest.approx(worst, abs=1e-9)
    told = dmpcli("report", tmp_path / "many", "--pairs", drawn[0], code=2).stderr
    assert "was drawn from another table" in told

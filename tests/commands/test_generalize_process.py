"""Tool and process at the command line: single strokes, batches, and what comes after them."""

import json

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from dmpcli import cli
from dmpcli.dmp import reference_paths
from dmpcli.records import file_io, record
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from tests.commands.test_generalize import run, write_skill
from tests.dmp.strokes import paper_stroke

PAIR = ["--start", -80, 5, 0, "--goal", 80, 5, 0]
FREE = ["--start", -80, -35, 0, "--goal", 80, -35, 0]
HOLE = 15.0


def holed_plate():
    """200 x 120 mm with a round hole of 15 mm radius in its middle."""
    a = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    d = np.stack([np.cos(a), np.sin(a)], axis=-1)
    with np.errstate(divide="ignore"):
        outer = d * np.minimum(100 / np.abs(d[:, 0]), 60 / np.abs(d[:, 1]))[:, None]
    r = np.linspace(0, 1, 13)[:, None, None]
    ring = (HOLE * d * (1 - r) + outer * r).reshape(-1, 2)
    i, j = (x.ravel() for x in np.meshgrid(np.arange(12), np.arange(96), indexing="ij"))
    k = (j + 1) % 96
    first = np.stack([i * 96 + j, (i + 1) * 96 + j, (i + 1) * 96 + k], axis=1)
    second = np.stack([i * 96 + j, (i + 1) * 96 + k, i * 96 + k], axis=1)
    V = np.column_stack([ring, np.zeros(len(ring))])
    return trimesh.Trimesh(V, np.concatenate([first, second]), process=False)


@pytest.fixture(scope="module")
def shop(tmp_path_factory):
    """A folder with a skill, surfaces, lines and pairs."""
    folder = tmp_path_factory.mktemp("shop")
    t = np.linspace(0, 8, 401)
    angles = np.tile([np.pi, 0.0, 0.0], (401, 1))
    x = reference_paths.sine(np.zeros(3), np.array([120.0, 0, 0]), 30.0, t, 8.0)
    write_skill(folder / "s.json", Trajectory(t, x, rotations.from_euler(angles)))
    write_skill(folder / "bare.json", Trajectory(t, x))
    write_skill(folder / "original.json", paper_stroke(), model="original")
    holed_plate().export(folder / "plate.ply")
    trimesh.creation.box((300, 300, 10)).apply_translation([0, 0, -5]).export(folder / "box.stl")
    shapes = {
        "plane": {"point": [0, 0, 0], "normal": [0, 0, 1]},
        "cylinder": {"point": [0, 0, -60], "axis": [1, 0, 0], "radius": 60},
        "sphere": {"centre": [0, 0, -200], "radius": 200},
    }
    for name, shape in shapes.items():
        (folder / f"{name}.json").write_text(json.dumps(shape))
    (folder / "keep.csv").write_text("x,y,z\n20,-60,0\n40,-60,0\n40,-10,0\n20,-10,0\n20,-60,0\n")
    rows = ["a,-80,-35,0,80,-35,0", "b,-80,5,0,80,5,0", "c,-80,40,0,80,40,0"]
    (folder / "pairs.csv").write_text("\n".join(["id,x0,y0,z0,xg,yg,zg", *rows]) + "\n")
    return folder


def strokes(path):
    found = record.decode(file_io.read(path))
    ids = found.columns["id"]
    order = list(dict.fromkeys(ids))
    return {str(n): (found.t[ids == n], found.position()[ids == n]) for n in order}, found


def executes(path):
    return CliRunner().invoke(cli.app, ["execute", str(path), "-o", "run.parquet", "--dry-run"])


@pytest.mark.slow
@pytest.mark.parametrize("surface", ["plane.json", "cylinder.json", "sphere.json", "plate.ply"])
def test_copies_lie_beside_the_first_at_their_spacing_along_the_surface(shop, tmp_path, surface):
    y = -35.0
    start, goal = np.array([-40.0, y, 0]), np.array([40.0, y, 0])
    if surface == "cylinder.json":
        start[2] = goal[2] = np.sqrt(3600 - y * y) - 60
    if surface == "sphere.json":
        start[2] = goal[2] = np.sqrt(200**2 - 40**2 - y * y) - 200
    out = tmp_path / "t.parquet"
    for spacing in (4.0, -4.0):
        done = run(
            shop / "s.json", "-o", out, "--start", *start, "--goal", *goal, "--surface",
            shop / surface, "--copies", 3, "--spacing", spacing,
        )  # fmt: skip
        assert done.exit_code == 0, done.stderr
        found, _ = strokes(out)
        assert list(found) == ["1_0", "1_1", "1_2"]
        first, last = found["1_0"][1], found["1_2"][1]
        gap = np.linalg.norm(last - first, axis=1)
        if surface == "cylinder.json":
            angle = [np.arctan2(x[:, 1], x[:, 2] + 60) for x in (first, last)]
            # The line runs along the axis towards +x: +v is to +y, and |angle| falls or grows.
            np.testing.assert_allclose(60 * (angle[1] - angle[0]), 2 * spacing, atol=1e-6)
            np.testing.assert_allclose(first[:, 0], last[:, 0], atol=1e-9)
        elif surface == "sphere.json":
            # At the start the cross line is a great circle.
            arc = 2 * 200 * np.arcsin(gap[[0, -1]] / 400)
            np.testing.assert_allclose(arc, 2 * abs(spacing), atol=1e-6)
        else:
            np.testing.assert_allclose(last - first, np.tile([0, 2 * spacing, 0], (401, 1)),
                                       atol=1e-6)  # fmt: skip


@pytest.mark.slow
def test_a_split_stroke_is_what_lies_beside_the_hole_and_execute_tours_it(shop, tmp_path):
    out = tmp_path / "t.parquet"
    options = ["--surface", shop / "plate.ply"]
    assert run(shop / "s.json", "-o", out, *PAIR, *options).exit_code == 3
    whole = tmp_path / "plane.parquet"
    run(shop / "s.json", "-o", whole, *PAIR, "--surface", shop / "plane.json")
    done = run(shop / "s.json", "-o", out, *PAIR, *options, "--on-border", "split")
    assert done.exit_code == 0, done.stderr
    found, _ = strokes(out)
    assert list(found) == ["1.1", "1.2"]
    path = strokes(whole)[0]["1"][1]
    for t, x in found.values():
        assert t[0] == 0.0
        assert np.hypot(x[:, 0], x[:, 1]).min() >= HOLE * np.cos(np.pi / 96) - 1e-6
        near = np.linalg.norm(x[:, None] - path, axis=2).min(axis=1)
        assert near.max() < 0.5  # half a sample beside those of the whole
        assert np.linalg.norm(np.diff(x, axis=0), axis=1)[[-1]] < 0.05
    # The first piece ends, and the second begins, within a sample of the hole.
    for x in (found["1.1"][1][-1], found["1.2"][1][0]):
        assert np.hypot(x[0], x[1]) < HOLE + 1.0
    done = executes(out)
    assert done.exit_code == 0, done.stderr
    shown = CliRunner().invoke(
        cli.app, ["report", str(out), "--surface", str(shop / "plate.ply"), "--json"]
    )
    assert shown.exit_code == 0, shown.stderr
    assert "1.2" in shown.stdout


def test_pieces_shorter_than_five_millimetres_are_left_out(shop, tmp_path):
    # From 4 mm beside the hole: the first piece would be shorter than that.
    start = ["--start", -18, 0, 0, "--goal", 80, 0, 0, "--surface", shop / "plate.ply"]
    out = tmp_path / "t.parquet"
    done = run(shop / "s.json", "-o", out, *start, "--on-border", "split")
    assert done.exit_code == 0, done.stderr
    assert list(strokes(out)[0]) == ["1.1"]
    assert "shorter than 5 mm" in done.stderr
    assert strokes(out)[0]["1.1"][1][:, 0].min() > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("surface", ["plane.json", "plate.ply", "box.stl"])
def test_a_region_is_kept_out_of_or_split_around(shop, tmp_path, surface):
    out = tmp_path / "t.parquet"
    options = [*FREE, "--surface", shop / surface, "--keep-out", shop / "keep.csv"]
    done = run(shop / "s.json", "-o", out, *options)
    assert done.exit_code == 3
    assert "--keep-out" in done.stderr
    assert not out.exists()
    done = run(shop / "s.json", "-o", out, *options, "--on-border", "split")
    assert done.exit_code == 0, done.stderr
    found, _ = strokes(out)
    assert list(found) == ["1.1", "1.2"]
    assert found["1.1"][1][:, 0].max() <= 20.0 <= found["1.1"][1][:, 0].max() + 1.0
    assert found["1.2"][1][:, 0].min() >= 40.0 >= found["1.2"][1][:, 0].min() - 1.0
    assert executes(out).exit_code == 0


def test_a_margin_refuses_what_comes_nearer_and_takes_what_does_not(shop, tmp_path):
    # The wave swings 15 mm to either side of y = -35: 10 mm off the edge, and 5 mm off the hole.
    options = [*FREE, "--surface", shop / "plate.ply", "--border-margin"]
    assert run(shop / "s.json", "-o", tmp_path / "t", *options, 4.9).exit_code == 0
    done = run(shop / "s.json", "-o", tmp_path / "u", *options, 10.2)
    assert done.exit_code == 3
    assert "--border-margin" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("surface", ["plane.json", "cylinder.json", "sphere.json", "box.stl"])
def test_the_tool_s_speed_is_held_and_the_path_is_the_same(shop, tmp_path, surface):
    y = [-20.0, -10.0]
    z = [0.0, 0.0]
    if surface == "cylinder.json":
        z = np.sqrt(3600 - np.square(y)) - 60
    if surface == "sphere.json":
        z = np.sqrt(200**2 - 40**2 - np.square(y)) - 200
    pair = ["--start", -40, y[0], z[0], "--goal", 40, y[1], z[1], "--surface", shop / surface]
    out = tmp_path / "t.parquet"
    done = run(shop / "s.json", "-o", out, *pair, "--tool-speed", 60)
    assert done.exit_code == 0, done.stderr
    _, x = strokes(out)[0]["1"]
    v = np.linalg.norm(np.diff(x, axis=0), axis=1) * 50.0
    np.testing.assert_allclose(v[15:-15], 60.0, rtol=3e-3)
    assert max(v[0], v[-1]) < 1.0
    plain = tmp_path / "plain.parquet"
    run(shop / "s.json", "-o", plain, *pair, "--rate", 500)
    dense = strokes(plain)[0]["1"][1]
    near = np.linalg.norm(x[:, None] - dense, axis=2).min(axis=1)
    assert near.max() < 0.4  # ripple of the skill below the smoothing
    np.testing.assert_allclose(x[[0, -1]], dense[[0, -1]], atol=1e-9)
    assert executes(out).exit_code == 0


@pytest.mark.slow
def test_a_speed_that_bends_and_ends_do_not_allow_is_told(shop, tmp_path):
    for speed, told in ((30, False), (400, True)):
        out = tmp_path / f"{speed}.parquet"
        done = run(shop / "s.json", "-o", out, *PAIR, "--tool-speed", speed, "-q")
        assert done.exit_code == 0, done.stderr
        assert ("goes 400 mm/s on 0 % of its path" in done.stderr) == told
        assert ("--tool-acceleration" in done.stderr) == told
        x = strokes(out)[0]["1"][1]
        fastest = 50.0 * np.linalg.norm(np.diff(x, axis=0), axis=1).max()
        assert f"{fastest:.1f} at most" in done.stderr or not told
    options = ["--pairs", shop / "pairs.csv", "--tool-speed", 400, "--on-error", "skip"]
    for _ in range(2):  # drawn, and kept from before
        done = run(shop / "s.json", "-o", tmp_path / "batch", *options)
        assert done.exit_code == 0, done.stderr
        assert "hold --tool-speed on less than half of their paths" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("surface", ["plane.json", "cylinder.json", "sphere.json", "plate.ply"])
def test_lead_and_tilt_are_those_against_the_normals_of_the_file(shop, tmp_path, surface):
    y = -38.0
    z = {"cylinder.json": np.sqrt(3600 - y * y) - 60,
         "sphere.json": np.sqrt(200**2 - 40**2 - y * y) - 200}.get(surface, 0.0)  # fmt: skip
    out = tmp_path / "t.parquet"
    done = run(
        shop / "s.json", "-o", out, "--start", -40, y, z, "--goal", 40, y, z,
        "--surface", shop / surface, "--lead", 20, "--tilt", 0, "--rate", 200,
    )  # fmt: skip
    assert done.exit_code == 0, done.stderr
    found = record.decode(file_io.read(out))
    x, axis = found.position(), -found.rotation()[:, :, 2]
    normal = np.tile(np.eye(3)[2], (len(x), 1))
    if surface == "cylinder.json":
        normal = (x + [0, 0, 60]) * [0, 1, 1] / 60
    if surface == "sphere.json":
        normal = (x + [0, 0, 200]) / 200
    inner = slice(300, -300)
    along = np.gradient(x, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    lead = np.degrees(np.arctan2(np.sum(axis * along, 1), np.sum(axis * normal, 1)))
    np.testing.assert_allclose(lead[inner], 20.0, atol=0.05)
    side = np.sum(axis * np.cross(normal, along), axis=1)
    assert np.degrees(np.abs(side[inner])).max() < 0.4  # ripple of the skill below the smoothing
    if found.has("nx"):
        np.testing.assert_allclose(found.stack(["nx", "ny", "nz"]), normal, atol=1e-6)


@pytest.mark.slow
def test_copies_over_the_edge_are_refused_skipped_split_or_clipped(shop, tmp_path):
    # The third copy swings over the edge of the plate, the fourth begins beyond it.
    options = [*FREE, "--surface", shop / "plate.ply", "--copies", 4, "--spacing", -10]
    wanted = {
        "fail": None,
        "clip": None,
        "skip": ["1_0", "1_1"],
        "split": ["1_0", "1_1", "1_2.1", "1_2.2", "1_3.1"],
    }
    for on_border, ids in wanted.items():
        out = tmp_path / on_border
        done = run(shop / "s.json", "-o", out, *options, "--on-border", on_border)
        assert done.exit_code == (3 if ids is None else 0), done.stderr
        assert ids is None or list(strokes(out)[0]) == ids


@pytest.mark.slow
def test_a_batch_does_all_of_it_at_once_with_the_same_bytes_for_any_number_of_jobs(shop, tmp_path):
    options = [
        "--pairs", shop / "pairs.csv", "--surface", shop / "plate.ply", "--on-border", "split",
        "--keep-out", shop / "keep.csv", "--border-margin", 3, "--copies", 2, "--spacing", 4,
        "--tool-speed", 50, "--lead", 10, "--tilt", -5, "--pairs-per-part", 2,
    ]  # fmt: skip
    for jobs in (1, 2):
        out = tmp_path / f"b{jobs}"
        done = run(shop / "s.json", "-o", out, *options, "--jobs", jobs)
        assert done.exit_code == 0, done.stderr
        assert "shorter than 5 mm" in done.stderr
    names = sorted(p.name for p in (tmp_path / "b1").iterdir())
    assert names == sorted(p.name for p in (tmp_path / "b2").iterdir())
    for name in names:
        assert (tmp_path / "b1" / name).read_bytes() == (tmp_path / "b2" / name).read_bytes()
    table = record.decode(file_io.read_table(tmp_path / "b1"))
    ids = [str(name) for name in table.columns["id"]]
    assert {"a_0.1", "a_0.2", "b_0.1", "b_0.2", "c_0"} <= set(ids)
    for row, name in enumerate(ids):
        part = strokes(tmp_path / "b1" / str(table.columns["part"][row]))[0]
        t, x = part[name]
        ends = [[table.columns[f"{c}{e}"][row] for c in "xyz"] for e in "0g"]
        np.testing.assert_allclose(ends, x[[0, -1]], atol=0.02)
        assert table.columns["duration"][row] == pytest.approx(t[-1])
    assert executes(tmp_path / "b1").exit_code == 0
    shown = CliRunner().invoke(
        cli.app,
        ["report", str(tmp_path / "b1"), "--surface", str(shop / "plate.ply"), "--json"],
    )
    assert shown.exit_code == 0, shown.stderr


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--lead", 10, "--orientation", "keep"], "--orientation keep"),
        (["--lead", 90], "lead"),
        (["--tool-speed", 10, "--duration", 3], "--duration"),
        (["--tool-speed", 10, "--ease-in", 1], "--ease-in"),
        (["--tool-acceleration", 10], "belongs to --tool-speed"),
        (["--copies", 2], "--spacing"),
        (["--spacing", 2], "--copies"),
        (["--copies", 2, "--spacing", 0], "--spacing 0"),
        (["--copies", 0, "--spacing", 1], "copies"),
        (["--border-margin", 2], "--border-margin"),
        (["--border-margin", 2, "--surface", "plane.json"], "no border"),
        (["--border-margin", 2, "--surface", "box.stl"], "no border"),
        (["--keep-out", "keep.csv"], "--surface"),
        (["--keep-out", "pairs.csv", "--surface", "plane.json"], "'x'"),
        (["--on-border", "split", "--surface", "plane.json"], "nothing to split"),
        (["--on-border", "split"], "nothing to split"),
        (["--on-border", "tear"], "fail, clip, skip or split"),
        (["--lead", 5, "--start-orientation", 3.1, 0, 0], "asks for tool orientations"),
    ],
)
def test_what_has_no_meaning_is_refused_by_name(shop, tmp_path, options, said):
    words = [shop / w if str(w).endswith((".json", ".stl", ".csv")) else w for w in options]
    done = run(shop / "s.json", "-o", tmp_path / "t", *PAIR, *words)
    assert done.exit_code == 2, done.stderr
    assert said in done.stderr.replace("\n", " ")
    assert "Traceback" not in done.stderr


def test_what_a_skill_cannot_give_is_refused(shop, tmp_path):
    done = run(shop / "bare.json", "-o", tmp_path / "t", *PAIR, "--tilt", 5)
    assert (done.exit_code, "without orientation" in done.stderr) == (2, True)
    pair = ["--start", -700, 130, -17, "--goal", -800, 130, -17]
    for extra in (["--lead", 5], ["--copies", 2, "--spacing", 3]):
        done = run(shop / "original.json", "-o", tmp_path / "t", *pair, *extra)
        assert (done.exit_code, "original DMP" in done.stderr) == (2, True)


def test_lines_that_are_none_on_the_surface_are_told_with_their_place(shop, tmp_path):
    far, short = tmp_path / "far.csv", tmp_path / "short.csv"
    far.write_text("id,x,y,z\nk,0,0,0\nk,10,0,0\nk,10,10,7\n")
    short.write_text("id,x,y,z\nk,0,0,0\nk,10,0,0\nm,10,10,0\n")
    for path, said in ((far, "point 3 lies 7.000 mm off"), (short, "'k' has 2 points")):
        options = ["--surface", shop / "plane.json", "--keep-out", path]
        done = run(shop / "s.json", "-o", tmp_path / "t", *PAIR, *options)
        assert done.exit_code == 2
        assert said in done.stderr.replace("\n", " ")


def test_ids_that_look_like_those_of_copies_are_refused(shop, tmp_path):
    (tmp_path / "p.csv").write_text(
        "id,x0,y0,z0,xg,yg,zg\na,0,0,0,100,0,0\na_1,0,9,0,100,9,0\na_1_0,0,5,0,9,9,0\n"
    )
    done = run(
        shop / "s.json", "-o", tmp_path / "b", "--pairs", tmp_path / "p.csv",
        "--copies", 2, "--spacing", 3,
    )  # fmt: skip
    assert done.exit_code == 0, done.stderr  # a_0 a_1 a_1_0 a_1_1 a_1_0_0 a_1_0_1 all differ

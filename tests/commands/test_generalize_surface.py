"""generalize onto meshes at the command line: the paper's curved pair, poses, borders, batches."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from dmpcli import cli
from dmpcli.records import file_io, record
from dmpcli.spatial import rotations
from tests.commands.test_generalize import run, write_skill
from tests.dmp.strokes import paper_stroke

ROOT = Path(__file__).parents[2]
BENCH = ROOT / "sample_runs" / "bench.stl"
START, GOAL = [-551.698, -37.580, -28.765], [-657.597, -43.254, -32.265]
CURVED = ["--start", *START, "--goal", *GOAL]
TOP, TANGENT, RADIUS = -17.54, 5.106, 86.774


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("skill")
    return write_skill(folder / "s.json", paper_stroke(turning=True), regression="ridge")


def read(path):
    return record.decode(file_io.read(path))


def off_the_bench(position):
    """Distance from the exact bench: flat top, then the fillet along x."""
    y, z = position[:, 1] - TANGENT, position[:, 2] - (TOP - RADIUS)
    fillet = np.hypot(y, z) - RADIUS
    return np.where(y < 0, fillet, position[:, 2] - TOP)


def test_the_papers_curved_pair_lies_on_the_fillet_with_its_normals(learned, tmp_path):
    done = run(
        learned, "-o", tmp_path / "t", *CURVED, "--surface", BENCH, "--orientation", "surface"
    )
    assert done.exit_code == 0, done.stderr
    assert "chordal error" in done.stderr
    found = read(tmp_path / "t")
    position, normal = found.position(), found.stack(["nx", "ny", "nz"])
    assert np.abs(off_the_bench(position)).max() < 0.0085
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-12)
    assert np.all(normal[:, 2] > 0)  # on the tool's side, which points down
    assert np.linalg.norm(position[-1] - GOAL) < 0.02
    R, taught = found.rotation(), paper_stroke(turning=True).rotation
    tilt = np.arccos(np.clip(-np.sum(R[:, :, 2] * normal, axis=1), -1, 1))
    demonstrated = np.arccos(np.clip(-taught[:, 2, 2], -1, 1))
    np.testing.assert_allclose(tilt, demonstrated, atol=0.01)
    assert np.abs(np.diff(found.stack(["rx", "ry", "rz"]), axis=0)).max() < 0.05


def test_keep_leaves_the_tool_as_demonstrated(learned, tmp_path):
    run(learned, "-o", tmp_path / "t", *CURVED, "--surface", BENCH)
    R = read(tmp_path / "t").rotation()
    assert np.abs(R - paper_stroke(turning=True).rotation).max() < 1e-3


def test_the_original_model_leaves_the_curved_surface(tmp_path):
    path = write_skill(tmp_path / "s.json", paper_stroke(), model="original")
    assert run(path, "-o", tmp_path / "t", *CURVED, "--surface", BENCH).exit_code == 0
    found = read(tmp_path / "t")
    assert np.abs(off_the_bench(found.position())).max() > 10.0
    assert not found.has("nx", "ny", "nz")


@pytest.mark.slow
def test_a_placed_part_and_pair_give_the_placed_stroke(learned, tmp_path):
    pose = [30.0, -20.0, 15.0, 0.1, -0.2, 0.6]
    R, shift = rotations.from_euler(np.array(pose[3:])), np.array(pose[:3])
    moved = ["--start", *(R @ START + shift), "--goal", *(R @ GOAL + shift)]
    run(learned, "-o", tmp_path / "here", *CURVED, "--surface", BENCH)
    done = run(
        learned, "-o", tmp_path / "there", *moved, "--surface", BENCH, "--surface-pose", *pose
    )
    assert done.exit_code == 0, done.stderr
    here, there = read(tmp_path / "here"), read(tmp_path / "there")
    np.testing.assert_allclose(there.position(), here.position() @ R.T + shift, atol=1e-6)
    (tmp_path / "pose.json").write_text(json.dumps({"position": pose[:3], "rotation": pose[3:]}))
    run(
        learned, "-o", tmp_path / "file", *moved, "--surface", BENCH,
        "--surface-pose", tmp_path / "pose.json",
    )  # fmt: skip
    np.testing.assert_array_equal(read(tmp_path / "file").position(), there.position())


@pytest.mark.slow
def test_a_mesh_in_metres_is_read_in_metres(learned, tmp_path):
    import trimesh

    small = trimesh.load(BENCH)
    small.apply_scale(1e-3)
    (tmp_path / "m.ply").write_bytes(small.export(file_type="ply"))
    surface = ["--surface", tmp_path / "m.ply"]
    assert run(learned, "-o", tmp_path / "t", *CURVED, *surface).exit_code == 2
    done = run(learned, "-o", tmp_path / "t", *CURVED, *surface, "--surface-unit", "m")
    assert done.exit_code == 0, done.stderr
    assert np.abs(off_the_bench(read(tmp_path / "t").position())).max() < 0.02


def test_solids_that_share_an_edge_are_drawn_on_but_not_across_it(tmp_path):
    import trimesh

    low = trimesh.creation.box((100.0, 80.0, 30.0))
    both = np.concatenate([low.triangles, low.triangles + [100.0, 0.0, 30.0]])
    path = tmp_path / "two.stl"
    path.write_bytes(trimesh.Trimesh(both.reshape(-1, 3), np.arange(72).reshape(-1, 3)).export(
        file_type="stl"
    ))  # fmt: skip
    learned = write_skill(tmp_path / "s.json", paper_stroke(), regression="ridge")
    surface = ["--surface", path]
    for start, goal in (
        ([-45.0, -10.0, 15.0], [30.0, 10.0, 15.0]),
        ([60.0, -10.0, 45.0], [140.0, 10.0, 45.0]),
    ):
        done = run(learned, "-o", tmp_path / "t", "--start", *start, "--goal", *goal, *surface)
        assert done.exit_code == 0, done.stderr
        assert "1 edge of three faces or more, the first at (50, 0, 15) mm" in done.stderr
        position = read(tmp_path / "t").position()
        assert np.abs(position[:, 2] - start[2]).max() < 1e-3
        assert np.linalg.norm(position[[0, -1]] - [start, goal], axis=1).max() < 0.01
    across = ["--start", 10.0, 0.0, 15.0, "--goal", 90.0, 0.0, 45.0]
    done = run(learned, "-o", tmp_path / "u", *across, *surface)
    assert done.exit_code == 3
    assert "parts of the mesh that are not joined" in done.stderr
    assert not (tmp_path / "u").exists()


@pytest.mark.slow
def test_a_stroke_over_the_border_is_refused_or_clipped(learned, tmp_path):
    edge = ["--start", -551.0, 180.0, -17.54, "--goal", -660.0, 180.0, -17.54]  # it ends at 185
    surface = ["--surface", BENCH]
    done = run(learned, "-o", tmp_path / "t", *edge, *surface)
    assert done.exit_code == 3, done.stderr
    assert "leaves the mesh or crosses a hole" in done.stderr
    assert "move start and goal inwards" in done.stderr
    assert not (tmp_path / "t").exists()
    done = run(learned, "-o", tmp_path / "t", *edge, *surface, "--on-border", "clip")
    assert done.exit_code == 0, done.stderr
    assert "clipped at the border" in done.stderr
    assert 2 <= len(read(tmp_path / "t")) < 501


@pytest.mark.slow
def test_with_on_border_skip_only_strokes_over_the_border_are_left_out(learned, tmp_path):
    flat = [-551.03, 131.399, -17.54, -660.021, 130.034, -17.54]
    edge = [-551.0, 180.0, -17.54, -660.0, 180.0, -17.54]  # the bench ends at 185
    table = tmp_path / "p.csv"

    def batch(*pairs):
        rows = [f"{i},{','.join(map(str, pair))}" for i, pair in enumerate(pairs)]
        table.write_text("\n".join(["id,x0,y0,z0,xg,yg,zg", *rows]))
        words = ["--pairs", table, "--surface", BENCH, "--on-border", "skip"]
        return run(learned, "-o", tmp_path / "b", *words)

    done = batch(flat, edge, START + GOAL)
    assert done.exit_code == 0, done.stderr
    assert "2 strokes drawn, 1 pair skipped" in done.stderr
    status = read(tmp_path / "b" / "pairs.parquet").columns["status"]
    assert [s == "ok" for s in status] == [True, False, True]
    assert "leaves the mesh" in status[1]
    assert set(read(tmp_path / "b" / "part-00000.parquet").columns["id"]) == {"0", "2"}
    # Any other hindrance still stops all of it.
    done = batch(flat, edge, [*START, -657.6, -43.3, 20.0])
    assert done.exit_code == 2
    assert "off the surface" in done.stderr
    # A pair on its own has nothing to be left out of.
    one = ["--start", *edge[:3], "--goal", *edge[3:], "--surface", BENCH, "--on-border", "skip"]
    done = run(learned, "-o", tmp_path / "t", *one)
    assert done.exit_code == 3
    assert not (tmp_path / "t").exists()


def test_a_point_off_the_mesh_is_refused_by_distance(learned, tmp_path):
    done = run(
        learned, "-o", tmp_path / "t", "--start", *START, "--goal", -657.6, -43.3, 20.0,
        "--surface", BENCH,
    )  # fmt: skip
    assert done.exit_code == 2
    assert "off the surface, more than --snap-tol 1" in done.stderr


@pytest.mark.slow
def test_many_pairs_on_a_mesh_equal_each_alone_and_bad_ones_are_named(learned, tmp_path):
    rows = ["id,x0,y0,z0,xg,yg,zg"]
    rows.append("curved," + ",".join(map(str, START + GOAL)))
    rows.append("flat,-551.03,131.399,-17.54,-660.021,130.034,-17.54")
    rows.append("edge,-551.0,180.0,-17.54,-660.0,180.0,-17.54")
    (tmp_path / "p.csv").write_text("\n".join(rows))
    batch = ["--pairs", tmp_path / "p.csv", "--surface", BENCH]
    done = run(learned, "-o", tmp_path / "b", *batch)
    assert done.exit_code == 3
    assert "line 4, pair edge" in done.stderr
    assert not (tmp_path / "b").exists()
    done = run(learned, "-o", tmp_path / "b", *batch, "--on-error", "skip")
    assert done.exit_code == 0, done.stderr
    assert "2 strokes drawn, 1 pair skipped" in done.stderr
    part = read(tmp_path / "b" / "part-00000.parquet")
    run(learned, "-o", tmp_path / "t", *CURVED, "--surface", BENCH)
    alone = read(tmp_path / "t")
    rows = part.columns["id"] == "curved"
    np.testing.assert_allclose(part.position()[rows], alone.position(), atol=1e-9)
    status = read(tmp_path / "b" / "pairs.parquet").columns["status"]
    assert list(status[:2]) == ["ok", "ok"]
    assert "leaves the mesh" in status[2]
    assert "move start and goal inwards" in status[2]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--surface-pose", 1, 2, 3], "--surface-pose and --surface-unit say where"),
        (["--surface", BENCH, "--surface-pose", 1, 2, 3], "a pose is six numbers"),
        (["--surface", BENCH, "--surface-unit", "ell"], "--surface-unit ell: must be one of mm"),
        (["--surface", BENCH, "--on-border", "jump"], "--on-border jump: must be"),
        (["--surface", ROOT / "README.md"], "README.md"),
    ],
)
def test_wrong_surface_options_are_refused(learned, tmp_path, options, message):
    done = run(learned, "-o", tmp_path / "t", *CURVED, *options)
    assert done.exit_code == 2
    assert message in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_report_measures_on_the_surface(learned, tmp_path):
    run(learned, "-o", tmp_path / "t", *CURVED, "--surface", BENCH, "--orientation", "surface")
    arguments = ["report", ROOT / "sample_runs/reference.parquet", tmp_path / "t", "--json"]
    done = CliRunner().invoke(cli.app, [*map(str, arguments), "--surface", str(BENCH)])
    assert done.exit_code == 0, done.stderr
    stroke = json.loads(done.stdout)["files"][1]["strokes"][0]
    assert stroke["wave"]["mean"] == pytest.approx(49.979, abs=0.02)

"""Cylinders and spheres at the command line: drawn on, in batches, measured, executed."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from dmpcli import cli
from dmpcli.spatial import rotations
from tests.commands.test_generalize import read, run, write_skill
from tests.dmp.strokes import paper_stroke

ROOT = Path(__file__).parents[2]
RADIUS = 60.0
AXIS = np.array([-550.0, 0.0, -100.0])
TUBE = {"point": AXIS.tolist(), "axis": [0, 2, 0], "radius": RADIUS}
BALL = {"centre": AXIS.tolist(), "radius": 150.0}


def on_tube(angle, y, radius=RADIUS):
    """A point at an angle from base +z."""
    return (AXIS + [radius * np.sin(angle), y, radius * np.cos(angle)]).tolist()


TOP = ["--start", *on_tube(0.5, -40.0), "--goal", *on_tube(-0.6, 30.0)]
LENGTH = np.hypot(1.1 * RADIUS, 70.0)
# The floor of the pipe: the tool points down.
FLOOR = ["--start", *on_tube(np.pi + 0.5, -40.0), "--goal", *on_tube(np.pi - 0.6, 30.0)]


def dmpcli(*words):
    return CliRunner().invoke(cli.app, [str(word) for word in words])


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("skill")
    return write_skill(folder / "s.json", paper_stroke(turning=True), regression="ridge")


@pytest.fixture
def tube(tmp_path):
    path = tmp_path / "cylinder.json"
    path.write_text(json.dumps(TUBE))
    return path


@pytest.fixture
def ball(tmp_path):
    path = tmp_path / "sphere.json"
    path.write_text(json.dumps({"schema": "sphere", "version": 1} | BALL))
    return path


def unrolled(position):
    """Arc and height on the tube, and distance off it."""
    off = position - AXIS
    arc = RADIUS * np.unwrap(np.arctan2(off[:, 0], off[:, 2]))
    return arc, off[:, 1], np.hypot(off[:, 0], off[:, 2]) - RADIUS


@pytest.mark.parametrize(("pair", "side"), [(TOP, 1.0), (FLOOR, -1.0)], ids=["outside", "pipe"])
def test_a_cylinder_is_unrolled_into_the_demonstrated_wave(learned, tube, tmp_path, pair, side):
    done = run(learned, "-o", tmp_path / "t", *pair, "--surface", tube, "--orientation", "surface")
    assert done.exit_code == 0, done.stderr
    found = read(tmp_path / "t")
    arc, y, off = unrolled(found.position())
    assert np.abs(off).max() < 0.005
    e_u = np.array([arc[-1] - arc[0], y[-1] - y[0]])
    assert np.linalg.norm(e_u) == pytest.approx(LENGTH, abs=0.02)
    v = (arc - arc[0]) * e_u[1] / LENGTH - (y - y[0]) * e_u[0] / LENGTH
    assert np.ptp(v) == pytest.approx(49.979, abs=0.02)
    normal, R = found.stack(["nx", "ny", "nz"]), found.rotation()
    radial = (found.position() - AXIS) * [1, 0, 1]
    np.testing.assert_allclose(
        normal, side * radial / np.linalg.norm(radial, axis=1, keepdims=True), atol=1e-6
    )
    tilt = np.arccos(np.clip(-np.sum(R[:, :, 2] * normal, axis=1), -1, 1))
    demonstrated = np.arccos(np.clip(-paper_stroke(turning=True).rotation[:, 2, 2], -1, 1))
    np.testing.assert_allclose(tilt, demonstrated, atol=0.01)
    assert found.provenance.inputs[1]["role"] == "surface"


def test_a_placed_cylinder_and_pair_give_the_placed_stroke(learned, tube, tmp_path):
    pose = [30.0, -20.0, 15.0, 0.1, -0.2, 0.6]
    R, shift = rotations.from_euler(np.array(pose[3:])), np.array(pose[:3])
    moved = [
        *("--start", *(R @ on_tube(0.5, -40.0) + shift)),
        *("--goal", *(R @ on_tube(-0.6, 30.0) + shift)),
    ]
    run(learned, "-o", tmp_path / "a", *TOP, "--surface", tube)
    done = run(learned, "-o", tmp_path / "b", *moved, "--surface", tube, "--surface-pose", *pose)
    assert done.exit_code == 0, done.stderr
    here, there = read(tmp_path / "a").position(), read(tmp_path / "b").position()
    np.testing.assert_allclose(there, here @ R.T + shift, atol=1e-6)
    assert read(tmp_path / "b").provenance.options["surface_pose"] == pose


def test_a_sphere_is_drawn_on_and_a_stroke_too_wide_for_it_refused(learned, ball, tmp_path):
    pair = ["--start", -500, 0, 41.42, "--goal", -600, 0, 41.42]
    done = run(learned, "-o", tmp_path / "t", *pair, "--surface", ball)
    assert done.exit_code == 0, done.stderr
    off = np.linalg.norm(read(tmp_path / "t").position() - AXIS, axis=1) - 150.0
    assert np.abs(off).max() < 0.005
    ball.write_text(json.dumps(BALL | {"radius": 15}))
    small = ["--start", -543, 0, -86.73, "--goal", -557, 0, -86.73]
    done = run(learned, "-o", tmp_path / "u", *small, "--surface", ball, "--on-border", "clip")
    assert done.exit_code == 3
    assert "the chart folds" in done.stderr
    assert not (tmp_path / "u").exists()


def test_batches_on_a_cylinder_equal_each_pair_alone_in_any_number_of_processes(
    learned, tube, tmp_path
):
    pairs = [on_tube(0.5, -40.0) + on_tube(-0.6, 30.0), on_tube(0.1, 50.0) + on_tube(0.9, -9.0)]
    rows = [f"{i},{','.join(map(str, pair))}" for i, pair in enumerate(pairs)]
    rows.append(f"far,{','.join(map(str, on_tube(0.1, 5.0, 70.0) + on_tube(0.9, -9.0)))}")
    (tmp_path / "p.csv").write_text("\n".join(["id,x0,y0,z0,xg,yg,zg", *rows]))
    batch = ["--pairs", tmp_path / "p.csv", "--surface", tube, "--on-error", "skip"]
    for jobs, folder in ((1, "a"), (2, "b")):
        words = ["-o", tmp_path / folder, *batch, "--jobs", jobs, "--pairs-per-part", 1]
        done = run(learned, *words)
        assert done.exit_code == 0, done.stderr
        assert "2 strokes drawn, 1 pair skipped" in done.stderr
    for part in ("part-00000.parquet", "part-00001.parquet"):
        one = (tmp_path / "a" / part).read_bytes()
        assert one == (tmp_path / "b" / part).read_bytes()
    status = read(tmp_path / "a" / "pairs.parquet").columns["status"]
    assert "10.000 mm off the surface" in status[2]
    run(learned, "-o", tmp_path / "t", *TOP, "--surface", tube)
    alone = read(tmp_path / "t").position()
    together = read(tmp_path / "a" / "part-00000.parquet").position()
    np.testing.assert_allclose(together, alone, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("pair", [TOP, FLOOR], ids=["outside", "pipe"])
def test_report_measures_and_pictures_strokes_on_a_cylinder(learned, tube, tmp_path, pair):
    run(learned, "-o", tmp_path / "t", *pair, "--surface", tube, "--orientation", "surface")
    done = dmpcli(
        "report", ROOT / "sample_runs/reference.parquet", tmp_path / "t", "--json",
        "--surface", tube, "-o", tmp_path / "r",
    )  # fmt: skip
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["surface"]["file"] == "cylinder.json"
    lies = document["files"][1]["strokes"][0]["surface"]
    assert lies["wave_height"] == pytest.approx(49.979, abs=0.02)
    assert lies["distance_max"] < 0.005
    assert lies["geodesic"] == pytest.approx(LENGTH, abs=1e-3)
    assert (tmp_path / "r" / "surface.svg").stat().st_size > 10_000


def test_a_stroke_on_a_cylinder_is_executed(learned, tube, tmp_path):
    run(learned, "-o", tmp_path / "t.parquet", *TOP, "--surface", tube)
    done = dmpcli(
        "execute", tmp_path / "t.parquet", "--robot", "mock:", "-o", tmp_path / "run.parquet"
    )
    assert done.exit_code == 0, done.stderr
    found = read(tmp_path / "run.parquet")
    drawn = found.columns["phase"] == "stroke"
    assert np.abs(unrolled(found.position()[drawn])[2]).max() < 1.0


def test_inspect_knows_surfaces_with_and_without_a_schema(tube, ball, tmp_path):
    for path, kind in ((tube, "cylinder"), (ball, "sphere")):
        found = json.loads(dmpcli("inspect", path, "--json").stdout)["found"]
        assert (found["ours"], found["schema"], found["version"]) == (True, kind, 1)
        assert found["content"]["radius"] > 0
        assert dmpcli("inspect", "--schema", kind).exit_code == 0
    ball.write_text('{"schema": "sphere", "centre": [0, 0, 0], "radius": -1}')
    wrong = dmpcli("inspect", ball)
    assert wrong.exit_code == 2
    assert "radius" in wrong.stderr
    # A file of others that happens to have such a key.
    ball.write_text('{"centre": "Bern"}')
    assert not json.loads(dmpcli("inspect", ball, "--json").stdout)["found"]["ours"]


def test_a_file_that_is_no_surface_is_refused_with_what_they_look_like(learned, tmp_path):
    (tmp_path / "s.json").write_text('{"radius": 5}')
    done = run(learned, "-o", tmp_path / "t", *TOP, "--surface", tmp_path / "s.json")
    assert done.exit_code == 2
    for kind in ("a plane is", "a cylinder", "a sphere"):
        assert kind in done.stderr

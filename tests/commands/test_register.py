"""register at the command line: where a part lies, how well that is known, and what is refused."""

import json
import re
from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.commands import register_checks
from dmpcli.errors import RefusedError
from dmpcli.records import file_io, pose, touched
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.registration import RegisteredPart, onto_surface
from tests.commands.running import invoke
from tests.records.meshes import box, obj, written
from tests.surfaces.registration_trial import touched_on, wedge

V, F = box((100.0, 60.0, 40.0))
SIX = [400.0, -120.0, 35.0, 0.2, -0.1, 1.3]
R, T = Rotation.from_euler("XYZ", SIX[3:]).as_matrix(), np.array(SIX[:3])
NEAR = ["402", "-118", "34", "0.22", "-0.12", "1.27"]


run = partial(invoke, "register")


def table(path, points, part=None):
    header = "x,y,z" + ("" if part is None else ",px,py,pz")
    rows = points if part is None else np.concatenate([points, part], axis=1)
    cells = [",".join("" if np.isnan(v) else repr(float(v)) for v in row) for row in rows]
    path.write_text("\n".join([header, *cells]) + "\n")
    return path


@pytest.fixture
def lab(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.stl").write_bytes(written(V, F, "stl"))
    rng = np.random.default_rng(1)
    faces = rng.integers(0, len(F), 60)
    on_part = np.einsum("ki,kij->kj", rng.dirichlet([2.0, 2.0, 2.0], 60), V[F[faces]])
    touched = on_part @ R.T + T + 0.02 * rng.standard_normal(on_part.shape)
    table(tmp_path / "touched.csv", touched)
    table(tmp_path / "corners.csv", V @ R.T + T, V)
    mixed = np.where(np.arange(60)[:, None] < 4, on_part, np.nan)
    table(tmp_path / "mixed.csv", touched, mixed)
    return tmp_path


def found(folder, name="pose.json"):
    return pose.decode(file_io.read(folder / name))


def assert_near(folder, atol):
    placed, _ = found(folder)
    np.testing.assert_allclose(placed.apply(V), V @ R.T + T, atol=atol)


def test_point_pairs_give_the_pose(lab):
    done = run("part.stl", "corners.csv", "-o", "pose.json")
    assert done.exit_code == 0, done.stderr
    assert done.stdout == ""
    assert_near(lab, 1e-9)
    file = found(lab)[1]
    assert file.residuals.points == 8
    assert file.residuals.largest < 1e-9
    assert file.conditioning.number < 3.0
    assert [entry["role"] for entry in file.inputs] == ["part", "touched"]
    assert file.inputs[0]["sha256"] == file_io.read(lab / "part.stl").sha256
    assert "condition number" in done.stderr
    assert "chordal error estimated at" in done.stderr
    assert "least certain" in done.stderr


@pytest.mark.slow
def test_many_points_and_a_rough_pose_in_words_or_in_a_file_give_the_pose(lab):
    done = run("part.stl", "touched.csv", "-o", "pose.json", "--initial", *NEAR, "-q")
    assert done.exit_code == 0, done.stderr
    assert done.stderr == ""
    assert_near(lab, 0.06)
    first = (lab / "pose.json").read_bytes()
    file = found(lab)[1]
    assert 0.01 < file.residuals.rms < 0.03
    assert file.options == {"unit": "mm", "initial": " ".join(NEAR)}
    run("part.stl", "touched.csv", "-o", "pose.json", "--initial", *NEAR)
    assert (lab / "pose.json").read_bytes() == first

    (lab / "rough.json").write_text(
        json.dumps({"position": [*map(float, NEAR[:3])], "rotation": [*map(float, NEAR[3:])]})
    )
    done = run("part.stl", "touched.csv", "--initial", "rough.json", "-o", "pose.json")
    assert done.exit_code == 0, done.stderr
    assert_near(lab, 0.06)
    assert [entry["role"] for entry in found(lab)[1].inputs] == ["part", "touched", "initial"]


def test_a_few_pairs_are_a_rough_pose_for_the_rest(lab):
    done = run("part.stl", "mixed.csv", "-o", "pose.json")
    assert done.exit_code == 0, done.stderr
    assert_near(lab, 0.06)
    assert found(lab)[1].residuals.points == 60


def test_the_parts_unit_holds_for_its_points_too(lab):
    (lab / "metres.obj").write_bytes(obj(V / 1000.0, F))
    table(lab / "metres.csv", V @ R.T + T, V / 1000.0)
    done = run("metres.obj", "metres.csv", "-o", "pose.json", "--unit", "m")
    assert done.exit_code == 0, done.stderr
    assert_near(lab, 1e-9)
    done = run("metres.obj", "metres.csv", "-o", "pose.json")
    assert done.exit_code == 2
    assert "check the part's unit of length" in done.stderr


def test_a_residual_above_the_limit_is_refused_by_row_and_nothing_is_written(lab):
    points = V @ R.T + T
    points[2] += [0.0, 0.0, 5.0]
    table(lab / "bad.csv", points, V)
    done = run("part.stl", "bad.csv", "-o", "pose.json")
    assert done.exit_code == 3
    assert done.stderr.splitlines()[-2].startswith("dmpcli: bad.csv: line 4: lies ")
    assert "more than --max-residual 1" in done.stderr
    assert not (lab / "pose.json").exists()
    assert run("part.stl", "bad.csv", "-o", "pose.json", "--max-residual", 9).exit_code == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["touched.csv", "--max-residual", "0"], "--max-residual 0: must be"),
        (["touched.csv", "--max-residual", "nan"], "--max-residual nan: must be"),
        (["touched.csv", "--initial", "1", "2"], "--initial 1 2: a pose is six numbers"),
        (["touched.csv", "--unit", "inch"], "unit inch: must be one of"),
        (["touched.csv", "--max-error", "-1"], "--max-error -1: must be"),
        (["touched.csv", "--guess", "far"], "--guess far: must be near or none"),
        (["touched.csv", "--guess", "none", "--initial", *NEAR], "leave --initial out"),
        (["corners.csv", "--guess", "none"], "leave --guess out"),
        (["still.csv", "--initial", *NEAR], "line 2: a direction has a length"),
        (["corners.csv", "--initial", *NEAR], "leave --initial out"),
        (["none.csv"], "none.csv: no such file"),
        (["few.csv"], "few.csv: 3 touched points; without matching points"),
        (["half.csv"], "half.csv: column 'pz' is missing"),
        (["text.csv"], "text.csv: column 'py', line 3: 'two' is not a finite number"),
        (["gap.csv"], "gap.csv: column 'y', line 2: an empty cell is not a finite number"),
        (["top.csv"], "top.csv: the touched points leave the part free: it slides along"),
    ],
)
def test_a_users_mistake_is_one_line_and_exit_code_2(lab, args, words):
    (lab / "few.csv").write_text("x,y,z\n1,2,3\n4,5,6\n7,8,10\n")
    (lab / "half.csv").write_text("x,y,z,px,py\n1,2,3,4,5\n")
    (lab / "text.csv").write_text("x,y,z,px,py,pz\n1,2,3,4,5,6\n1,2,3,4,two,6\n")
    (lab / "gap.csv").write_text("x,y,z\n1,,3\n")
    (lab / "still.csv").write_text("x,y,z,ax,ay,az\n1,2,3,0,0,0\n")
    rng = np.random.default_rng(2)
    table(lab / "top.csv", rng.uniform(-0.4, 0.4, (20, 3)) * [100, 60, 0] + [0, 0, 20])
    done = run("part.stl", *args, "-o", "pose.json")
    assert done.exit_code == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert not (lab / "pose.json").exists()


def test_what_was_mended_is_said(lab):
    (lab / "part.obj").write_bytes(obj(V, np.concatenate([F, F[:1]])))
    done = run("part.obj", "corners.csv", "-o", "pose.json")
    assert done.exit_code == 0
    assert "part.obj: 1 duplicate face left out" in done.stderr


def test_the_pose_goes_to_standard_output_as_data_alone(lab):
    done = run("part.stl", "corners.csv", "-o", "-")
    assert done.exit_code == 0
    assert json.loads(done.stdout)["schema"] == "pose"


@pytest.fixture
def wedge_lab(lab):
    """A part without symmetry, touched at 24 points."""
    rng = np.random.default_rng(5)
    corners, faces = wedge()
    (lab / "wedge.stl").write_bytes(written(corners, faces, "stl"))
    on_part = touched_on(corners, faces, 24, rng)
    table(lab / "on.csv", on_part @ R.T + T + 0.05 * rng.standard_normal(on_part.shape))
    return lab


def assert_wedge(folder):
    corners, _ = wedge()
    placed, file = found(folder)
    error = np.linalg.norm(placed.apply(corners) - (corners @ R.T + T), axis=1).max()
    assert error < 0.5
    assert error <= file.conditioning.uncertainty


@pytest.mark.slow
def test_without_a_guess_all_orientations_are_searched(wedge_lab):
    done = run("wedge.stl", "on.csv", "-o", "pose.json", "--guess", "none")
    assert done.exit_code == 0, done.stderr
    assert_wedge(wedge_lab)
    file = found(wedge_lab)[1]
    assert file.options["guess"] == "none"
    assert file.unit == "mm"
    assert file.runner_up.rms > 3.0 * file.residuals.rms
    assert file.runner_up.apart > 1.5
    assert "the runner-up, turned by" in done.stderr
    assert "at every point of the part (95 %)" in done.stderr


@pytest.mark.slow
def test_a_bad_start_is_told_as_a_bad_start_and_the_pose_found_all_the_same(wedge_lab):
    bad = [900, 300, -200, 2.2, 1.0, -1]
    done = run("wedge.stl", "on.csv", "-o", "pose.json", "--initial", *bad, "-q")
    assert done.exit_code == 0
    assert re.search(r"on\.csv: the start is bad, [0-9.]+ mm and [0-9.]+° from", done.stderr)
    assert_wedge(wedge_lab)


@pytest.mark.slow
def test_where_nothing_near_the_start_fits_it_is_refused_with_the_pose_to_paste(wedge_lab):
    points = touched.read(file_io.read(wedge_lab / "on.csv"))
    part = RegisteredPart.of(Mesh(*wedge()))
    start = Pose.of(np.array([446.0, -61.0, 18.0, 2.6, 1.3, -2.5]))
    alone = Pose(start.position[None], start.rotation[None])
    stuck = onto_surface(points.base, part, alone)
    with pytest.raises(RefusedError, match=r"on\.csv: the start is bad: --initial is ") as error:
        register_checks.refuse_unsure(stuck, points, part, start, 1.0, 1.5, True)
    pasted = str(error.value).split("give --initial ")[1].split(",")[0].split()
    done = run("wedge.stl", "on.csv", "-o", "pose.json", "--initial", *pasted)
    assert done.exit_code == 0, done.stderr
    assert "start is bad" not in done.stderr
    assert_wedge(wedge_lab)


@pytest.mark.thorough
def test_a_part_that_looks_the_same_turned_over_is_refused_from_a_bad_start(lab):
    over = Rotation.from_matrix(R @ np.diag([-1.0, 0.6, -0.6]) @ R.T @ R).as_euler("XYZ")
    done = run("part.stl", "touched.csv", "-o", "pose.json", "--initial", 480, -60, 0, *over)
    assert done.exit_code == 3
    assert "the part looks the same in both" in done.stderr


def test_a_residual_that_stands_out_is_told_by_row(lab):
    rows = np.loadtxt(lab / "touched.csv", delimiter=",", skiprows=1)
    top = int(np.argmax((rows - T) @ R[:, 2]))
    rows[top] += 0.7 * R[:, 2]
    table(lab / "odd.csv", rows)
    done = run("part.stl", "odd.csv", "-o", "pose.json", "--initial", *NEAR, "-q")
    assert done.exit_code == 0
    assert f"odd.csv: line {top + 2}: lies 0." in done.stderr
    assert "touch it again" in done.stderr


def test_touches_in_metres_are_refused_for_their_unit(wedge_lab):
    rows = np.loadtxt(wedge_lab / "on.csv", delimiter=",", skiprows=1) / 1000.0
    table(wedge_lab / "m.csv", rows)
    done = run("wedge.stl", "m.csv", "-o", "pose.json")
    assert done.exit_code == 2
    assert "check the part's unit of length (--unit), and that x y z are in mm" in done.stderr


@pytest.mark.slow
def test_a_part_that_looks_the_same_turned_over_needs_a_start(lab):
    done = run("part.stl", "touched.csv", "-o", "pose.json", "--guess", "none")
    assert done.exit_code == 3
    assert "another pose fits the 60 points nearly as well" in done.stderr
    assert "turned by 180.0°" in done.stderr
    assert "the part looks the same in both" in done.stderr
    assert "give a rough pose with --initial" in done.stderr


@pytest.mark.slow
def test_few_points_are_refused_for_their_rival_with_the_place_to_touch(lab):
    rng = np.random.default_rng(0)
    corners, faces = wedge()
    (lab / "wedge.stl").write_bytes(written(corners, faces, "stl"))
    few = touched_on(corners, faces, 9, rng) @ R.T + T + 0.1 * rng.standard_normal((9, 3))
    table(lab / "few9.csv", few)
    done = run("wedge.stl", "few9.csv", "-o", "pose.json", "--initial", *NEAR)
    assert done.exit_code == 3
    assert "another pose fits the 9 points nearly as well" in done.stderr
    assert "touch more points, one of them near" in done.stderr


@pytest.mark.slow
def test_an_error_above_the_limit_is_refused_and_of_pairs_told(wedge_lab):
    words = ["wedge.stl", "on.csv", "-o", "pose.json", "--initial", *NEAR]
    done = run(*words, "--max-error", 0.01)
    assert done.exit_code == 3
    assert "more than --max-error 0.01" in done.stderr
    points = V @ R.T + T + 0.1 * np.random.default_rng(4).standard_normal(V.shape)
    table(wedge_lab / "hand.csv", points, V)
    done = run("part.stl", "hand.csv", "-o", "pose.json", "--max-error", 0.01, "-q")
    assert done.exit_code == 0
    assert "more than --max-error 0.01" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("columns", [("ax", "ay", "az"), ("rx", "ry", "rz")])
def test_directions_that_come_out_of_the_part_are_not_used_and_that_is_told(wedge_lab, columns):
    corners, faces = wedge()
    rng = np.random.default_rng(5)
    faces_hit = rng.integers(0, len(faces), 40)
    a, b, c = np.moveaxis(corners[faces], 1, 0)
    normal = np.cross(b - a, c - a)
    normal = (normal / np.linalg.norm(normal, axis=1)[:, None])[faces_hit] @ R.T
    inner = rng.dirichlet([3.0, 3.0, 3.0], 40)
    points = np.einsum("ki,kij->kj", inner, corners[faces[faces_hit]]) @ R.T + T
    for sign, warned in ((-1.0, False), (1.0, True)):
        said = sign * normal
        if columns[0] == "rx":
            turns = [Rotation.align_vectors([n], [[0.0, 0.0, 1.0]])[0] for n in said]
            said = np.array([turn.as_euler("XYZ") for turn in turns])
        rows = [",".join(map(repr, map(float, row))) for row in np.hstack([points, said])]
        (wedge_lab / "dir.csv").write_text("\n".join([",".join(("x", "y", "z", *columns)), *rows]))
        done = run("wedge.stl", "dir.csv", "-o", "pose.json", "--initial", *NEAR)
        assert done.exit_code == 0, done.stderr
        assert ("point out of the part" in done.stderr) is warned
        assert_wedge(wedge_lab)

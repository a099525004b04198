"""Where things are, for a person: points off a surface, slips of unit, the part's own axes."""

import json
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.records import file_io, record
from tests.commands.running import invoke as run
from tests.commands.test_generalize import write_skill
from tests.dmp.strokes import paper_stroke
from tests.records.meshes import box, obj

V, F = box((200.0, 120.0, 40.0))
SIX = [400.0, -120.0, 35.0, 0.2, -0.1, 1.3]
R, T = Rotation.from_euler("XYZ", SIX[3:]).as_matrix(), np.array(SIX[:3])
TOP = np.array([[-50.0, 5.0, 20.0], [50.0, 0.0, 20.0]])
IN_BASE = TOP @ R.T + T
POSE = ["--surface-pose", *SIX]


def ends(points):
    return ["--start", *points[0], "--goal", *points[1]]


@pytest.fixture
def lab(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    flat = paper_stroke()
    write_skill(tmp_path / "skill.json", type(flat)(flat.t, flat.position))
    (tmp_path / "part.obj").write_bytes(obj(V, F))
    (tmp_path / "metres.obj").write_bytes(obj(V / 1000.0, F))
    return tmp_path


def drawn(*args):
    return run("generalize", "skill.json", "-o", "t.parquet", *args)


def position(folder, name="t.parquet"):
    return record.decode(file_io.read(folder / name)).position()


def test_an_end_off_the_part_is_named_with_the_nearest_point_ready_to_paste(lab):
    off = IN_BASE + np.outer([0.0, 7.0], R[:, 2])
    done = drawn(*ends(off), "--surface", "part.obj", *POSE)
    assert done.exit_code == 2
    assert "goal lies 7.000 mm off the surface, more than --snap-tol 1" in done.stderr
    assert "start lies" not in done.stderr
    pasted = re.search(r"nearest on it \(base\): (--goal( -?[0-9.]+){3})", done.stderr)[1].split()
    np.testing.assert_allclose([float(w) for w in pasted[1:]], IN_BASE[1], atol=1e-3)
    placed = V @ R.T + T
    for axis, low, high in zip("xyz", placed.min(axis=0), placed.max(axis=0), strict=True):
        assert f"{axis} {low:.1f} to {high:.1f}" in done.stderr
    again = drawn("--start", *IN_BASE[0], *pasted, "--surface", "part.obj", *POSE)
    assert again.exit_code == 0, again.stderr


def test_both_ends_off_the_part_are_told_both(lab):
    off = IN_BASE + np.outer([5.0, 7.0], R[:, 2])
    done = drawn(*ends(off), "--surface", "part.obj", *POSE)
    assert "start lies 5.000 and goal 7.000 mm off the surface" in done.stderr
    assert "--start" in done.stderr
    assert "--goal" in done.stderr


DEGREES = [*SIX[:3], *np.degrees(SIX[3:])]
METRES = [*(np.array(SIX[:3]) / 1000.0), *SIX[3:]]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("args", "hint"),
    [
        ([*ends(IN_BASE / 1000.0), *POSE], "times 1000 they lie on it: are they in m?"),
        ([*ends(TOP), *POSE], "give --in part?"),
        ([*ends(IN_BASE), *POSE, "--in", "part"], "leave --in part out?"),
        ([*ends(TOP / 1000.0), *POSE, "--in", "part"], "are they in m?"),
        ([*ends(IN_BASE), "--surface-pose", *DEGREES], "as degrees they lie on it: give rad (0.2"),
        ([*ends(IN_BASE), "--surface-pose", *METRES], "is it in m, not mm?"),
        (
            [*ends(IN_BASE), "--surface-pose", *METRES[:3], *DEGREES[3:]],
            "give mm and rad (400.000 -120.000 35.000 0.20000 -0.10000 1.30000)?",
        ),
    ],
)
def test_a_slip_of_unit_or_frame_is_hinted_at(lab, args, hint):
    done = drawn(*args, "--surface", "part.obj")
    assert done.exit_code == 2
    assert hint in done.stderr


def test_a_part_in_metres_is_hinted_at(lab):
    done = drawn(*ends(IN_BASE), "--surface", "metres.obj", *POSE)
    assert done.exit_code == 2
    assert "with the part in m they lie on it: give --surface-unit m, or" in done.stderr


def test_a_point_that_no_slip_explains_gets_no_hint(lab):
    done = drawn(*ends(IN_BASE + 33.0), "--surface", "part.obj", *POSE)
    assert "?" not in done.stderr.split("its box there")[1]


def test_angles_of_more_than_a_turn_are_doubted_aloud(lab):
    done = drawn(*ends(IN_BASE), "--surface", "part.obj", "--surface-pose", *DEGREES, "-q")
    assert "--surface-pose: 11.4592 -5.72958 74.4845 is more than a turn as rad" in done.stderr
    assert "if these are degrees, give 0.2 -0.1 1.3" in done.stderr


def test_a_pose_file_in_degrees_is_doubted_and_hinted_at(lab):
    (lab / "hand.json").write_text(json.dumps({"position": SIX[:3], "rotation": DEGREES[3:]}))
    words = [*ends(IN_BASE), "--surface", "part.obj", "--surface-pose", "hand.json"]
    done = drawn(*words)
    assert done.exit_code == 2
    assert "hand.json: 11.4592 -5.72958 74.4845 is more than a turn as rad" in done.stderr
    assert "as degrees they lie on it: give rad (0.2" in done.stderr


def test_ends_in_the_parts_axes_are_those_in_the_base(lab):
    assert drawn(*ends(IN_BASE), "--surface", "part.obj", *POSE).exit_code == 0
    base = position(lab)
    done = drawn(*ends(TOP), "--in", "part", "--surface", "part.obj", *POSE)
    assert done.exit_code == 0, done.stderr
    np.testing.assert_allclose(position(lab), base, atol=1e-6)


def test_pairs_in_the_parts_axes_are_drawn_and_kept_in_the_base(lab):
    cells = [",".join(map(repr, map(float, row.ravel()))) for row in (TOP, TOP + [0, 0, 9.0])]
    (lab / "pairs.csv").write_text("\n".join(["x0,y0,z0,xg,yg,zg", *cells]) + "\n")
    words = ["--pairs", "pairs.csv", "--on-error", "skip", "--in", "part"]
    done = run("generalize", "skill.json", "-o", "b", *words, "--surface", "part.obj", *POSE)
    assert done.exit_code == 0, done.stderr
    table = record.decode(file_io.read(lab / "b" / "pairs.parquet")).columns
    np.testing.assert_allclose([table[n][0] for n in ("x0", "y0", "z0")], IN_BASE[0], atol=1e-9)
    said = table["status"][1]
    assert "start lies 9.000 and goal 9.000 mm off the surface" in said
    assert ", in the part -50.000 5.000 20.000, 50.000 0.000 20.000" in said
    told = run("report", "b", "--json")
    reasons = [row["reason"] for row in json.loads(told.stdout)["files"][0]["failures"] or []]
    assert all("nearest" not in reason for reason in reasons)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        ([*ends(TOP), "--in", "part"], "--in part: the axes of which part?"),
        ([*ends(TOP), "--in", "tool", "--surface", "part.obj"], "--in tool: must be base or part"),
        (["--reproduce", "--in", "part", "--surface", "part.obj"], "leave --in out"),
    ],
)
def test_a_frame_that_says_nothing_is_refused(lab, args, words):
    done = drawn(*args)
    assert done.exit_code == 2
    assert words in done.stderr


@pytest.mark.slow
def test_report_says_where_the_surface_is_instead(lab):
    assert drawn(*ends(IN_BASE), "--surface", "part.obj", *POSE).exit_code == 0
    done = run("report", "t.parquet", "--surface", "part.obj", "--surface-pose", *METRES, "-q")
    assert done.exit_code == 0, done.stderr
    assert "mm off part.obj; nearest on it (base): " in done.stderr
    assert "is it in m, not mm?" in done.stderr


@pytest.fixture
def registered(lab):
    rng = np.random.default_rng(3)
    chosen = rng.integers(0, len(F), 40)
    points = np.einsum("ki,kij->kj", rng.dirichlet([2.0, 2.0, 2.0], 40), V[F[chosen]]) @ R.T + T
    rows = [",".join(map(repr, map(float, p))) for p in points]
    (lab / "touched.csv").write_text("\n".join(["x,y,z", *rows]) + "\n")
    words = ["-o", "pose.json", "--unit", "m", "--initial", 402, -118, 34, 0.22, -0.12, 1.27]
    done = run("register", "metres.obj", "touched.csv", *words)
    assert done.exit_code == 0, done.stderr
    return lab


@pytest.mark.slow
def test_the_pose_file_tells_the_parts_unit(registered):
    assert json.loads((registered / "pose.json").read_text())["unit"] == "m"
    words = [*ends(IN_BASE), "--surface", "metres.obj", "--surface-pose", "pose.json"]
    done = drawn(*words)
    assert done.exit_code == 0, done.stderr
    assert "another file" not in done.stderr
    assert drawn(*words, "--surface-unit", "m").exit_code == 0
    for done in (
        drawn(*words, "--surface-unit", "mm"),
        run("report", "t.parquet", *words[8:], "--surface-unit", "mm"),
    ):
        assert done.exit_code == 2
        assert "--surface-unit mm: pose.json was found with the part in m" in done.stderr


def test_a_pose_of_another_file_is_told(registered):
    (registered / "other.obj").write_bytes(obj(V / 1000.0, F[::-1]))
    done = drawn(*ends(IN_BASE), "--surface", "other.obj", "--surface-pose", "pose.json", "-q")
    assert done.exit_code == 0
    assert "pose.json: was found for another file than other.obj" in done.stderr

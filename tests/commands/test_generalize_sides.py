"""A stroke without orientation, taught on a wall, drawn on planes that face either way."""

import json

import numpy as np
import pytest

from dmpcli.records import file_io, record
from tests.commands.running import invoke as run
from tests.commands.test_generalize import write_skill
from tests.dmp.strokes import paper_stroke
from tests.minimum_jerk import minimum_jerk


@pytest.fixture(scope="module")
def skill(tmp_path_factory):
    """One wave on y = 0, first bulge to +z, between two lifts that tell no side: ±3 mm."""
    folder = tmp_path_factory.mktemp("wall")
    r = np.linspace(0.0, 1.0, 601)
    s = minimum_jerk(r)
    y = 3.0 * (np.exp(-(((s - 0.3) / 0.02) ** 2)) - np.exp(-(((s - 0.7) / 0.02) ** 2)))
    table = np.column_stack([6 * r, 300 * s, y, 40 * np.sin(2 * np.pi * s)])
    np.savetxt(folder / "wall.csv", table, delimiter=",", header="t,x,y,z", comments="")
    assert run("fit", folder / "wall.csv", "-o", folder / "skill.json", "-q").exit_code == 0
    return folder / "skill.json"


@pytest.mark.parametrize("y", [-1.0, 1.0])
def test_the_surface_decides_the_side_and_the_wave_is_not_mirrored(skill, tmp_path, y):
    known = json.loads(skill.read_text())
    assert known["side_guessed"]
    plane = tmp_path / "plane.json"
    plane.write_text(json.dumps({"point": [0, 0, 0], "normal": [0, y, 0]}))
    out = tmp_path / "drawn.parquet"
    ends = ("--start", 500, 0, 0, "--goal", 800, 0, 0)
    done = run(
        "generalize", skill, "-o", out, *ends, "--surface", plane, "--contact", 5, "--offset", 2
    )
    assert done.exit_code == 0, done.stderr
    drawn = record.decode(file_io.read(out))
    _, height, z = drawn.position().T
    assert z[np.argmax(np.abs(z[: len(z) // 2]))] > 39.0
    np.testing.assert_allclose(height, 2.0 * y, atol=1e-9)
    assert drawn.provenance.facts["end_heights"] == pytest.approx([2.0, 2.0])


@pytest.mark.parametrize(
    ("angle", "word"),
    [(0.3, None), (np.pi / 2, "warning"), (np.pi - 0.3, "away from")],
    ids=["above", "square", "below"],
)
def test_where_the_taught_side_is_not_decided_or_not_the_surfaces_own_it_is_told(
    tmp_path, angle, word
):
    """A tool that pointed down draws about a cylinder: outside, square to it, inside."""
    learned = write_skill(tmp_path / "s.json", paper_stroke(turning=True))
    tube = tmp_path / "cylinder.json"
    tube.write_text(json.dumps({"point": [0, 0, 0], "axis": [0, 1, 0], "radius": 80.0}))
    foot = 80.0 * np.array([np.sin(angle), 0.0, np.cos(angle)])
    start, goal = foot - [0.0, 50.0, 0.0], foot + [0.0, 50.0, 0.0]
    ends = ("--start", *start, "--goal", *goal)
    out = tmp_path / "drawn.parquet"
    done = run("generalize", learned, "-o", out, *ends, "--surface", tube)
    assert done.exit_code == 0, done.stderr
    assert ("mirrored" in done.stderr) == (word == "warning")
    assert ("normals point away from" in done.stderr) == (word == "away from")
    assert ("--start-orientation RX RY RZ" in done.stderr) == (word is not None)
    if word != "warning":
        drawn = record.decode(file_io.read(out))
        assert drawn.columns["nz"][0] > 0.9  # to where the tool came from

"""A place that is proposed for a skill is one at which generalize draws it."""

import json
import re
import shlex

import numpy as np
import pytest

from tests.commands.running import ended, invoke
from tests.records.meshes import box, written

WAVE = 12.0


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A skill of 90 by 24 mm, and a block with one face that is large enough for it."""
    monkeypatch.chdir(tmp_path)
    t = np.linspace(0.0, 6.0, 301)
    u = (t / 6.0) ** 3 * (10.0 - 15.0 * t / 6.0 + 6.0 * (t / 6.0) ** 2)
    wave = np.column_stack([t, 90.0 * u, WAVE * np.sin(2.0 * np.pi * u), 0.0 * u])
    rows = "\n".join(",".join(f"{value:.6f}" for value in row) for row in wave)
    (tmp_path / "mine.csv").write_text(f"t,x,y,z\n{rows}\n")
    ended("fit", "mine.csv", "-o", "skill.json")
    V, F = box((120.0, 40.0, 15.0))
    (tmp_path / "part.stl").write_bytes(written(V - V.min(axis=0), F, "stl"))
    return tmp_path


def proposed(part="part.stl"):
    said = json.loads(ended("inspect", part, "--for", "skill.json", "--json").stdout)["found"]
    found = [
        re.match(r"room for skill.json: (--start .+ --goal .+?)  ", one) for one in said["told"]
    ]
    return said["told"], [one[1].split() for one in found if one]


@pytest.mark.slow
def test_what_is_proposed_is_drawn(folder):
    _, ways = proposed()
    assert ways
    for words in ways:
        ended("generalize", "skill.json", "-o", "a.parquet", "--surface", "part.stl", *words)
    start, goal = np.array(ways[0][1:4], float), np.array(ways[0][5:8], float)
    assert start[2] == goal[2] == pytest.approx(15.0)
    assert np.linalg.norm(goal - start) == pytest.approx(90.0, abs=0.2)


@pytest.mark.slow
def test_where_no_patch_is_wide_enough_it_says_how_much_is_needed(folder):
    V, F = box((120.0, 20.0, 15.0))
    (folder / "narrow.stl").write_bytes(written(V - V.min(axis=0), F, "stl"))
    told, ways = proposed("narrow.stl")
    # At a half of its size there is.
    assert told[0].startswith("room for skill.json: --start")
    assert "--amplitude scale" in told[0]
    for words in ways:
        ended("generalize", "skill.json", "-o", "a.parquet", "--surface", "narrow.stl", *words)
    start, goal = np.array(ways[0][1:4], float), np.array(ways[0][5:8], float)
    assert np.linalg.norm(goal - start) < 65.0
    V, F = box((8.0, 6.0, 5.0))
    (folder / "tiny.stl").write_bytes(written(V - V.min(axis=0), F, "stl"))
    told, ways = proposed("tiny.stl")
    assert ways == []
    assert "90 mm along, 24 mm across), nor for a quarter of its size" in told[0]


@pytest.mark.slow
def test_the_line_that_is_told_last_can_be_typed_as_it_stands(folder):
    said = ended("inspect", "part.stl", "--for", "skill.json").stdout
    line = re.search(r"^  (dmpcli generalize (?:.*\\\n)*.*)$", said, re.M)[1]
    assert max(map(len, line.split("\n"))) <= 80
    words = shlex.split(line.replace("\\\n", ""))
    assert words[:5] == ["dmpcli", "generalize", "skill.json", "-o", "stroke.parquet"]
    ended(*words[1:])
    ended("execute", "stroke.parquet", "--dry-run", "--workspace", "-1e3", "1e3", "-1e3", "1e3",
          "-1e3", "1e3")  # fmt: skip


@pytest.mark.slow
def test_on_a_wall_the_tool_is_turned_with_it(folder):
    """Taught straight down, and drawn on a face of a thin plate that stands."""
    wave = np.loadtxt(folder / "mine.csv", delimiter=",", skiprows=1)
    rows = "\n".join(",".join(f"{value:.6f}" for value in [*row, np.pi, 0, 0]) for row in wave)
    (folder / "mine.csv").write_text(f"t,x,y,z,rx,ry,rz\n{rows}\n")
    ended("fit", "mine.csv", "-o", "skill.json", "--rotation", "euler")
    V, F = box((6.0, 120.0, 60.0))
    (folder / "wall.stl").write_bytes(written(V - V.min(axis=0), F, "stl"))
    _, ways = proposed("wall.stl")
    assert {"--orientation", "--start-orientation"} <= set(ways[0])
    done = ended("generalize", "skill.json", "-o", "a.parquet", "--surface", "wall.stl", *ways[0])
    assert "square" not in done.stderr
    said = json.loads(ended("report", "a.parquet", "--surface", "wall.stl", "--json").stdout)
    assert said["files"][0]["strokes"][0]["surface"]["tilt_max"] < 30.0


def test_a_skill_is_drawn_on_meshes_only(folder):
    done = invoke("inspect", "mine.csv", "--for", "skill.json")
    assert done.exit_code == 2
    assert "is no mesh" in done.stderr

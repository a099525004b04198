"""The recipes for those who extend it work as they are printed."""

import re
import tomllib
from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path

import numpy as np
import pytest

import dmpcli
from dmpcli.control import workcell
from dmpcli.errors import InputError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.records import layouts
from dmpcli.surfaces.surface import Surface
from tests.instruments.instrument_conformance import check_sensor

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "CONTRIBUTING.md").read_text()


def recipe(title, language="python"):
    section = PAGE.split(f"\n## {title}\n")[1].split("\n## ")[0]
    return re.search(rf"```{language}\n(.*?)```", section, re.S)[1]


def made(title):
    names = {"__name__": "recipe"}
    exec(recipe(title), names)
    return names


def test_the_sensor_does_what_every_sensor_must(tmp_path, monkeypatch):
    (tmp_path / "steady.py").write_text(recipe("Add a sensor"))
    monkeypatch.syspath_prepend(tmp_path)
    points = tomllib.loads(recipe("Add a sensor", "toml"))["project"]["entry-points"]
    installed = EntryPoints(
        EntryPoint(name, value, group)
        for group, entries in points.items()
        for name, value in entries.items()
    )
    monkeypatch.setattr(metadata, "entry_points", lambda **only: installed.select(**only))
    clock = SimulatedClock()
    bench = workcell.connect("mock:", "steady://here?force=-3", clock, allow_mixed=True)
    check_sensor(bench.sensor, clock, lambda s: clock.sleep_until(clock.now() + s))
    with pytest.raises(InputError, match="weight"):
        workcell.connect("mock:", "steady://here?weight=3", clock, allow_mixed=True)


def test_the_surface_has_charts_whose_strokes_lie_on_it():
    bowl = made("Add a surface")["Bowl"](np.array([0.0, 0.0, 150.0]), 150.0)
    ends = np.array([[[-40.0, 5.0, 0.0]], [[45.0, -20.0, 0.0]]])
    start, goal = bowl.closest(ends[0]).position, bowl.closest(ends[1]).position
    charts = bowl.charts(start, goal)
    u = np.linspace(0.0, charts.goals[0, 0], 40)
    w = np.full(40, 2.0)
    image = charts.lift(np.stack([u, 10.0 * np.sin(u / 10.0), w], axis=-1)[None])
    middle = image.position[0] - bowl.centre
    np.testing.assert_allclose(np.linalg.norm(middle, axis=1), 148.0, atol=1e-9)
    flat = charts.lift(np.stack([u, 0 * u, 0 * u], axis=-1)[None]).position[0]
    np.testing.assert_allclose(flat[[0, -1]], [start[0], goal[0]], atol=1e-9)
    surface: Surface = bowl
    assert np.all(surface.closest(start).normal[:, 2] > 0.0)


def test_the_measure_is_that_of_a_line():
    mean_speed = made("Add a measure")["mean_speed"]
    t = np.linspace(0.0, 4.0, 50)
    assert mean_speed(t, np.outer(t, [3.0, 0.0, 4.0])) == pytest.approx(5.0)


def test_the_layout_reads_its_recordings(tmp_path, monkeypatch):
    monkeypatch.setattr(layouts, "LAYOUTS", dict(layouts.LAYOUTS))
    exec(recipe("Add a file format"), {})
    t = np.linspace(0.0, 4.0, 201)
    rows = np.column_stack([1000.0 * t, 2.5 * t, np.sin(t), 0.0 * t])
    text = "\n".join(",".join(f"{value:.9f}" for value in row) for row in rows)
    (tmp_path / "pen.csv").write_text("Clock,PenX,PenY,PenZ\n" + text + "\n")
    demo = dmpcli.read(tmp_path / "pen.csv", layout="plotter")
    np.testing.assert_allclose(demo.position[-1], [100.0, 10.0 * np.sin(4.0), 0.0], atol=1e-6)
    np.testing.assert_allclose(demo.t, t, atol=1e-9)


def test_the_hooks_are_the_checks_of_make_lint_and_make_test_and_ci_run_them():
    entries = re.findall(r"entry: \.venv/bin/(.+)", (ROOT / ".pre-commit-config.yaml").read_text())
    makefile = (ROOT / "Makefile").read_text()

    def rule(target):
        return makefile.split(f"\n{target}:")[1].split("\n\n")[0]

    parts = rule("lint").split()
    assert parts == ["rules", "types"]
    recipes = [line for part in parts for line in rule(part).splitlines()[1:]]
    lint = [line.strip().removeprefix("$(BIN)/") for line in recipes]
    assert entries == [re.sub(r" --cache-dir.*", "", line) for line in lint]
    # Rules are looked at by make test, and types beside it.
    assert " rules > " in rule("test")
    assert 'types "PYTHON=$default"' in (ROOT / ".ci" / "run").read_text()


def test_every_file_that_the_page_names_is_there():
    named = set(re.findall(r"`((?:dmpcli|tests|docs|tools)/[\w/.]+\.\w+)`", PAGE))
    assert len(named) >= 12
    assert {name for name in named if not (ROOT / name).exists()} == set()

"""Every example in README and docs runs, as it is printed.

All pages share one run of the pipeline: a folder with what a reader has by then. Instruments of
one's own are an EC66 and a Net F/T in simulated time, behind the real drivers.
"""

import json
import os
import re
import shlex
import shutil
from contextlib import ExitStack
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from dmpcli.commands.examples import ROBOT, SENSOR
from tests.commands.running import ended, invoke
from tests.commands.test_examples import cell, lay_out
from tests.commands.virtual_lab import FREE_PORTS, Lab
from tests.docs.pages import ELSEWHERE, PAGES, ROOT, blocks, lines, name_of
from tests.faults import world
from tests.object_store import BUCKET, empty, served
from tests.records.meshes import box, written

RUN = [page for page in PAGES if blocks(page, "sh")]


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """What a reader of any page has by then; one run of the pipeline."""
    folder = tmp_path_factory.mktemp("pages")
    lay_out(folder)
    V, F = box((120.0, 80.0, 20.0))
    V = V - V.min(axis=0)
    (folder / "part.stl").write_bytes(written(V, F, "stl"))
    shutil.copy(ROOT / "sample_runs" / "pen.json", folder / "pen.json")
    (folder / "sample_runs").symlink_to(ROOT / "sample_runs")
    plane = {"point": [0, 0, -17.54], "normal": [0, 0, 1]}
    (folder / "plane.json").write_text(json.dumps(plane))
    t = np.linspace(0.0, 12.0, 601)
    u = t / 12.0
    u = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    wave = np.column_stack([t, 400.0 + 90.0 * u, 12.0 * np.sin(2 * np.pi * u), 20.0 + 0.0 * u])
    rows = "\n".join(",".join(f"{value:.6f}" for value in row) for row in wave)
    for name in ("demo.csv", "mine.csv"):
        (folder / name).write_text(f"t,x,y,z\n{rows}\n")
    wave[:, 1:] /= 1000.0
    rows = "\n".join(",".join(f"{value:.7f}" for value in [*row, 3.14159265, 0, 0]) for row in wave)
    names = ",".join(["timestamp", *(f"actual_TCP_pose_{k}" for k in range(6))])
    for name in ("a.csv", "b.csv"):
        (folder / name).write_text(f"{names}\n{rows}\n")
    here = Path.cwd()
    os.chdir(folder)
    try:
        ended("record", "-o", "demo.parquet", "--seed", "1")
        ended("fit", "demo.parquet", "-o", "skill.json")
        ease = ["--ease-in", "0.5", "--ease-out", "0.5"]
        pair = ["--start", -701.7, 132.4, -17.5, "--goal", -807.6, 129.7, -17.5]
        for name in ("traj.parquet", "trajectory.parquet"):
            ended("generalize", "skill.json", "-o", name, *pair, *ease)
        ended("generalize", "skill.json", "-o", "batch", "--pairs", "pairs.csv", *ease)
        ended("execute", "traj.parquet", "-o", "run.parquet")
        ended("export", "trajectory.parquet", "-o", "bag", "--format", "ros2")
    finally:
        os.chdir(here)
    return folder


def run(line, variables):
    """Run one line in this process, as a shell does that knows pipes, `>` and variables."""
    for part in shlex.split(line):
        if not re.fullmatch(r"[A-Z]+=.*", part):
            break
    else:
        variables |= dict(part.split("=", 1) for part in shlex.split(line))
        return
    for name, value in variables.items():
        line = line.replace(f"${name}", value)
    stdin = None
    for command in re.split(r"\s\|\s", line):
        words = shlex.split(command)
        out = words.pop() if ">" in words else None
        words = [word for word in words if word != ">"]
        assert words.pop(0) == "dmpcli", line
        if words[0] == "simulate":
            with Lab(*words[1:], *FREE_PORTS) as lab:
                assert lab.line.startswith("ready "), line
            continue
        done = invoke(*words, stdin=stdin)
        assert done.exit_code == 0, f"{command}\n{done.stderr}{done.exception!r}"
        stdin = done.stdout_bytes
        if out is not None:
            Path(out).write_bytes(stdin)


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN, ids=name_of)
def test_the_examples_of_a_page_run(page, shared, tmp_path, monkeypatch):
    folder = tmp_path / "here"
    shutil.copytree(shared, folder, symlinks=True)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(world, "LONGEST", 400.0)
    typed = [line for block in blocks(page, "sh") for line in lines(block)]
    typed = [line for line in typed if not line.startswith(tuple(ELSEWHERE))]
    # An arm has one owner on a computer, and other processes may run this test.
    robot = f"elite://127.78.{os.getpid() // 256 % 256}.{os.getpid() % 256}"
    typed = [line.replace(ROBOT, robot).replace(SENSOR, "netft://127.0.0.1") for line in typed]
    variables = {}
    with ExitStack() as stack:
        if any("s3://" in line for line in typed):
            store = stack.enter_context(served())
            empty(store)
            for name in ("demo.parquet", "pairs.csv"):
                store.client().upload_file(name, BUCKET, name)
            for name, value in store.environment.items():
                monkeypatch.setenv(name, value)
        if any(robot in line for line in typed):
            stack.enter_context(cell().laid_out())
            for module in ("control.watchdog", "workflows.record"):
                target = f"dmpcli.{module}.watched"
                stack.enter_context(mock.patch(target, lambda servo: servo))
        for line in typed:
            run(line, variables)


def test_nothing_that_looks_like_an_example_stands_outside_of_one():
    """What is to be typed stands in a fence of sh, and is run; a synopsis says that it is text."""
    missed = []
    for page in PAGES:
        text = page.read_text()
        for language, block in re.findall(r"^```(\w*)\n(.*?)^```", text, re.S | re.M):
            if language not in ("sh", "text", "python") and re.search(r"^dmpcli ", block, re.M):
                missed.append((name_of(page), block))
    assert missed == []


def test_lines_that_run_elsewhere_are_few_and_named():
    typed = [line for page in RUN for block in blocks(page, "sh") for line in lines(block)]
    for beginning in ELSEWHERE:
        assert any(line.startswith(beginning) for line in typed), beginning
    assert sum(not line.startswith(tuple(ELSEWHERE)) for line in typed) > 50


@pytest.mark.slow
def test_the_tutorial_goes_from_a_clone_to_a_page_in_eight_commands(shared, monkeypatch):
    monkeypatch.chdir(shared)
    typed = lines(blocks(ROOT / "docs" / "tutorial.md", "sh")[0])
    assert len(typed) <= 8
    assert typed[-1].startswith("xdg-open ")
    [drawn] = [line for line in typed if line.startswith("dmpcli generalize")]
    ended("fit", "mine.csv", "-o", "own.json")
    said = ended("inspect", "part.stl", "--for", "own.json").stdout
    proposed = re.search(r"room for own.json: (--start .+ --goal .+?)  ", said)
    assert proposed[1] in drawn

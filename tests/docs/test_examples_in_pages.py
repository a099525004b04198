"""Every example in README and docs runs, as it is printed.

All pages share one run of the pipeline: a folder with what a reader has by then. Instruments of
one's own are an EC66 and a Net F/T in simulated time, behind the real drivers.
"""

import ast
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from dmpcli.commands.examples import ROBOT, SENSOR
from tests.commands.running import ended, invoke
from tests.commands.test_examples import lay_out, real_cell
from tests.commands.virtual_lab import FREE_PORTS, Lab
from tests.docs.pages import ELSEWHERE, PAGES, ROOT, blocks, lines, name_of
from tests.docs.test_pages import texts
from tests.faults import world
from tests.object_store import BUCKET, empty, served
from tests.records.meshes import box, written

RUN = [page for page in PAGES if blocks(page, "sh")]

PYTHON = {
    "CONTRIBUTING.md": "tests/test_contributing.py",
    "docs/api.md": "tests/workflows/test_library.py",
    "docs/bench.md": "tests/bench/test_page.py",
    "docs/drivers.md": "tests/instruments/test_drivers_page.py",
}
"""Pages whose Python is run together with more than the page says, and where; that of all others
is run here."""

VARYING = re.compile(r"SIG[A-Z]+: |(?:netft|elite)://\S+|--id \S+|\d+")
"""What differs from run to run in what the program says."""


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
    _lay_out_forces(folder, wave)
    _lay_out_parts(folder)
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


def _lay_out_forces(folder, wave):
    """A recording of a pen that pressed with 3, 8 and 4 N on plane.json, N and N·m, base axes."""
    t, u = wave[:, 0], (wave[:, 1] - 400.0) / 90.0
    force = np.interp(u, [0.0, 0.5, 1.0], [3.0, 8.0, 4.0])
    there = wave[:, 1:3] + [-950.0, 130.0]
    rows = np.column_stack([t, there, np.full(len(t), -17.54), 0 * there, force, 0 * there, 0 * t])
    text = "\n".join(",".join(f"{value:.6f}" for value in row) for row in rows)
    (folder / "pressed.csv").write_text(
        f"t,x,y,z,fx [N],fy [N],fz [N],tx [N·m],ty [N·m],tz [N·m]\n{text}\n"
    )


def _lay_out_parts(folder):
    """What the table of parts in docs/batches.md names, and the table."""
    (folder / "parts").mkdir()
    (folder / "poses").mkdir()
    V, F = box((160.0, 120.0, 10.0))
    V = V - V.mean(axis=0)
    (folder / "parts" / "left.stl").write_bytes(written(V, F, "stl"))
    (folder / "parts" / "right.stl").write_bytes(written(V / 1000.0, F, "stl"))
    pose = {"position": [300, 40, 3], "rotation": [0, 0, 0.5]}
    (folder / "poses" / "right.json").write_text(json.dumps(pose))
    (folder / "table.json").write_text(json.dumps({"point": [0, 0, 0], "normal": [0, 0, 1]}))
    [table] = blocks(ROOT / "docs" / "batches.md", "none")
    (folder / "parts.csv").write_text(table)


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


@pytest.mark.sweep(kept=6)
@pytest.mark.slow
@pytest.mark.parametrize("page", RUN, ids=name_of)
def test_the_examples_of_a_page_run(page, shared, tmp_path, monkeypatch):
    folder = tmp_path / "here"
    shutil.copytree(shared, folder, symlinks=True)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(world, "LONGEST", 400.0)
    typed = [line for block in blocks(page, "sh") for line in lines(block)]
    typed = [line for line in typed if not line.startswith(tuple(ELSEWHERE))]
    for name, content in files_of(page):
        Path(name).write_text(content)
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
            stack.enter_context(real_cell())
        for line in typed:
            run(line, variables)


def files_of(page):
    """Files whose content a page prints, under the name in code that stands before it last."""
    text = page.read_text()
    for found in re.finditer(r"^```json\n(.*?)^```", text, re.S | re.M):
        name = re.findall(r"`([\w.]+\.json)`", text[: found.start()])[-1]
        yield name, found[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if blocks(page, "python") and name_of(page) not in PYTHON],
    ids=name_of,
)
def test_the_python_of_a_page_runs(page):
    names = {"__name__": "example"}
    for block in blocks(page, "python"):
        exec(block, names)


def test_python_that_runs_elsewhere_is_taken_from_the_page_there():
    for page, file in PYTHON.items():
        assert blocks(ROOT / page, "python")
        for block in blocks(ROOT / page, "python"):
            ast.parse(block)
        text = (ROOT / file).read_text()
        assert Path(page).name in text, file
        assert "exec(" in text or "write_text(" in text, file


@pytest.mark.slow
def test_every_fence_is_run_or_shows_what_the_program_says():
    """Commands stand in fences of sh, and are run; in those of text, what the program says."""
    whole = "\n".join(texts())
    known = ("sh", "bash", "python", "toml", "json", "none", "text")
    for page in PAGES:
        for language, block in re.findall(r"^```(\S*)\n(.*?)^```", page.read_text(), re.S | re.M):
            if language == "{toctree}":
                continue
            assert language in known, (name_of(page), language, block)
            if language in ("sh", "bash"):  # those of clusters are run by test_storage_page
                continue
            commands = r"^(\$ )?(dmpcli|make|\.?[\w/.-]*python\d?|pip) (?!.*: )"
            assert not re.search(commands, block, re.M), (name_of(page), block)
            for line in block.splitlines() if language == "text" else ():
                said = VARYING.split(line.removeprefix("dmpcli: "))
                for piece in (one.strip(" ;:=?&") for one in said):
                    assert len(piece) < 4 or piece in whole, (name_of(page), line, piece)


STANDING = [page for page in PAGES if page.name != "CHANGELOG.md"]
"""Pages that say what is, not what was."""


def typed():
    return [line for page in RUN for block in blocks(page, "sh") for line in lines(block)]


def test_commands_of_pages_that_take_long_are_understood():
    """Targets of the Makefile are there, and their variables."""
    targets = {line for line in typed() if line.startswith("make ")}
    for page in STANDING:
        targets |= set(re.findall(r"`(make [a-z][a-z-]+)(?: [A-Z]+=\S+)*`", page.read_text()))
    assert len(targets) > 12
    rules = (ROOT / "Makefile").read_text()
    phony = re.search(r"^\.PHONY: (.*?[^\\])$", rules, re.S | re.M)[1].replace("\\", "").split()
    for line in targets:
        for word in line.split()[1:]:
            name, value, _ = word.partition("=")
            assert re.search(rf"\b{name}\b", rules) if value else name in phony, line


@pytest.mark.slow
def test_modules_that_pages_run_are_there_and_take_their_words():
    for page in STANDING:
        text = page.read_text()
        for module in re.findall(r"python -m ((?:benchmarks|tools|tests)[\w.]*)", text):
            file = ROOT / module.replace(".", "/")
            assert file.with_suffix(".py").exists() or (file / "__main__.py").exists(), module
        for name in re.findall(r"python ((?:benchmarks|tools)/\S+\.py)", text):
            assert (ROOT / name).exists(), name
    long = [shlex.split(line)[2:] for line in typed() if line.startswith(".venv/bin/python -m ")]
    assert long
    for module in {words[0] for words in long}:
        done = subprocess.run(
            [sys.executable, "-m", module, "--help"],
            cwd=ROOT, capture_output=True, text=True, check=True,
        )  # fmt: skip
        said = {word for words in long if words[0] == module for word in words[1:]}
        assert {word for word in said if word.startswith("--")} <= set(
            re.findall(r"--[\w-]+", done.stdout)
        )


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

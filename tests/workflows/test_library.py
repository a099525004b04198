"""The Python API gives what the command line gives, and refuses what it refuses."""

import logging
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import dmpcli
from dmpcli.cli import app

ROOT = Path(__file__).parents[2]
RECORDED = ROOT / "sample_runs" / "recorded.parquet"
BENCH = ROOT / "sample_runs" / "bench.stl"
START, GOAL = (-551.03, 131.4, -17.56), (-660.02, 130.03, -17.54)


def command(*words):
    return CliRunner().invoke(app, [*map(str, words), "-q"])


@pytest.fixture(scope="module")
def skill():
    return dmpcli.fit(dmpcli.read(RECORDED), regression="ridge")


@pytest.mark.slow
def test_the_page_of_the_api_runs_as_it_is_printed(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "api.md").read_text(), re.S)
    assert len(blocks) >= 4
    exec("\n".join(blocks), {"OUT": tmp_path})
    assert (tmp_path / "batch" / "pairs.parquet").exists()


def test_every_public_name_is_there_and_none_is_a_room():
    rooms = {path.parent.name for path in (ROOT / "dmpcli").glob("*/__init__.py")}
    for name in dmpcli.__all__:
        assert getattr(dmpcli, name) is not None
        assert name not in rooms
    with pytest.raises(AttributeError, match="no attribute 'draw'"):
        dmpcli.draw  # noqa: B018


def test_importing_the_package_loads_nothing_heavy():
    code = (
        "import sys, dmpcli; print([m for m in ('numpy', 'typer', 'pydantic') if m in sys.modules])"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout == "[]\n"


def test_a_skill_has_the_bytes_that_fit_writes(tmp_path, skill):
    assert (
        command("fit", RECORDED, "-o", tmp_path / "a.json", "--regression", "ridge").exit_code == 0
    )
    dmpcli.write(skill, tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    again = dmpcli.read(tmp_path / "a.json")
    np.testing.assert_array_equal(again.weights, skill.weights)


@pytest.mark.slow
@pytest.mark.parametrize("surface", [None, BENCH], ids=["plane", "bench"])
def test_a_trajectory_has_the_bytes_that_generalize_writes(tmp_path, skill, surface):
    ends = (START, GOAL)
    words, on = [], None
    if surface is not None:
        on = dmpcli.read_surface(surface)
        ends = tuple(on.closest(np.array(ends)).position.tolist())
        words = ["--surface", surface]
    dmpcli.write(skill, tmp_path / "s.json")
    words += ["--start", *ends[0], "--goal", *ends[1], "--orientation", "surface"]
    done = command("generalize", tmp_path / "s.json", "-o", tmp_path / "a.parquet", *words)
    assert done.exit_code == 0, done.stderr
    one = dmpcli.generalize(skill, *ends, surface=on, orientation="surface")
    dmpcli.write(one, tmp_path / "b.parquet")
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    read = dmpcli.read(tmp_path / "a.parquet")
    np.testing.assert_array_equal(read.position, one.position)
    np.testing.assert_array_equal(read.rotation, one.rotation)


def test_a_batch_has_the_files_that_generalize_writes_and_reads_back(tmp_path, skill):
    rng = np.random.default_rng(2)
    start = np.array(START) + rng.uniform(-100, 100, (5, 3)) * [1, 1, 0]
    goal = start + rng.uniform(60, 150, (5, 1)) * [[-1.0, 0.2, 0.0]]
    goal[3] = start[3]
    dmpcli.write(skill, tmp_path / "s.json")
    rows = [
        f"{i + 1},{','.join(map(repr, [*a, *b]))}"
        for i, (a, b) in enumerate(zip(start.tolist(), goal.tolist(), strict=True))
    ]
    (tmp_path / "p.csv").write_text("id,x0,y0,z0,xg,yg,zg\n" + "\n".join(rows) + "\n")
    done = command(
        "generalize",
        tmp_path / "s.json",
        "-o",
        tmp_path / "a",
        "--pairs",
        tmp_path / "p.csv",
        "--on-error",
        "skip",
    )
    assert done.exit_code == 0, done.stderr
    many = dmpcli.generalize(skill, start, goal)
    from_file = dmpcli.read(tmp_path / "a")
    assert [state == "ok" for state in from_file.status] == [True, True, True, False, True]
    assert [state == "ok" for state in many.status] == [True, True, True, False, True]
    np.testing.assert_array_equal(many.position, from_file.position)
    np.testing.assert_array_equal(many.length, from_file.length)
    assert np.isnan(many.position[3]).all()
    dmpcli.write(many, tmp_path / "b")
    back = dmpcli.read(tmp_path / "b")
    np.testing.assert_array_equal(back.position, many.position)
    one = dmpcli.generalize(skill, start[1], goal[1])
    np.testing.assert_allclose(many[1].position, one.position, atol=1e-9)


def test_a_demonstration_of_arrays_is_learned_as_the_file_of_the_same_numbers(tmp_path):
    read = dmpcli.read(RECORDED)
    made = dmpcli.Demonstration(read.t, read.position, read.rotation)
    dmpcli.write(made, tmp_path / "d.parquet")
    one, other = dmpcli.fit(made), dmpcli.fit(dmpcli.read(tmp_path / "d.parquet"))
    np.testing.assert_array_equal(one.weights, other.weights)
    np.testing.assert_allclose(dmpcli.wave_heights(made), dmpcli.wave_heights(read), atol=1e-6)


def test_what_the_command_line_refuses_raises_the_same_text(tmp_path, skill):
    dmpcli.write(skill, tmp_path / "s.json")
    cases = [
        (["--rate", "-3"], {"rate": -3.0}),
        (["--amplitude", "double"], {"amplitude": "double"}),
        (["--tool-speed", "20", "--duration", "3"], {"tool_speed": 20.0, "duration": 3.0}),
        (["--scale", "2"], {"scale": 2.0}),
    ]
    for words, said in cases:
        done = command(
            "generalize",
            tmp_path / "s.json",
            "-o",
            tmp_path / "t.parquet",
            "--start",
            *START,
            "--goal",
            *GOAL,
            *words,
        )
        with pytest.raises(dmpcli.InputError) as raised:
            dmpcli.generalize(skill, START, GOAL, **said)
        assert done.exit_code == 2
        assert done.stderr == f"dmpcli: {raised.value}\n", words
    with pytest.raises(dmpcli.InputError, match="--forcing-scale: belongs to --model original"):
        dmpcli.fit(dmpcli.read(RECORDED), model="modified", forcing_scale="axis")


BAD = [
    ({"t": np.arange(50.0), "position": np.zeros((49, 3))}, "shapes"),
    ({"t": 0.02 * np.arange(50), "position": np.full((50, 3), np.nan)}, "demonstration"),
    (
        {"t": np.zeros(50), "position": np.random.default_rng(1).normal(size=(50, 3))},
        "demonstration",
    ),
]


@pytest.mark.parametrize(("said", "message"), BAD)
def test_bad_arrays_are_refused_by_name(said, message):
    with pytest.raises(dmpcli.InputError, match=message):
        dmpcli.fit(dmpcli.Demonstration(**said))


def test_what_is_told_goes_to_the_logger(skill, caplog):
    plane = dmpcli.Plane(np.array([0.0, 0.0, -17.55]), np.array([0.0, 0.0, 1.0]))
    logger = logging.getLogger("dmpcli")
    logger.propagate, before = True, logger.propagate
    try:
        with caplog.at_level("INFO", logger="dmpcli"):
            dmpcli.generalize(skill, START, GOAL, surface=plane, snap_tol=5.0)
    finally:
        logger.propagate = before
    assert any("onto the surface" in line for line in caplog.messages)


def test_a_recording_of_another_program_is_read_by_the_options_of_fit(tmp_path):
    t = np.linspace(0.0, 4.0, 201)
    rows = np.column_stack([t, 0.1 * t / 4.0, 0.01 * np.sin(np.pi * t), 0.0 * t])
    text = "\n".join(",".join(f"{value:.9f}" for value in row) for row in rows)
    path = tmp_path / "other.csv"
    path.write_text("time,x,y,z\n" + text + "\n")
    demo = dmpcli.read(path, length_unit="m", map_=("t=time",))
    np.testing.assert_allclose(demo.position[-1], [100.0, 0.0, 0.0], atol=1e-6)
    done = command("fit", path, "-o", tmp_path / "a.json", "--length-unit", "m", "--map", "t=time")
    assert done.exit_code == 0, done.stderr
    dmpcli.write(dmpcli.fit(demo), tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    with pytest.raises(dmpcli.InputError, match="--layout"):
        dmpcli.read(path, layout="nobody")
    with pytest.raises(dmpcli.InputError, match="in different ways"):
        dmpcli.fit([demo, dmpcli.read(path, length_unit="cm", map_=("t=time",))])


def test_what_of_a_batch_was_not_drawn_has_no_waves(skill):
    many = dmpcli.generalize(skill, [START, START], [GOAL, START])
    assert len(dmpcli.wave_heights(many[0])) >= 1
    with pytest.raises(dmpcli.InputError, match="without samples"):
        dmpcli.wave_heights(many[1])

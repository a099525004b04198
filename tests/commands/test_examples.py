"""Every example of every --help runs, in one folder, one after another.

Instruments of one's own are stood for by an EC66 and a Net F/T in simulated time, behind the real
drivers.
"""

import os
import shlex
import shutil
from contextlib import ExitStack, contextmanager
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from dmpcli import cli
from dmpcli.commands import simulate
from dmpcli.commands.examples import EXAMPLES, ROBOT, SENSOR
from dmpcli.records import schemas
from dmpcli.settings import layers
from dmpcli.settings.calibrate import CalibrateSettings
from dmpcli.settings.layers import resolve
from dmpcli.settings.record import RecordSettings
from dmpcli.simulation.elite_server import faults
from tests.commands.running import invoke
from tests.commands.test_recover import crashed
from tests.commands.virtual_lab import FREE_PORTS, Lab
from tests.control.drag_fakes import rehearse
from tests.faults.bench import Bench
from tests.records.meshes import box, written

ROOT = Path(__file__).parents[2]
ORDER = ("calibrate", *(name for name in EXAMPLES if name != "calibrate"))


def lay_out(folder):
    """The files that a user has before the first example."""
    samples = ROOT / "sample_runs"
    for name, source in (
        ("part.stl", "bench.stl"),
        ("pairs.csv", "pairs.csv"),
        ("geometry.json", "pen.json"),
    ):
        shutil.copy(samples / source, folder / name)
    t = np.linspace(0.0, 8.0, 401)
    u = t / 8.0
    u = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    wave = np.column_stack([t, 0.3 + 0.11 * u, 0.024 * np.sin(2 * np.pi * u), 0.0 * u])
    rows = "\n".join(",".join(f"{value:.6f}" for value in row) for row in wave)
    (folder / "goals.csv").write_text("t,x,y,z\n0.5,-800,133,-17.5\n3,-805,128,-17.5\n")
    (folder / "log.csv").write_text(f"time,tx,ty,tz\n{rows}\n")
    (folder / "drawing.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="50mm" viewBox="0 0 100 50">'
        '<path d="M 5 25 Q 30 0 50 25 T 95 25" fill="none" stroke="black"/></svg>'
    )
    V, F = box((100.0, 60.0, 40.0))
    (folder / "block.stl").write_bytes(written(V, F, "stl"))
    corners = np.column_stack([V + [400.0, -120.0, 35.0], V])
    rows = "\n".join(",".join(f"{value:g}" for value in row) for row in corners)
    (folder / "touched.csv").write_text(f"x,y,z,px,py,pz\n{rows}\n")
    _, recorder, _ = rehearse(seed=1, duration=3.0)
    crashed(folder / "cut.parquet.journal", recorder.log.rows, 100)


def cell():
    """A pen over a plate, a hand that draws one stroke, and the instruments that feel it."""
    settings = resolve(RecordSettings, QUICK[RecordSettings], "drag")
    parameters, hand = simulate._scene(settings, faults.parse(()), None, 1, 0.1)
    return Bench(parameters, hand)


TOUR = {"poses": 6, "dwell": 0.5, "max_rotation_speed": 1.2}
TOUR |= {"max_rotation_acceleration": 8.0, "max_rotation_jerk": 300.0}
QUICK = {CalibrateSettings: TOUR, RecordSettings: {"duration": 4.0}}
"""A tour of calibration that takes a fifth of its time, and a hand that takes half: what comes of
them is for other tests."""


@contextmanager
def quicker(kind):
    """Let settings be quick where nothing else is said."""
    layered = layers._layered

    def quick(asked, *said):
        merged, origin = layered(asked, *said)
        return (QUICK[kind] if asked is kind else {}) | merged, origin

    with mock.patch.object(layers, "_layered", quick):
        yield


@contextmanager
def real_cell():
    """Let instruments of one's own be there; every command finds the cell as the last left it."""
    with cell().laid_out(), quicker(CalibrateSettings), ExitStack() as stack:
        for module in ("control.watchdog", "workflows.record"):
            stack.enter_context(mock.patch(f"dmpcli.{module}.watched", lambda servo: servo))
        yield


def run(line, folder):
    """Run one line as a shell does that knows words, and where standard output goes."""
    words = shlex.split(line.replace("\\\n", " "))
    assert words.pop(0) == "dmpcli"
    if words[0] == "simulate":
        with Lab(*words[1:], *FREE_PORTS) as lab:
            assert lab.line.startswith("ready "), line
        return lab.code == 130, lab.told
    out = words.index(">") if ">" in words else len(words)
    done = invoke(*words[:out])
    if out < len(words):
        (folder / words[out + 1]).write_bytes(done.stdout_bytes)
    return done.exit_code == 0, done.stderr + repr(done.exception)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """How each example ended, by command; they read one another's files."""
    folder = tmp_path_factory.mktemp("examples")
    lay_out(folder)
    few = (folder / "pairs.csv").read_text().splitlines()[:3]
    (folder / "pairs.csv").write_text("\n".join([*few, ""]))
    here = Path.cwd()
    # An arm has one owner on a computer, and other processes may run this test.
    robot = f"elite://127.77.{os.getpid() // 256 % 256}.{os.getpid() % 256}"
    results = {}
    os.chdir(folder)
    try:
        for name in ORDER:
            lines = [one.line.replace(ROBOT, robot) for one in EXAMPLES[name]]
            lines = [line.replace(SENSOR, "netft://127.0.0.1") for line in lines]
            results[name] = []
            for line in lines:
                with real_cell() if robot in line else quicker(RecordSettings):
                    results[name].append((line, *run(line, folder)))
    finally:
        os.chdir(here)
    return folder, results


@pytest.mark.slow
@pytest.mark.parametrize("command", cli.COMMANDS)
def test_the_examples_of_the_help_run(command, done):
    _, results = done
    assert results[command]
    for line, passed, told in results[command]:
        assert passed, f"{line}\n{told}"


@pytest.mark.slow
def test_what_the_examples_leave_is_what_they_say(done):
    folder, _ = done
    from dmpcli.records import file_io, record

    demo = record.decode(file_io.read(folder / "taught.parquet"), schemas.DEMONSTRATION)
    assert demo.provenance.facts["ended"] == "rest"
    run_file = record.decode(file_io.read(folder / "drawn.parquet"), schemas.RUN)
    assert run_file.provenance.facts["completed"]
    assert (folder / "own.toml").read_text().startswith("# The paper's own parameters")
    log = (folder / "execute.log").read_text().splitlines()
    assert "dmpcli execute trajectory.parquet" in log[0]
    assert log[-1].endswith("done")


def test_every_command_has_examples_that_fit_a_terminal():
    assert set(EXAMPLES) == set(cli.COMMANDS)
    for command, examples in EXAMPLES.items():
        assert examples
        for one in examples:
            assert one.line.startswith(f"dmpcli {command}")
            assert max(map(len, one.line.split("\n"))) <= 98
            shown = invoke(command, "--help").stdout
            assert f"  # {one.words}\n" in shown
            assert one.line.split("\n")[0] in shown

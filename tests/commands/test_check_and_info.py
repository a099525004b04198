"""check reads instruments and moves nothing; info tells what the report of a bug needs."""

import json
from importlib import metadata
from pathlib import Path
from unittest import mock

import numpy as np

from dmpcli import __version__
from dmpcli.records import tool
from dmpcli.simulation.mock import PEN
from dmpcli.workflows import info as information
from tests.commands.running import ended, invoke
from tests.commands.test_examples import cell


def test_check_reads_the_mock_lab():
    done = ended("check", "--json")
    said = json.loads(done.stdout)
    assert said["robot"]["mode"] == "ready"
    assert said["robot"]["moved_mm"] == 0.0
    assert said["sensor"]["samples"] == 100
    assert done.stderr.endswith("ready; nothing was moved\n")


def test_check_tells_all_it_read_before_it_refuses():
    done = ended("check", "--robot", "mock:?estop_at=0", "--sensor", "mock:?estop_at=0", expect=3)
    assert "mode: emergency stop" in done.stderr
    assert "samples: 100" in done.stderr
    assert done.stderr.splitlines()[-1].startswith("dmpcli: robot: emergency stop; release it")


def test_check_of_a_sensor_that_is_silent_is_exit_code_4():
    done = ended("check", "--sensor", "mock:?silent_at=0", expect=4)
    assert "sent nothing for 1 s" in done.stderr
    assert "robot" not in done.stderr


def test_check_of_a_real_cell_moves_nothing_and_asks_for_no_motion(tmp_path):
    """The very drivers on an EC66 and a Net F/T in simulated time."""
    bench = cell()
    asked, before = [], bench.lab.controller.arm.posture.position.copy()
    answers = bench.answers
    bench.answers = lambda method, params: asked.append(method) or answers(method, params)
    (tmp_path / "pen.json").write_bytes(tool.encode(PEN))
    with bench.laid_out():
        words = ["--robot", "elite://127.77.1.1", "--sensor", "netft://127.0.0.1"]
        words += ["--tool", str(tmp_path / "pen.json")]
        done = invoke("check", *words, "--json")
        bench.world.advance(bench.world.now() + 1.0)
    said = json.loads(done.stdout)
    assert said["exit_code"] == done.exit_code == 0, done.stderr
    assert said["robot"]["moved_mm"] == 0.0
    assert said["sensor"]["lost"] == 0
    assert asked
    assert all(word.startswith(("get", "inverse")) for word in asked), asked
    assert bench.sent == []
    np.testing.assert_allclose(bench.lab.controller.arm.posture.position, before, atol=1e-9)


def test_check_names_every_instrument_that_cannot_be_reached():
    done = ended(
        "check", "--robot", "elite://127.0.0.1:9", "--sensor", "netft://127.0.0.1", expect=4
    )
    assert "robot 127.0.0.1:9: cannot be reached" in done.stderr
    assert "sensor netft://127.0.0.1: cannot be reached" in done.stderr


def test_info_tells_versions_extras_and_machine():
    said = json.loads(ended("info", "--json").stdout)
    assert said["dmpcli"] == __version__
    assert said["packages"]["numpy"] == metadata.version("numpy")
    assert set(said["extras"]) == {"ur", "dask", "svg", "ros"} | set(said["extras"])
    assert said["robots"][0] == "mock"
    text = ended("info").stdout
    assert f"numpy {metadata.version('numpy')}" in text


def test_info_names_no_user(monkeypatch):
    monkeypatch.setattr(Path, "home", lambda: Path(information.__file__).parents[3])
    assert json.loads(ended("info", "--json").stdout)["installed_at"].startswith("~/")


def test_info_tells_what_is_not_installed():
    def missing(name):
        raise metadata.PackageNotFoundError(name)

    with mock.patch.object(information.metadata, "version", missing):
        assert "(without ur-rtde)" in ended("info").stdout

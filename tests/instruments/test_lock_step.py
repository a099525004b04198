"""Simulated instruments of another make run in lock-step: the bench of docs/drivers.md."""

import json
import sys
import time
from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints

import numpy as np
import pytest
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.control import workcell
from dmpcli.errors import InputError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.records import file_io, record, schemas
from dmpcli.records.record import Provenance, Record
from tests.instruments.test_drivers_page import example

ARM = "spring://bench?x=1&y=2&z=3&table=3"
SENSOR = "spring://bench"


@pytest.fixture
def spring(tmp_path, monkeypatch):
    (tmp_path / "dmpcli_spring.py").write_text(example("spring"))
    monkeypatch.syspath_prepend(tmp_path)
    installed = EntryPoints(
        [
            EntryPoint("spring", "dmpcli_spring:robot", "dmpcli.robots"),
            EntryPoint("spring", "dmpcli_spring:sensor", "dmpcli.sensors"),
            EntryPoint("netft", "dmpcli.instruments.netft:make", "dmpcli.sensors"),
        ]
    )
    monkeypatch.setattr(metadata, "entry_points", lambda **only: installed.select(**only))
    yield
    sys.modules.pop("dmpcli_spring", None)


@pytest.fixture
def tool(tmp_path):
    tip = {"position": [0.0, 0.0, 100.0], "rotation": [0.0, 0.0, 0.0]}
    content = {
        "schema": "tool",
        "version": 2,
        "flange_to_tcp": tip,
        "flange_to_sensor": tip,
        "payload": {"weight": 0.0, "centre_of_mass": [0.0] * 3},
    }
    path = tmp_path / "tool.json"
    path.write_text(json.dumps(content))
    return path


@pytest.fixture
def stroke(tmp_path):
    u = np.linspace(0.0, 1.0, 251)
    u = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    columns = {
        "id": np.full(len(u), "0", dtype=object),
        "t": 0.02 * np.arange(len(u)),
        "x": 1.0 + 60.0 * u,
        "y": 2.0 + 0.0 * u,
        "z": 3.0 + 0.0 * u,
    }
    provenance = Provenance("generalize", {}, (), {"tau": 5.0, "normal": [0.0, 0.0, 1.0]})
    path = tmp_path / "stroke.parquet"
    path.write_bytes(record.encode(Record(schemas.TRAJECTORY, columns, provenance)))
    return path


def run(*arguments, expect=0):
    result = CliRunner().invoke(app, [*map(str, arguments)])
    assert result.exit_code == expect, (result.exit_code, result.stderr, result.exception)
    return result.stderr


@pytest.mark.slow
def test_a_contact_bench_needs_no_real_time_and_gives_the_same_bytes_again(
    spring, tool, stroke, tmp_path, monkeypatch
):
    def never(_):
        raise AssertionError("a run in lock-step sleeps")

    monkeypatch.setattr(time, "sleep", never)
    out = tmp_path / "run.parquet"
    instruments = ("--robot", ARM, "--sensor", SENSOR, "--tool", tool)
    contents = []
    for _ in range(2):
        run("execute", stroke, "-o", out, *instruments, "--coupling", "force")
        contents.append(out.read_bytes())
    assert contents[0] == contents[1]
    kept = record.decode(file_io.read(str(out)), schemas.RUN)
    facts = kept.provenance.facts
    assert (facts["completed"], facts["simulated"]) == (True, True)
    assert "lateness" not in facts
    drawn = kept.columns["phase"] == "stroke"
    # 5 N on 5 N/mm: a millimetre below the table.
    assert facts["contact"]["mean"] == pytest.approx(5.0, rel=0.02)
    np.testing.assert_allclose(kept.columns["z"][drawn], 2.0, atol=0.1)


def test_what_is_not_in_lock_step_beside_it_needs_real_time(spring):
    addresses = workcell.check(ARM, SENSOR)
    assert workcell.repeatable(addresses)
    assert workcell.repeatable([addresses[0], workcell.parse("mock:", "sensor")])
    assert not workcell.repeatable(workcell.check(ARM, "netft://h"))
    bench = workcell.connect(ARM, SENSOR, SimulatedClock())
    assert (bench.lab, bench.simulated, bench.lock_step) == (None, True, True)
    bench = workcell.connect(ARM, "netft://h", SimulatedClock())
    assert (bench.simulated, bench.lock_step) == (True, False)
    with pytest.raises(InputError, match="--allow-mixed"):
        workcell.check(ARM, "mock:")


def test_a_recording_of_it_needs_its_duration_and_has_no_hand_of_ours(spring, tool, tmp_path):
    out = tmp_path / "demo.parquet"
    arguments = ("record", "-o", out, "--robot", ARM, "--sensor", SENSOR, "--tool", tool)
    assert "--duration: say how long" in run(*arguments, expect=2)
    assert "--seed: is of the mock's hand" in run(*arguments, "--seed", 1, expect=2)
    run(*arguments, "--duration", 2.0)
    kept = record.decode(file_io.read(str(out)), schemas.DEMONSTRATION)
    assert kept.t[-1] == pytest.approx(2.0)
    assert kept.provenance.facts["simulated"]
    assert "reference" not in kept.provenance.facts

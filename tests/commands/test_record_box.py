"""A box that is set otherwise while an arm is led by it: how far the arm goes before it is told."""

import threading
import time

import numpy as np
import pytest
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.commands import simulate
from dmpcli.instruments.netft.settings import Scale
from dmpcli.records import file_io, record, tool
from dmpcli.settings.layers import resolve
from dmpcli.settings.record import RecordSettings
from dmpcli.simulation.elite_server.faults import LabFaults
from dmpcli.simulation.elite_server.lab import VirtualLab
from dmpcli.simulation.elite_server.lab_server import LabServer
from dmpcli.simulation.mock import PEN

FORCE = 4_000_000
"""Counts, 4 N: beyond the dead-band by what moves an arm at 30 to 50 mm/s."""


@pytest.fixture
def lab():
    settings = resolve(RecordSettings, {}, RecordSettings.preset)
    setting, _ = simulate._scene(settings, LabFaults(), None, 1, 0.1)
    # Nobody draws: the hand never comes.
    with LabServer(VirtualLab(setting, None)) as serving:
        yield serving


@pytest.mark.slow
@pytest.mark.parametrize("what", ["bias", "scale"])
def test_with_no_hand_a_box_that_is_set_otherwise_moves_the_arm_by_little(what, lab, tmp_path):
    pen, out = tmp_path / "pen.json", tmp_path / "run.parquet"
    pen.write_bytes(tool.encode(PEN.with_zero(None)))
    changed = threading.Event()

    def change():
        while lab.lab.controller.entered is None and not changed.is_set():
            time.sleep(0.01)
        time.sleep(0.7)
        if what == "bias":
            lab.box.set_bias(0, FORCE)
        else:
            # Another unit of force: the weight of the tool seems another one.
            lab.box.set_scale(Scale(2.5e5, 1e6, "N", "N-m"))

    thread = threading.Thread(target=change, daemon=True)
    thread.start()
    words = ["record", "-o", str(out), "--robot", lab.robot_url, "--sensor", lab.sensor_url]
    result = CliRunner().invoke(app, [*words, "--tool", str(pen), "--duration", "8"])
    changed.set()
    thread.join()
    assert result.exit_code == 4, result.stderr
    assert f"its {what} was changed, from" in result.stderr
    place = record.decode(file_io.read(out)).position()
    assert np.linalg.norm(place - place[0], axis=1).max() <= 15.0

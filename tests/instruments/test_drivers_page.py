"""The example of docs/drivers.md, run as it stands there."""

import importlib
import re
import socketserver
import sys
import threading
from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.control import workcell
from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.instruments import driver_protocol, registry, ur
from dmpcli.instruments.clock import MonotonicClock
from dmpcli.instruments.elite import settings as elite
from dmpcli.instruments.netft import options as netft

# A driver of version 0.1 imports from where things were.
pytestmark = pytest.mark.filterwarnings("ignore:dmpcli.instruments.drivers:DeprecationWarning")

PAGE = (Path(__file__).parents[2] / "docs" / "drivers.md").read_text()


def example(scheme):
    """The page's driver of that scheme."""
    codes = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    return next(code for code in codes if code.startswith(f'"""``{scheme}://'))


class Acme(socketserver.ThreadingTCPServer):
    """The controller that the page imagines: a line in, a line out."""

    daemon_threads = True

    def __init__(self):
        self.mode, self.stopped, self.seq = "remote", "no", 0
        self.pose = [-0.55, 0.13, 0.2, np.pi, 0.0, 0.0]
        self.asked = []
        super().__init__(("127.0.0.1", 0), Acme.Handler)

    class Handler(socketserver.StreamRequestHandler):
        def handle(self):
            for line in self.rfile:
                self.wfile.write((self.server.answer(*line.decode().split()) + "\n").encode())

    def answer(self, request, *values):
        self.asked.append(request)
        if request == "go":
            self.pose = [float(value) for value in values]
        if request == "read":
            self.seq += 2
            return f"{self.seq} 0 1.5 0 -2 0 0 0.25"
        said = {"mode": self.mode, "stopped": self.stopped, "range": "100 100 200 5 5 5"}
        return " ".join(map(repr, self.pose)) if request == "pose" else said.get(request, "ok")


# What the page of version 0.1 had as its example.
OLD = Path(__file__).with_name("acme_of_0_1.txt").read_text()


@pytest.fixture(params=[example("acme"), OLD], ids=["this version", "version 0.1"])
def acme(request, tmp_path, monkeypatch):
    (tmp_path / "dmpcli_acme.py").write_text(request.param)
    monkeypatch.syspath_prepend(tmp_path)
    points = re.findall(r'entry-points\."([^"]+)"\]\n(\w+) = "([^"]+)"', PAGE)
    installed = EntryPoints(EntryPoint(name, value, group) for group, name, value in points)
    assert {point.group for point in installed} == set(registry.GROUPS.values())
    monkeypatch.setattr(metadata, "entry_points", lambda **only: installed.select(**only))
    with Acme() as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        server.url = f"acme://127.0.0.1:{server.server_address[1]}"
        yield server
        server.shutdown()
        thread.join()
    sys.modules.pop("dmpcli_acme", None)


def test_the_example_drives_its_robot_and_reads_its_sensor(acme):
    bench = workcell.connect(f"{acme.url}?lookahead=0.2", acme.url, MonotonicClock())
    robot, sensor = bench.robot, bench.sensor
    info = robot.open()
    assert (info.make, info.lookahead) == ("Acme A1", 0.2)
    state = robot.state()
    np.testing.assert_allclose(state.position, [-550.0, 130.0, 200.0])
    np.testing.assert_allclose(state.rotation, np.diag([1.0, -1.0, -1.0]), atol=1e-12)
    assert not robot.send(state.position, state.rotation)
    robot.start(0.02)
    turned = Rotation.from_euler("x", 0.1).as_matrix() @ state.rotation
    assert robot.send(state.position + [1.0, 0.0, 0.0], turned)
    np.testing.assert_allclose(acme.pose[:3], [-0.549, 0.13, 0.2])
    np.testing.assert_allclose(Rotation.from_rotvec(acme.pose[3:]).as_matrix(), turned, atol=1e-12)
    robot.stop()
    acme.stopped = "yes"
    assert robot.state().mode == "emergency stop"
    robot.close()
    robot.close()
    assert acme.asked.count("stop") == 1

    assert sensor.open().limit.tolist() == [100.0, 100.0, 200.0, 5.0, 5.0, 5.0]
    sensor.start(100.0)
    (sample,) = sensor.poll()
    assert sample.wrench.tolist() == [1.5, 0.0, -2.0, 0.0, 0.0, 0.25]
    assert (sample.seq, sample.lost, sample.healthy) == (2, 1, True)
    sensor.close()
    sensor.close()


def test_the_example_says_what_is_wrong_as_the_page_asks(acme):
    with pytest.raises(InputError, match="speed: there is no such option; acme has lookahead"):
        workcell.connect(f"{acme.url}?speed=1", None, MonotonicClock())
    acme.mode = "teach"
    robot = workcell.connect(acme.url, None, MonotonicClock()).robot
    with pytest.raises(RefusedError, match="not in remote mode"):
        robot.open()
    robot.close()
    acme.mode, acme.pose = "remote", [np.nan] * 6
    robot = workcell.connect(acme.url, None, MonotonicClock()).robot
    with pytest.raises(InstrumentError, match="pose: answers 'nan"):
        robot.open()
    robot.close()


def test_the_old_place_of_the_protocol_says_where_it_is_now():
    old = importlib.import_module("dmpcli.instruments.drivers")
    with pytest.warns(DeprecationWarning, match=r"is dmpcli\.instruments\.driver_protocol now"):
        declaration = old.Declaration
    assert declaration is driver_protocol.DriverInfo
    assert old.DriverState is driver_protocol.DriverState
    assert old.ServoDriver is driver_protocol.ServoDriver


def test_the_page_names_every_option_and_no_other():
    def told(section):
        table = PAGE.split(f"\n## {section}\n")[1].split("\n## ")[0].split("\n### ")[0]
        rows = re.findall(r"^\| (`.+?) \|", table, re.M)
        return {name for row in rows for name in re.findall(r"`(\w+)`", row)}

    def known(read, role, scheme):
        with pytest.raises(InputError) as error:
            read(workcell.Address(role, scheme, "h", options={"nothing": "1"}))
        return set(str(error.value).split(f"{scheme} has ")[1].split(", "))

    assert told("elite") == known(elite.read, "robot", "elite")
    assert told("netft") == known(netft.read, "sensor", "netft")
    assert told("ur") == known(lambda a: ur.make(a, MonotonicClock()), "robot", "ur")

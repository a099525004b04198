import json
import re
import signal
import socket
import struct
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from dmpcli import cli
from dmpcli.control.workcell import parse
from dmpcli.simulation.elite_server.lab_server import loopback
from tests.commands.virtual_lab import FREE_PORTS, Lab
from tests.simulation.elite_server.virtual_fakes import Client

START = (-551.030, 131.399, -17.560)


def refused(*words: str) -> Result:
    """Run the command, which must not come to serve, in this process."""
    return CliRunner().invoke(cli.app, words)


def rpc_port(lab: Lab) -> int:
    port = parse(lab.robot, "robot").port
    assert port is not None
    return port


@pytest.mark.slow
def test_one_line_says_that_it_is_ready_with_urls_to_paste():
    with Lab() as lab:
        assert re.fullmatch(
            r"ready sensor=netft://127\.0\.0\.1:\d+\?http=\d+&tcp=\d+ "
            r"robot=elite://127\.0\.0\.1:\d+\?monitor_port=\d+\n",
            lab.line,
        )
        sensor, robot = parse(lab.sensor, "sensor"), parse(lab.robot, "robot")
        ports = [sensor.port, robot.port]
        ports += [int(p) for p in (*sensor.options.values(), *robot.options.values())]
        assert len(set(ports)) == 5
        assert 0 not in ports
    assert lab.rest == ""


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_it_serves_until_a_signal_ends_it(number, code):
    lab = Lab()
    client = Client(rpc_port(lab))
    assert client.call("getRobotMode") == 2
    lab.leave(number)
    client.close()
    assert lab.code == code
    assert "strokes drawn by the hand: 0" in lab.told
    assert "Traceback" not in lab.told


@pytest.mark.slow
def test_the_arm_is_parked_at_the_start_of_the_stroke():
    with Lab("--start", "-600", "100", "-20", "--goal", "-650", "100", "-20") as lab:
        client = Client(rpc_port(lab))
        pose = client.call("get_tcp_pose")
        client.close()
    # The plate lies 0.4 mm above the stroke, as deep as the hand presses; the pen 0.1 mm higher.
    np.testing.assert_allclose(pose[:3], [-600.0, 100.0, -19.5], atol=1e-4)


@pytest.mark.slow
def test_the_sensors_records_come_by_udp_and_its_pages_by_http():
    with Lab() as lab:
        address = parse(lab.sensor, "sensor")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as endpoint:
            endpoint.settimeout(5.0)
            endpoint.sendto(struct.pack(">HHI", 0x1234, 2, 3), ("127.0.0.1", address.port))
            records = [struct.unpack(">III6i", endpoint.recv(64)) for _ in range(3)]
        http = socket.create_connection(("127.0.0.1", int(address.options["http"])), timeout=5.0)
        http.sendall(b"GET /netftapi2.xml HTTP/1.0\r\n\r\n")
        page = b"".join(iter(lambda: http.recv(4096), b""))
        http.close()
    assert [record[0] for record in records] == [1, 2, 3]
    assert b"<cfgcpf>1000000" in page
    # 3.5 N of zero and 6 N of weight along the z axis that points down.
    assert records[0][5] / 1e6 == pytest.approx(9.5, abs=0.5)


@pytest.mark.slow
def test_a_tool_of_ones_own_hangs_on_the_sensor(tmp_path):
    from dmpcli.records import tool as tool_file
    from dmpcli.simulation.mock import PEN

    heavy = replace(PEN, weight=20.0, zero=None)
    (tmp_path / "tool.json").write_bytes(tool_file.encode(heavy))
    with Lab("--tool", str(tmp_path / "tool.json")) as lab:
        address = parse(lab.sensor, "sensor")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as endpoint:
            endpoint.settimeout(5.0)
            endpoint.sendto(struct.pack(">HHI", 0x1234, 2, 1), ("127.0.0.1", address.port))
            record = struct.unpack(">III6i", endpoint.recv(64))
    assert record[5] / 1e6 == pytest.approx(20.0, abs=0.5)


@pytest.mark.slow
def test_a_surface_of_ones_own_is_touched(tmp_path):
    plane = {"point": [0, 0, START[2] + 1.5], "normal": [0, 0, -1]}
    (tmp_path / "plane.json").write_text(json.dumps(plane))
    with Lab("--surface", str(tmp_path / "plane.json")) as lab:
        address = parse(lab.sensor, "sensor")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as endpoint:
            endpoint.settimeout(5.0)
            endpoint.sendto(struct.pack(">HHI", 0x1234, 2, 1), ("127.0.0.1", address.port))
            record = struct.unpack(">III6i", endpoint.recv(64))
    # The pen stands 0.5 mm above the stroke, 1 mm in this plane: 5 N less than in the air.
    assert record[5] / 1e6 == pytest.approx(9.5 - 5.0, abs=0.5)


@pytest.mark.slow
def test_a_fault_from_the_beginning_is_there():
    with Lab("--fault", "mode=teach", "--fault", "estop") as lab:
        client = Client(rpc_port(lab))
        assert client.call("getRobotMode") == 0
        assert client.call("get_estop_status") == 1
        assert client.call("stop")["code"] == -32693
        client.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--fault", "explode"), "no such fault; there are loss"),
        (("--reference", "spiral"), "--reference spiral"),
        (("--surface", "nowhere.stl"), "nowhere.stl"),
        (("--surface-pose", "0", "0", "0", "0", "0", "0"), "say which surface with --surface"),
        (("--duration", "0.3"), "give it more time"),
        (("--tool", "geometry.json"), "--tool geometry.json: needs a weight"),
    ],
)
def test_a_mistake_on_the_command_line_is_one_message(options, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frame = {"position": [0, 0, 100]}
    tool = {"schema": "tool", "version": 2, "flange_to_tcp": frame, "flange_to_sensor": frame}
    (tmp_path / "geometry.json").write_text(json.dumps(tool))
    done = refused("simulate", *FREE_PORTS, *options)
    assert done.exit_code == 2
    assert done.stdout == ""
    assert words in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.slow
def test_a_start_out_of_reach_is_refused():
    done = refused(
        "simulate", *FREE_PORTS, "--start", "-2000", "0", "0", "--goal", "-2100", "0", "0"
    )
    assert done.exit_code == 3
    assert "out of reach" in done.stderr


@pytest.mark.slow
def test_a_host_that_is_not_this_computers_is_refused():
    for host in ("300.1.1.1", "192.0.2.1", "a..b"):
        done = refused("simulate", *FREE_PORTS, "--host", host)
        assert done.exit_code == 2
        assert f"--host {host}: is no address of this computer" in done.stderr
        assert done.stderr.count("\n") == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["robot", "monitor", "http", "tcp"])
def test_a_port_that_is_taken_is_refused(name):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        done = refused("simulate", *FREE_PORTS, f"--{name}-port", port)
    assert done.exit_code == 4
    assert done.stdout == ""
    assert f"--{name}-port {port} on 127.0.0.1: Address already in use; 0 takes" in done.stderr
    assert done.stderr.count("-port") == 1
    assert done.stderr.count("\n") == 1


@pytest.mark.slow
def test_a_sensor_port_that_is_taken_is_refused():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = str(taken.getsockname()[1])
        done = refused("simulate", *FREE_PORTS, "--sensor-port", port)
    assert done.exit_code == 4
    assert f"--sensor-port {port}" in done.stderr


@pytest.mark.parametrize(
    ("host", "alone"),
    [
        ("127.0.0.1", True),
        ("127.0.1.1", True),
        ("localhost", True),
        ("::1", True),
        ("0.0.0.0", False),
        ("", False),
        ("192.168.0.7", False),
        ("lab.example", False),
    ],
)
def test_what_is_bound_beyond_loopback_is_known(host, alone):
    assert loopback(host) is alone


@pytest.mark.slow
def test_a_bind_beyond_loopback_and_a_long_look_ahead_are_warned_of_else_it_is_quiet():
    with Lab("-q", "--host", "0.0.0.0", "--lookahead", "0.2") as lab:
        assert lab.sensor.startswith("netft://0.0.0.0:")
    assert "--host 0.0.0.0: whoever reaches this computer there can move" in lab.told
    assert "--lookahead 0.2: above 0.15 s the drag swings" in lab.told
    with Lab("-q") as lab:
        assert lab.line.startswith("ready ")
    assert lab.told == ""

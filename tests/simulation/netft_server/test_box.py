"""The simulated box against the bytes of the manuals: sockets and struct, no client of ours."""

import contextlib
import socket
import struct
import urllib.error
import urllib.request
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from dmpcli.instruments.netft.settings import Scale
from dmpcli.simulation.netft_server.faults import BoxFaults
from dmpcli.simulation.netft_server.settings import rounded_up
from tests.instruments.rdt_bench import WRENCH, client_socket, running_box, until

START, BUFFERED, AXIA = 2, 3, 1
STOP, LATCH, BIAS = 0, 0x41, 0x42


def ask(client, box, command, count=0):
    request = struct.pack(">HHI", 0x1234, command, count)
    client.sendto(request, ("127.0.0.1", box.rdt_port))


def receive(client):
    datagram, source = client.recvfrom(2000)
    fields = struct.Struct(">III6i")
    return [fields.unpack_from(datagram, k) for k in range(0, len(datagram), 36)], source


def stream(client, box, count, command=START):
    """Ask for so many records; return them."""
    ask(client, box, command, count)
    records = []
    while len(records) < count:
        records += receive(client)[0]
    return records


@pytest.fixture
def client():
    with client_socket() as made:
        yield made


def test_records_are_numbered_from_one_at_each_request(client):
    with running_box(rate=1000) as box:
        assert [r[0] for r in stream(client, box, 5)] == [1, 2, 3, 4, 5]
        assert [r[0] for r in stream(client, box, 3)] == [1, 2, 3]
        until(lambda: box.client is None)


@pytest.mark.parametrize(("rate", "step"), [(100, 70), (500, 14), (1000, 7)])
def test_the_sensors_own_counter_goes_at_the_internal_rate_and_over_requests(client, rate, step):
    with running_box(rate=rate) as box:
        first = [r[1] for r in stream(client, box, 8)]
        second = [r[1] for r in stream(client, box, 2)]
        assert np.abs(np.diff(first) - step).max() <= 1  # it is cut to whole readings
        assert first[-1] - first[0] == pytest.approx(7 * step, abs=1)
        assert second[0] > first[-1]


def test_counts_are_the_wrench_by_the_scale(client):
    scale = Scale(1000.0, 50.0, "lbf", "lbf-in")
    with running_box(scale=scale, rate=1000) as box:
        (record,) = stream(client, box, 1)
    newtons, newton_metres = WRENCH[:3] / 4.4482216152605, WRENCH[3:] / 0.1129848290276167
    expected = np.round([*(1000.0 * newtons), *(50.0 * newton_metres)])
    np.testing.assert_array_equal(record[3:], expected)
    assert record[2] == 0


def test_reading_is_asked_for_the_times_of_the_records(client):
    times = []

    def read(t):
        times.append(t)
        return WRENCH

    with running_box(read, rate=500) as box:
        stream(client, box, 20)
    np.testing.assert_allclose(np.diff(times), 0.002, atol=1e-9)


def test_a_buffered_stream_packs_records(client):
    with running_box(rate=1000, records=4) as box:
        ask(client, box, BUFFERED, 10)
        packs = [receive(client)[0] for _ in range(3)]
        assert [[r[0] for r in pack] for pack in packs] == [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10]]


def test_an_axias_own_start_works_too(client):
    with running_box(family="axia", rate=1000) as box:
        assert len(stream(client, box, 2, AXIA)) == 2


@pytest.mark.parametrize("command", [STOP, LATCH, BIAS])
def test_every_other_command_ends_the_stream(client, command):
    with running_box(rate=500) as box:
        ask(client, box, START)
        receive(client)
        ask(client, box, command)
        until(lambda: box.client is None)


def test_bias_takes_the_present_reading_off(client):
    with running_box(rate=1000) as box:
        ask(client, box, BIAS)
        assert stream(client, box, 1)[0][3:] == (0,) * 6
        box.restart()
        np.testing.assert_array_equal(stream(client, box, 1)[0][3:], np.round(WRENCH * 1e6))


def test_a_latched_condition_is_a_warning_until_it_is_reset(client):
    with running_box(rate=1000) as box:
        box.latched = True
        assert stream(client, box, 1)[0][2] == 0x80010000
        ask(client, box, LATCH)
        assert stream(client, box, 1)[0][2] == 0


def test_a_second_client_takes_the_stream(client):
    with running_box(rate=500) as box, client_socket() as second:
        ask(client, box, START)
        receive(client)
        ask(second, box, START)
        assert receive(second)[0][0][0] == 1
        assert box.client == second.getsockname()


def test_what_is_no_request_is_passed_over(client):
    with running_box(rate=1000) as box:
        for junk in (b"", b"\x12\x34\x00\x02", b"\x43\x21\x00\x02\x00\x00\x00\x00", bytes(100)):
            client.sendto(junk, ("127.0.0.1", box.rdt_port))
        ask(client, box, 0x0099)
        assert len(stream(client, box, 2)) == 2


@pytest.mark.parametrize(
    ("family", "flagged"), [("net f/t", 0x80020000), ("axia", 0xC0000000), ("onrobot", 0x80020000)]
)
def test_beyond_its_range_a_reading_is_clipped_and_flagged(client, family, flagged):
    wrench = np.array([0.0, -150.0, 0.0, 0.0, 0.0, 6.0])
    with running_box(lambda t: wrench, family=family, rate=1000) as box:
        (record,) = stream(client, box, 1)
    assert record[2] == flagged
    assert record[3:] == (0, -145_000_000, 0, 0, 0, 5_000_000)


def test_onrobot_takes_its_period_filter_and_bias_over_udp(client):
    with running_box(family="onrobot") as box:
        assert (box.http_port, box.tcp_port) == (0, 0)
        ask(client, box, 0x0082, 4)
        ask(client, box, 0x0081, 5)
        ask(client, box, BIAS, 255)
        assert stream(client, box, 1)[0][3:] == (0,) * 6
        assert (box.rate, box.low_pass) == (250, 5)
        ask(client, box, BIAS, 0)
        assert stream(client, box, 1)[0][3:] != (0,) * 6


def test_rates_are_rounded_up_to_what_divides_the_internal_one():
    assert rounded_up(1) == (1, 1.0)
    assert rounded_up(100) == (100, 100.0)
    assert rounded_up(300) == (304, pytest.approx(7000 / 23))
    assert rounded_up(3501) == (7000, 7000.0)
    assert rounded_up(9000) == (7000, 7000.0)


def page(box, path):
    with urllib.request.urlopen(f"http://127.0.0.1:{box.http_port}/{path}", timeout=10) as reply:
        return reply.read()


def test_the_page_has_what_clients_read():
    with running_box() as box:
        root = ET.fromstring(page(box, "netftapi2.xml"))
    fields = {element.tag: element.text for element in root}
    assert root.tag == "netft"
    assert len(fields) == len(root)
    assert fields["prodname"] == "Net F/T"
    assert (fields["cfgcpf"], fields["cfgcpt"]) == ("1000000", "1000000")
    assert (fields["scfgfu"], fields["scfgtu"]) == ("N", "N-m")
    assert fields["cfgmr"] == "145;145;290;5;5;5"
    assert (fields["comrdte"], fields["comrdtrate"], fields["runrate"]) == (
        "Enabled",
        "1000",
        "7000",
    )


def test_the_calibrations_page_has_scale_and_serial_number():
    with running_box(serial="FT1 <&>") as box:
        root = ET.fromstring(page(box, "netftcalapi.xml"))
    assert root.tag == "netftCalibration"
    assert root.findtext("calcpf") == "1000000"
    assert root.findtext("calsn") == "FT1 <&>"


def test_settings_are_changed_by_their_pages(client):
    with running_box() as box:
        page(box, "comm.cgi?comrdtrate=300&comrdtbsiz=7")
        page(box, "setting.cgi?setuserfilter=4")
        page(box, "setting.cgi?setbias2=1000")
        assert (box.rate, box.records, box.low_pass) == (304, 7, 4)
        assert stream(client, box, 1)[0][5] == round(WRENCH[2] * 1e6) - 1000


@pytest.mark.parametrize(
    "path",
    [
        "index.htm",
        "comm.cgi",
        "comm.cgi?commrdtrate=100",
        "comm.cgi?comrdtrate=0",
        "comm.cgi?comrdtrate=fast",
        "setting.cgi?setuserfilter=13",
    ],
)
def test_a_page_or_setting_that_is_not_there_is_an_error(path):
    with running_box() as box:
        with pytest.raises(urllib.error.HTTPError) as caught:
            page(box, path)
        caught.value.close()
        assert caught.value.code in (400, 404)
        assert (box.rate, box.low_pass) == (1000, 0)


def test_tcp_tells_calibration_and_reading():
    with (
        running_box() as box,
        socket.create_connection(("127.0.0.1", box.tcp_port), timeout=10) as connection,
    ):
        connection.sendall(bytes([1]) + bytes(19))
        reply = connection.recv(24, socket.MSG_WAITALL)
        magic, force, torque, per_force, per_torque, *factors = struct.unpack(">HBBII6H", reply)
        assert (magic, force, torque, per_force, per_torque) == (0x1234, 2, 3, 10**6, 10**6)
        connection.sendall(bytes(20))
        magic, status, *values = struct.unpack(">HH6h", connection.recv(16, socket.MSG_WAITALL))
        assert (magic, status) == (0x1234, 0)
        assert (np.abs(np.array(values) * factors / 1e6 - WRENCH) <= np.array(factors) / 2e6).all()


def test_faults_are_drawn_from_the_seed_and_counted(client):
    def run(seed):
        with running_box(faults=BoxFaults(loss=0.3, seed=seed), rate=1000) as box:
            ask(client, box, START, 60)
            until(lambda: box.sender.offered == 60)
            # A datagram is counted just before it is sent: the last one may still be on its way.
            client.settimeout(0.5)
            numbers = []
            with contextlib.suppress(TimeoutError):
                while len(numbers) + box.sender.lost < 60:
                    numbers.append(receive(client)[0][0][0])
            client.settimeout(10.0)
            return numbers, box.sender.lost

    first, lost = run(1)
    assert len(first) + lost == 60
    assert lost > 5
    assert run(1)[0] == first
    assert run(2)[0] != first


def test_a_port_that_is_taken_leaves_nothing_open():
    for port in ("rdt_port", "http_port", "tcp_port"):
        with (
            running_box() as box,
            pytest.raises(OSError, match="in use"),
            running_box(**{port: getattr(box, port)}),
        ):
            pass


def test_a_box_that_was_closed_can_be_opened_at_its_ports_again_at_once():
    with running_box() as box:
        page(box, "netftapi2.xml")  # the closed connection lingers for a minute
        ports = {name: getattr(box, name) for name in ("rdt_port", "http_port", "tcp_port")}
    with running_box(**ports) as again:
        assert page(again, "netftapi2.xml")


def test_closing_twice_is_closing_once():
    with running_box() as box:
        box.close()

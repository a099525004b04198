import contextlib
import socket
import threading
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, HTTPServer

import numpy as np
import pytest

from dmpcli.control.force_sensing import Sensing
from dmpcli.errors import InputError, InstrumentError
from dmpcli.instruments.address import Address
from dmpcli.instruments.clock import MonotonicClock
from dmpcli.instruments.netft import make, stream, udp_receiver
from dmpcli.instruments.netft.driver import ATTEMPTS
from dmpcli.instruments.netft.protocol import Command, request
from dmpcli.instruments.netft.settings import Scale
from dmpcli.simulation.netft_server.faults import BoxFaults
from tests.instruments import instrument_conformance
from tests.instruments.rdt_bench import (
    WRENCH,
    client_socket,
    closed_port,
    polled,
    running_box,
    sensor_at,
    until,
)


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """A busy machine may hold the box up for longer than a loop would wait for it."""
    monkeypatch.setattr(stream, "SILENCE", 0.5)


@pytest.fixture
def box():
    with running_box() as made:
        yield made


def test_it_is_a_sensor_like_every_other():
    with running_box(faults=BoxFaults(silent_after=50)) as box, sensor_at(box) as sensor:
        clock = MonotonicClock()

        def wait(_seconds):
            # The box sends what it sends in half a second, and no more.
            until(lambda: box.client is None or len(sensor._mailbox.peek()) == 50)

        instrument_conformance.check_sensor(sensor, clock, wait)


def test_the_box_tells_what_it_is(box):
    with sensor_at(box) as sensor:
        info = sensor.open()
        assert (info.make, info.product, info.serial) == (
            "ATI",
            "Net F/T Mini45 SI-145-5",
            "FT00000",
        )
        assert info.rate == 7000.0
        np.testing.assert_array_equal(info.limit, box.settings.limit)


def test_readings_come_in_newtons_to_the_count(box):
    with sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        samples = polled(sensor, 5)
    for sample in samples:
        np.testing.assert_allclose(sample.wrench, WRENCH, atol=1e-12)
        assert sample.healthy
    assert [sample.seq for sample in samples] == list(range(1, len(samples) + 1))
    assert (np.diff([sample.t for sample in samples]) > 0).all()


def test_units_and_scale_are_the_boxs_not_assumed():
    scale = Scale(123_456.0, 65_432.0, "lbf", "lbf-in")
    with running_box(scale=scale) as box, sensor_at(box) as sensor:
        info = sensor.open()
        np.testing.assert_allclose(info.limit, box.settings.limit, rtol=1e-8)
        sensor.start(100.0)
        (sample, *_) = polled(sensor, 1)
    counts = sample.wrench / (
        [4.4482216152605 / 123_456.0] * 3 + [0.1129848290276167 / 65_432.0] * 3
    )
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    np.testing.assert_allclose(sample.wrench, WRENCH, atol=4e-5)


def test_the_rate_is_set_in_the_box_and_read_back(box):
    with sensor_at(box) as sensor:
        sensor.open()
        sensor.start(300.0)
        assert box.rate == 304  # 7000 / 23
        assert sensor.box.rate == 304.0
        sensor.start(250.0)
        assert box.rate == 250
        assert polled(sensor, 3)[0].seq == 1


def test_a_rate_that_the_box_would_round_too_far_is_refused(box):
    with sensor_at(box) as sensor:
        sensor.open()
        with pytest.raises(InstrumentError, match=r"streams at 7000 Hz where 5000 Hz is asked for"):
            sensor.start(5000.0)


def test_a_rate_that_is_to_be_kept_is_not_touched(box):
    with sensor_at(box, rate="keep") as sensor:
        assert sensor.open().rate == 1000.0
        with pytest.raises(InstrumentError, match="streams at 1000 Hz where 100 Hz is asked for"):
            sensor.start(100.0)
        sensor.start(1000.0)
        assert polled(sensor, 20)[-1].lost == 0
        assert box.rate == 1000


def test_a_buffered_stream_gives_the_same_samples():
    with running_box(records=4) as box, sensor_at(box, buffered="yes") as sensor:
        sensor.open()
        sensor.start(500.0)
        samples = polled(sensor, 12)
        assert [sample.seq for sample in samples] == list(range(1, len(samples) + 1))
        assert (np.diff([sample.t for sample in samples]) > 0).all()
        assert len(samples) % 4 == 0


def test_a_buffer_that_takes_too_long_to_fill_is_refused():
    with running_box(records=40) as box, sensor_at(box, buffered="yes") as sensor:
        sensor.open()
        with pytest.raises(InstrumentError, match=r"40 records take 0\.4 s at 100 Hz"):
            sensor.start(100.0)


def test_a_low_pass_is_set_only_where_it_is_asked_for(box):
    box.low_pass = 3
    with sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        assert (box.low_pass, sensor.box.low_pass) == (3, 3)
    with sensor_at(box, filter="4") as sensor:
        sensor.open()
        sensor.start(100.0)
        assert (box.low_pass, sensor.box.low_pass) == (4, 4)


def test_a_bias_is_sent_only_where_it_is_asked_for_and_the_stream_goes_on_after(box):
    with sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        assert not box.bias().any()
    with sensor_at(box, bias="1") as sensor:
        sensor.open()
        sensor.start(100.0)
        for sample in polled(sensor, 3):
            np.testing.assert_allclose(sample.wrench, 0.0, atol=1e-12)
    np.testing.assert_array_equal(box.bias(), np.round(WRENCH * 1e6))


def test_a_lost_request_to_start_is_sent_again():
    with running_box(faults=BoxFaults(lost_starts=2)) as box, sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        assert box.faults.lost_starts == 0
        assert polled(sensor, 2)[0].seq == 1


def test_a_box_that_never_streams_is_given_up():
    with running_box(faults=BoxFaults(lost_starts=1000)) as box, sensor_at(box) as sensor:
        sensor.open()
        with pytest.raises(
            InstrumentError, match=r"sends nothing after 10 requests to UDP port \d+"
        ):
            sensor.start(100.0)
        assert box.faults.lost_starts == 1000 - ATTEMPTS


def test_a_silent_box_is_a_fault_that_stays():
    with running_box(faults=BoxFaults(silent_after=3)) as box, sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        assert len(polled(sensor, 3)) == 3
        message = fault(sensor)
        assert message.startswith("sensor netft://127.0.0.1: silent for ")
        assert "another client may have taken the stream" in message
        assert fault(sensor) == message


def test_a_stolen_stream_is_a_fault_and_is_left_to_the_thief(box):
    with client_socket() as thief:
        with sensor_at(box) as sensor:
            sensor.open()
            sensor.start(100.0)
            polled(sensor, 2)
            thief.sendto(request(Command.START), ("127.0.0.1", box.rdt_port))
            assert "another client may have taken the stream" in fault(sensor)
        assert box.client == thief.getsockname()
        thief.recvfrom(100)


def test_malformed_data_is_a_fault():
    with running_box(faults=BoxFaults(silent_after=2)) as box, sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        polled(sensor, 2)
        box.faults.malformed, box.faults.loss, box.faults.silent_after = 1.0, 1.0, np.inf
        assert "malformed datagrams" in fault(sensor)


def test_what_was_not_read_in_time_is_told_as_that(box, monkeypatch):
    monkeypatch.setattr(udp_receiver, "HELD", 5)
    with sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        until(lambda: sensor._mailbox.dropped > 20)
        assert "datagrams came and were not read in time" in fault(sensor)


def test_datagrams_from_elsewhere_change_nothing():
    with running_box(faults=BoxFaults(foreign=0.7)) as box, sensor_at(box) as sensor:
        sensor.open()
        sensor.start(200.0)
        samples = polled(sensor, 30)
        assert [sample.seq for sample in samples] == list(range(1, len(samples) + 1))
        for sample in samples:
            np.testing.assert_allclose(sample.wrench, WRENCH, atol=1e-12)
        (host,) = sensor.stream.tally.foreign
        assert host.startswith("127.0.0.1:")
        assert sensor.stream.tally.foreign[host] > 5


def test_what_the_network_loses_repeats_and_reorders_is_put_right_or_counted():
    faults = BoxFaults(loss=0.15, duplication=0.15, reordering=0.15, seed=3)
    with running_box(faults=faults) as box, sensor_at(box) as sensor:
        sensor.open()
        sensor.start(500.0)
        samples = polled(sensor, 200)
    numbers = [sample.seq for sample in samples]
    assert numbers == sorted(set(numbers))
    assert samples[-1].lost == numbers[-1] - len(numbers)
    assert samples[-1].lost > 20


@pytest.mark.parametrize(
    ("family", "product", "words"),
    [
        ("net f/t", "Net F/T", "saturation or A/D error"),
        ("axia", "ATI Axia80", "force or torque out of range"),
    ],
)
def test_saturation_is_an_unhealthy_sample_and_then_a_fault(family, product, words):
    with running_box(family=family, product=product) as box, sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        polled(sensor, 1)
        box.faults.saturated = True
        samples = until(lambda: [s for s in sensor.poll() if not s.healthy])
        assert words in samples[-1].reason
        np.testing.assert_allclose(np.abs(samples[-1].wrench), box.settings.limit)
        assert words in fault(sensor)


@pytest.mark.parametrize(
    ("status", "words"),
    [(0x80004000, "watchdog timeout"), (0x80000000, "an error without a name")],
)
def test_a_serious_status_is_named(box, status, words):
    with sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        polled(sensor, 1)
        box.faults.status = status
        samples = until(lambda: [s for s in sensor.poll() if not s.healthy])
        assert words in samples[-1].reason


def test_a_latched_monitor_condition_is_a_warning(box):
    box.latched = True
    with sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        assert all(sample.healthy for sample in polled(sensor, 3))
        assert sensor.stream.tally.warnings >= 3


def test_a_stalled_sensor_is_a_fault(box):
    with sensor_at(box, patience=stream.SILENCE) as sensor:
        sensor.open()
        sensor.start(100.0)
        polled(sensor, 1)
        box.faults.stalled = True
        assert "ft_sequence stands still" in fault(sensor)


def test_a_box_that_restarted_is_a_fault(box):
    with sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        polled(sensor, 1)
        box.restart()
        assert "the box restarted" in fault(sensor)


def test_the_loop_says_what_the_sensor_says(box):
    clock = MonotonicClock()
    with sensor_at(box) as sensor:
        info = sensor.open()
        sensor.start(100.0)
        polled(sensor, 1)
        box.faults.saturated = True
        sensing = Sensing(sensor, info, 100.0, 0.02, clock)
        with pytest.raises(InstrumentError, match=r"saturation or A/D error, stopped$"):
            until(lambda: sensing.hear(sensing.newest.t) is None)


def test_the_stream_ends_with_the_sensor(box):
    with sensor_at(box) as sensor:
        sensor.open()
        sensor.start(100.0)
        assert box.client is not None
        sensor.close()
        until(lambda: box.client is None)
        assert sensor.poll() == []


def test_without_pages_scale_and_units_come_over_tcp():
    scale = Scale(5000.0, 7000.0, "kgf", "N-mm")
    with running_box(scale=scale, rate=100, limit=np.array([100.0] * 6)) as box:
        options = {"http": str(closed_port()), "range": "100,100"}
        with sensor_at(box, **options) as sensor:
            assert sensor.open().rate == 7000.0
            assert sensor.box.scale == scale
            sensor.start(100.0)
            sample = polled(sensor, 1)[0]
            assert sample.seq == 1
            np.testing.assert_allclose(sample.wrench, WRENCH, atol=2e-3)
        with sensor_at(box, **options) as sensor:
            sensor.open()
            with pytest.raises(InstrumentError, match=r"streams at about \d+ Hz where 500 Hz"):
                sensor.start(500.0)
        with sensor_at(box, **options, filter="3") as sensor:
            sensor.open()
            with pytest.raises(InstrumentError, match="filter: cannot be set"):
                sensor.start(100.0)


def test_a_scale_that_is_given_beats_the_boxs(box):
    with sensor_at(box, counts="500000,250000") as sensor:
        sensor.open()
        sensor.start(100.0)
        sample = polled(sensor, 1)[0]
    np.testing.assert_allclose(sample.wrench[:3], 2.0 * WRENCH[:3])
    np.testing.assert_allclose(sample.wrench[3:], 4.0 * WRENCH[3:])


def test_a_range_that_nobody_tells_is_asked_for(box):
    with (
        sensor_at(box, http=str(closed_port())) as sensor,
        pytest.raises(InputError, match="add range=Fx,Fy,Fz,Tx,Ty,Tz"),
    ):
        sensor.open()


def test_a_box_whose_stream_is_switched_off_is_refused(box):
    box.enabled = False
    with sensor_at(box) as sensor, pytest.raises(InstrumentError, match="is switched off"):
        sensor.open()


@contextlib.contextmanager
def serving(page):
    """A web server that answers everything with one page."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()
            self.wfile.write(page)

        def log_message(self, *args):
            pass

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server.server_port
        finally:
            server.shutdown()
            thread.join()


def unreachable(**options):
    with pytest.raises(InstrumentError) as caught:
        make(Address("sensor", "netft", **options), MonotonicClock()).open()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_nobody_at_that_address_is_one_line():
    ports = {"http": str(closed_port()), "tcp": str(closed_port())}
    message = unreachable(host="127.0.0.1", options=ports)
    assert message.startswith("sensor netft://127.0.0.1: cannot be reached (HTTP port")
    assert "connection refused" in message


def test_a_name_without_an_address_is_one_line():
    message = unreachable(host="no-such-sensor.invalid")
    assert "no-such-sensor.invalid has no address" in message


@pytest.mark.slow
def test_a_host_that_takes_a_connection_and_says_nothing_is_given_up():
    with socket.create_server(("127.0.0.1", 0)) as mute:
        port = str(mute.getsockname()[1])
        message = unreachable(host="127.0.0.1", options={"http": port, "tcp": port})
    assert message.count("timed out") == 2


def test_a_page_that_no_sensor_has_is_one_line():
    with serving(b"<html><body>Welcome to your router</body></html>") as port:
        message = unreachable(host="127.0.0.1", options={"http": str(port)})
    assert message.endswith("does not answer like a force sensor: the page gives no cfgcpf")


def test_before_it_is_open_nothing_starts_and_nothing_comes(box):
    with sensor_at(box) as sensor:
        assert sensor.poll() == []
        with pytest.raises(InstrumentError, match="is not open"):
            sensor.start(100.0)


def fault(sensor):
    """Poll until the sensor fails; return how."""
    messages = []

    def failed():
        try:
            sensor.poll()
        except InstrumentError as error:
            messages.append(str(error))
        return bool(messages)

    until(failed)
    return messages[0]


@pytest.mark.parametrize("what", ["bias", "scale", "unit"])
def test_a_box_that_is_set_otherwise_meanwhile_is_a_fault(what, box):
    with sensor_at(box, watch="0.05") as sensor:
        sensor.open()
        sensor.start(100.0)
        polled(sensor, 3)
        if what == "bias":
            box.set_bias(2, 5_000_000)
        elif what == "scale":
            box.settings = replace(box.settings, scale=Scale(1e6 + 1, 1e6, "N", "N-m"))
        else:
            box.settings = replace(box.settings, scale=Scale(1e6, 1e6, "lbf", "N-m"))
        with pytest.raises(InstrumentError, match=r"was changed, from .* to .*, stopped"):
            until(lambda: sensor.poll() is None)
        sensor.close()


def test_what_was_changed_at_the_last_moment_is_told_at_the_end(box):
    with sensor_at(box, watch="60") as sensor:
        sensor.open()
        sensor.start(100.0)
        polled(sensor, 3)
        box.set_bias(0, 7)
        with pytest.raises(
            InstrumentError, match=r"its bias was changed, from 0 .* to 7 0 0 0 0 0"
        ):
            sensor.close()
        sensor.close()


def test_a_box_that_is_not_watched_may_be_set(box):
    with sensor_at(box, watch="0") as sensor:
        sensor.open()
        sensor.start(100.0)
        box.set_bias(0, 7)
        polled(sensor, 20)


def test_a_bias_of_our_own_making_is_what_it_is_compared_with(box):
    with sensor_at(box, watch="0.05", bias="yes") as sensor:
        sensor.open()
        sensor.start(100.0)
        polled(sensor, 30)
        assert box.bias().any()


def test_the_watch_writes_nothing(box):
    before = box.bias().tolist(), box.rate, box.low_pass, box.records
    with sensor_at(box, watch="0.05", rate="keep") as sensor:
        sensor.open()
        sensor.start(float(box.rate))
        polled(sensor, 30)
    assert (box.bias().tolist(), box.rate, box.low_pass, box.records) == before


def test_a_frozen_sensor_is_a_fault(box):
    with sensor_at(box, frozen="20") as sensor:
        sensor.open()
        sensor.start(100.0)
        with pytest.raises(InstrumentError, match=r"20 readings in a row are alike.*, stopped"):
            until(lambda: sensor.poll() is None)

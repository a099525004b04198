import numpy as np
import pytest

from dmpcli.errors import InputError, InstrumentError
from dmpcli.instruments.address import Address
from dmpcli.instruments.clock import MonotonicClock
from dmpcli.instruments.netft import make
from dmpcli.instruments.netft.dialects import of, period_request
from dmpcli.instruments.netft.options import ONROBOT_SCALE
from tests.instruments.rdt_bench import WRENCH, polled, running_box, sensor_at

ONROBOT = {"dialect": "onrobot", "range": "200,10"}


@pytest.fixture
def box():
    with running_box(
        family="onrobot", scale=ONROBOT_SCALE, limit=np.array([200.0] * 3 + [10.0] * 3)
    ) as made:
        yield made


def test_periods_are_whole_milliseconds():
    assert period_request(100.0) == bytes.fromhex("1234 0082 0000000a")
    assert period_request(1000.0) == bytes.fromhex("1234 0082 00000001")
    assert period_request(4.0) == bytes.fromhex("1234 0082 000000fa")
    assert period_request(300.0) is None
    assert period_request(2000.0) is None
    assert period_request(2.0) is None


def test_readings_have_the_documented_scale(box):
    with sensor_at(box, **ONROBOT) as sensor:
        info = sensor.open()
        assert (info.make, info.rate) == ("OnRobot", 1000.0)
        sensor.start(100.0)
        assert box.rate == 100
        samples = polled(sensor, 3)
    assert samples[0].seq == 1
    np.testing.assert_allclose(samples[0].wrench, WRENCH, atol=1e-4)


def test_filter_and_bias_go_over_udp(box):
    with sensor_at(box, **ONROBOT, filter="6", bias="yes") as sensor:
        sensor.open()
        sensor.start(100.0)
        np.testing.assert_allclose(polled(sensor, 1)[0].wrench, 0.0, atol=1e-12)
    assert box.low_pass == 6


def test_a_rate_between_the_milliseconds_is_refused(box):
    with sensor_at(box, **ONROBOT) as sensor:
        sensor.open()
        with pytest.raises(InstrumentError, match="whole ms"):
            sensor.start(300.0)


def test_a_box_that_keeps_another_rate_is_found_out():
    # An ATI box does not know the request for a period.
    with running_box(scale=ONROBOT_SCALE, rate=1000) as deaf:
        address = Address("sensor", "netft", "127.0.0.1", deaf.rdt_port, ONROBOT)
        sensor = make(address, MonotonicClock())
        sensor.open()
        with pytest.raises(InstrumentError, match=r"streams at about \d+ Hz where 100 Hz"):
            sensor.start(100.0)
        sensor.close()


def test_its_range_must_be_given(box):
    with sensor_at(box, dialect="onrobot") as sensor, pytest.raises(InputError, match="add range="):
        sensor.open()


def test_any_set_bit_is_a_fault_named_by_its_number(box):
    box.faults.status = 0x5
    with sensor_at(box, **ONROBOT) as sensor:
        sensor.open()
        sensor.start(100.0)
        (sample,) = sensor.poll()
    assert not sample.healthy
    assert sample.reason == "status 0x00000005: bit 2, bit 0"


def test_the_product_decides_where_no_dialect_is_given():
    assert of(None, "ATI Axia80-M20").family == "axia"
    assert of(None, "Net F/T").family == "net f/t"
    assert of("ati", "ATI Axia80-M20").family == "net f/t"

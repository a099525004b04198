"""A client that we did not write reads the simulated box: pynetft, stopping at the first fault."""

import contextlib

import numpy as np
import pynetft
import pytest

from dmpcli.instruments.netft.settings import Scale
from dmpcli.simulation.netft_server.faults import BoxFaults
from tests.instruments.rdt_bench import WRENCH, running_box, until


@contextlib.contextmanager
def pynetft_at(box):
    config = pynetft.Config(
        sensor_host="127.0.0.1",
        rdt_port=box.rdt_port,
        http_port=box.http_port,
        receive_timeout=1.0,
        configuration_connect_timeout=5.0,
        configuration_timeout=5.0,
        recovery_policy=pynetft.RecoveryPolicy.FAIL_STOP,
    )
    with pynetft.Client(config, queue_size=10_000) as client:
        yield client


def taken(client, count):
    samples = client.samples(10.0)
    return [next(samples) for _ in range(count)]


@pytest.mark.parametrize(
    ("scale", "force_unit", "torque_unit"),
    [
        (Scale(1e6, 1e6, "N", "N-m"), pynetft.ForceUnit.NEWTON, pynetft.TorqueUnit.NEWTON_METER),
        (
            Scale(4448.0, 113.0, "lbf", "lbf-in"),
            pynetft.ForceUnit.POUND_FORCE,
            pynetft.TorqueUnit.POUND_FORCE_INCH,
        ),
    ],
)
def test_it_reads_units_scale_and_every_count(scale, force_unit, torque_unit):
    readings = np.random.default_rng(4).uniform(-1.0, 1.0, (2000, 6)) * [100, 100, 200, 4, 4, 4]
    given = []

    def read(t):
        given.append(readings[len(given) % 2000])
        return given[-1]

    with running_box(read, scale=scale, rate=500) as box:
        with pynetft_at(box) as client:
            samples = taken(client, 100)
            calibration = client.health().sensor_configuration.calibration
        assert (calibration.force_unit, calibration.torque_unit) == (force_unit, torque_unit)
        assert calibration.counts_per_force_unit == scale.counts_per_force
        assert calibration.counts_per_torque_unit == scale.counts_per_torque
    assert [sample.rdt_sequence for sample in samples] == list(range(1, 101))
    # What the pages showed was read before the first record.
    begun = len(given) - next(
        k for k in range(len(given)) if counts(given[-1 - k], scale) == samples[0].raw_wrench
    )
    for sample, wrench in zip(samples, given[begun - 1 :], strict=False):
        assert sample.raw_wrench == counts(wrench, scale)
        assert sample.status == 0
        np.testing.assert_allclose(
            np.array(sample.wrench) * scale.per_unit, wrench, atol=scale.per_count.max()
        )


def counts(wrench, scale):
    per_unit = [scale.counts_per_force] * 3 + [scale.counts_per_torque] * 3
    return tuple(round(float(value)) for value in wrench / scale.per_unit * per_unit)


def test_it_counts_what_we_lose():
    with running_box(faults=BoxFaults(loss=0.2, seed=5), rate=500) as box:
        with pynetft_at(box) as client:
            samples = taken(client, 100)
        missing = samples[-1].rdt_sequence - samples[0].rdt_sequence + 1 - len(samples)
        assert missing > 5
        assert client.health().lost_count >= missing
        np.testing.assert_array_equal(samples[0].raw_wrench, np.round(WRENCH * 1e6))


@pytest.mark.parametrize(
    ("faults", "counter"),
    [
        ({"duplication": 0.1}, "duplicate_count"),
        ({"reordering": 0.1}, "out_of_order_count"),
        ({"stalled": True}, "ft_stall_count"),
    ],
)
def test_it_stops_at_a_counter_that_does_not_go_on_and_says_why(faults, counter):
    with (
        running_box(faults=BoxFaults(**faults, seed=6), rate=500) as box,
        pynetft_at(box) as client,
    ):
        health = faulted(client)
    assert health.fault_code in (pynetft.FaultCode.FT_STALL, pynetft.FaultCode.FT_BACKWARD)
    assert getattr(health, counter) == 1


def faulted(client):
    until(lambda: client.health().state is pynetft.ClientState.FAULTED)
    return client.health()


def test_it_stops_at_our_saturation():
    with running_box(rate=500) as box, pynetft_at(box) as client:
        taken(client, 5)
        box.faults.saturated = True
        health = faulted(client)
        assert health.fault_code is pynetft.FaultCode.SERIOUS_STATUS
        assert health.last_status == 0x80020000


def test_it_stops_at_our_silence():
    with running_box(rate=500, faults=BoxFaults(silent_after=20)) as box, pynetft_at(box) as client:
        assert len(taken(client, 20)) == 20
        assert faulted(client).fault_code is pynetft.FaultCode.TIMEOUT


def test_it_stops_at_our_malformed_data():
    with running_box(rate=500) as box, pynetft_at(box) as client:
        taken(client, 5)
        box.faults.malformed = box.faults.loss = 1.0
        assert faulted(client).fault_code is pynetft.FaultCode.MALFORMED_STORM


def test_it_passes_over_our_warning():
    with running_box(rate=500) as box, pynetft_at(box) as client:
        box.latched = True
        until(lambda: client.health().warning_count > 5)
        assert client.health().fault_code is pynetft.FaultCode.NONE


def test_its_bias_is_ours():
    with running_box(rate=500) as box, pynetft_at(box) as client:
        taken(client, 5)
        client.bias()
        until(lambda: client.latest_sample().raw_wrench == (0,) * 6)

"""A simulated sensor box on loopback, and what the tests of both its ends need."""

import contextlib
import socket
import time
from unittest import mock

import numpy as np

from dmpcli.instruments.address import Address
from dmpcli.instruments.clock import MonotonicClock
from dmpcli.instruments.netft import make, stream
from dmpcli.simulation.netft_server.box import RdtBox
from dmpcli.simulation.netft_server.faults import BoxFaults
from dmpcli.simulation.netft_server.settings import BoxSettings

WRENCH = np.array([1.5, -2.25, 30.125, 0.1, -0.2, 0.3])


def until(condition, patience=10.0):
    """Wait for what must come to be; a slow machine may take its time."""
    give_up = time.monotonic() + patience
    while not (found := condition()):
        assert time.monotonic() < give_up, "waited in vain"
        time.sleep(0.001)
    return found


@contextlib.contextmanager
def running_box(read=lambda t: WRENCH, faults=None, **settings):
    box = RdtBox(read, BoxSettings(**settings), faults or BoxFaults())
    box.start()
    try:
        yield box
    finally:
        box.close()


@contextlib.contextmanager
def sensor_at(box, patience=3.0, **options):
    """Make a sensor that listens to a box; box and sensor share a process, which may be held up."""
    patience = stream.SILENCE if np.isfinite(box.faults.silent_after) else patience
    ports = {"http": str(box.http_port), "tcp": str(box.tcp_port)} if box.settings.pages else {}
    # These boxes read one and the same wrench, unless a test says another.
    given = {"frozen": "0", **ports, **options}
    address = Address("sensor", "netft", "127.0.0.1", box.rdt_port, given)
    sensor = make(address, MonotonicClock())
    with mock.patch.object(stream, "SILENCE", patience):
        try:
            yield sensor
        finally:
            sensor.close()


def polled(sensor, count):
    """Poll until so many samples have come."""
    samples = []

    def enough():
        samples.extend(sensor.poll())
        return len(samples) >= count

    until(enough)
    return samples


@contextlib.contextmanager
def client_socket():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as endpoint:
        endpoint.bind(("127.0.0.1", 0))
        endpoint.settimeout(10.0)
        yield endpoint


def closed_port():
    """A port that nobody listens on."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as endpoint:
        endpoint.bind(("127.0.0.1", 0))
        return endpoint.getsockname()[1]

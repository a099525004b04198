import socket
import struct
import time
import types

import pytest

from dmpcli.instruments.clock import MonotonicClock
from dmpcli.instruments.netft import udp_receiver
from dmpcli.instruments.netft.udp_receiver import UdpReceiver
from tests.instruments.rdt_bench import client_socket, until

STAMP = (socket.SOL_SOCKET, 35)


@pytest.fixture
def box():
    made = UdpReceiver(MonotonicClock())
    yield made
    made.close()


def exchange(box, peer, *contents):
    """Let the peer send what the box then holds."""
    box.send(b"hello", peer.getsockname())
    _, address = peer.recvfrom(100)
    address = ("127.0.0.1", address[1])
    for content in contents:
        peer.sendto(content, address)
    until(lambda: len(box.peek()) >= len(contents))


def test_datagrams_come_in_order_with_their_source(box):
    with client_socket() as peer:
        exchange(box, peer, b"one", b"", b"three")
        letters = box.take()
        assert [letter.content for letter in letters] == [b"one", b"", b"three"]
        assert {letter.source for letter in letters} == {peer.getsockname()}
        assert box.take() == []


def test_the_time_is_that_of_arrival_not_of_reading(box):
    with client_socket() as peer:
        before = time.monotonic()
        exchange(box, peer, b"one", b"two")
        after = time.monotonic()
        time.sleep(0.02)
        first, second = box.take()
        assert before - 1e-3 <= first.t <= second.t <= after + 1e-3


def test_closing_twice_is_closing_once(box):
    box.close()
    box.close()


def test_closing_does_not_depend_on_the_datagram_that_wakes_the_thread(monkeypatch):
    made = UdpReceiver(MonotonicClock())

    class Mute:
        """The socket of a computer that may not send to itself."""

        def __getattr__(self, name):
            return getattr(real, name)

        def sendto(self, *_):
            raise OSError("not permitted")

    real, made._socket = made._socket, Mute()
    made.close()
    assert not made._thread.is_alive()


def test_a_thread_that_does_not_end_is_not_waited_for_without_end():
    made, joined = UdpReceiver(MonotonicClock()), []
    thread = made._thread
    made._thread = types.SimpleNamespace(join=joined.append)
    made.close()
    assert joined[0] <= 1.0
    thread.join()


def test_what_nobody_takes_is_not_kept_for_ever(box, monkeypatch):
    monkeypatch.setattr(udp_receiver, "HELD", 3)
    small = UdpReceiver(MonotonicClock())
    with client_socket() as peer:
        exchange(small, peer, b"1", b"2", b"3")
        peer_address = small._socket.getsockname()[1]
        peer.sendto(b"4", ("127.0.0.1", peer_address))
        until(lambda: small.peek()[-1].content == b"4")
    assert [letter.content for letter in small.take()] == [b"2", b"3", b"4"]
    assert small.dropped == 1
    small.close()


def stamped(age):
    seconds, nanoseconds = divmod(time.time_ns() - round(age * 1e9), 1_000_000_000)
    return [(*STAMP, struct.pack("@qq", seconds, nanoseconds))]


def test_a_datagrams_age_is_read_from_the_kernels_stamp():
    assert udp_receiver._age(stamped(0.25)) == pytest.approx(0.25, abs=0.2)


@pytest.mark.parametrize("age", [-3600.0, 3600.0])
def test_a_wall_clock_that_was_set_makes_no_sample_old_or_early(age):
    assert udp_receiver._age(stamped(age)) == 0.0


@pytest.mark.parametrize("extra", [[], [(0, 0, bytes(16))], [(*STAMP, bytes(3))]])
def test_without_a_stamp_a_datagram_is_new(extra):
    assert udp_receiver._age(extra) == 0.0

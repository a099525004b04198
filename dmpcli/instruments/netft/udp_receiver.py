"""A thread that takes datagrams out of the socket as they come, with the kernel's own time stamp.

A socket's buffer holds a few hundred datagrams and then drops the newest; a loop that waits longer
(a zero taken at rest, at 1 kHz) would lose what it waits for. So a thread empties it. The thread
does nothing else: when Python lets it run is of no consequence, since the kernel has stamped every
datagram on arrival, and whoever polls decodes.
"""

import contextlib
import socket
import struct
import threading
import time
from collections import deque
from dataclasses import dataclass

from dmpcli.instruments.protocols import Clock

HELD = 20_000
"""Datagrams kept for a poll that does not come; then the oldest are dropped."""

_LARGEST = 65535
_TIMESPEC = struct.Struct("@qq")
_SO_TIMESTAMPNS = 35  # Linux; the socket module has no name for it
_LONGEST_AGE = 1.0
_PAUSE = 0.01
_LOOK_UP, _PATIENCE = 0.2, 1.0  # how often the thread looks whether it is to end, and is waited for


@dataclass(frozen=True)
class Datagram:
    """One datagram.

    Attributes
    ----------
    t : float
        When it arrived, s, on the loop's clock; never before the one that came before it.
    source : tuple
        Address and port that sent it.
    content : bytes
    """

    t: float
    source: tuple[str, int]
    content: bytes


class UdpReceiver:
    """A UDP socket and the thread that empties it.

    Parameters
    ----------
    clock : Clock

    Attributes
    ----------
    dropped : int
        Datagrams that nobody took in time.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.dropped = 0
        self._letters: deque[Datagram] = deque(maxlen=HELD)
        self._last = -float("inf")
        self._closing = False
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        with contextlib.suppress(OSError):  # without stamps, the time of reading has to do
            self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        self._socket.bind(("", 0))
        self._socket.settimeout(_LOOK_UP)
        self._thread = threading.Thread(target=self._empty, name="netft", daemon=True)
        self._thread.start()

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        """Send one datagram; OSError where there is no way to that address."""
        self._socket.sendto(datagram, address)

    def take(self) -> list[Datagram]:
        """Hand out what has arrived since the last call, oldest first; never waits."""
        letters: list[Datagram] = []
        with contextlib.suppress(IndexError):
            while True:
                letters.append(self._letters.popleft())
        return letters

    def peek(self) -> tuple[Datagram, ...]:
        """What the next `take` will hand out."""
        return tuple(self._letters)

    def close(self) -> None:
        """Stop the thread and close the socket; may be called twice."""
        if self._closing:
            return
        self._closing = True
        with contextlib.suppress(OSError):
            # Wakes the thread, which waits for a datagram; without this it takes a little longer.
            self._socket.sendto(b"", ("127.0.0.1", self._socket.getsockname()[1]))
        self._thread.join(_PATIENCE)
        self._socket.close()

    def _empty(self) -> None:
        while not self._closing:
            try:
                content, extra, _, source = self._socket.recvmsg(_LARGEST, 64)
            except TimeoutError:
                continue
            except OSError:
                # What is wrong with the network shows as silence, which the driver names.
                time.sleep(_PAUSE)
                continue
            arrived = self._clock.now() - _age(extra)
            self._last = max(arrived, self._last)
            self.dropped += 1 if len(self._letters) == self._letters.maxlen else 0
            self._letters.append(Datagram(self._last, source, content))


def _age(extra: list[tuple[int, int, bytes]]) -> float:
    """How long ago the kernel took a datagram in, s; 0 where it does not say."""
    for level, kind, data in extra:
        if (level, kind) == (socket.SOL_SOCKET, _SO_TIMESTAMPNS) and len(data) == _TIMESPEC.size:
            seconds, nanoseconds = _TIMESPEC.unpack(data)
            age = (time.time_ns() - 1_000_000_000 * seconds - nanoseconds) * 1e-9
            # The stamp is on the wall clock, which may be set at any moment.
            return age if 0.0 <= age <= _LONGEST_AGE else 0.0
    return 0.0

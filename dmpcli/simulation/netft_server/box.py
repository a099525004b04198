"""A simulated force/torque sensor box: RDT over UDP, web pages, and the TCP interface.

It serves one client at a time, as the real one does: a request from another one takes the stream
over, and any command ends the stream that runs (manual 9620-05-Net FT, section 12.3).
"""

import contextlib
import select
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.instruments.netft import protocol
from dmpcli.instruments.netft.protocol import Command
from dmpcli.simulation.netft_server.faults import BoxFaults
from dmpcli.simulation.netft_server.pages import Pages
from dmpcli.simulation.netft_server.sender import Sender
from dmpcli.simulation.netft_server.settings import BoxSettings
from dmpcli.simulation.netft_server.state import BoxState
from dmpcli.simulation.netft_server.tcp import BoxTcp

_STARTS = (Command.START, Command.START_AXIA, Command.START_BUFFERED)
_LATEST = 0.5


@dataclass
class _Request:
    """A stream that runs."""

    client: tuple[str, int]
    left: float
    records: int
    begun: float
    period: float
    number: int = 0

    @property
    def size(self) -> int:
        """Records in the next datagram."""
        return int(min(self.records, self.left))

    @property
    def due(self) -> float:
        """When the next datagram is: with its last record."""
        return self.begun + (self.number + self.size) * self.period


class RdtBox(BoxState):
    """The box.

    Parameters
    ----------
    read, settings, faults
        As in `BoxState`.

    Attributes
    ----------
    sender : Sender
        Counts the faults that were done, from `start` on.
    rdt_port, http_port, tcp_port : int
        As bound by `start`; 0 for those that an OnRobot box does not have.
    """

    def __init__(
        self,
        read: Callable[[float], Floats],
        settings: BoxSettings | None = None,
        faults: BoxFaults | None = None,
    ) -> None:
        super().__init__(read, settings, faults)
        self.rdt_port = self.http_port = self.tcp_port = 0
        self._started = self._sampled = self._powered
        self._request: _Request | None = None
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Bind the ports and begin to serve; OSError where a port is taken."""
        s = self.settings
        with contextlib.ExitStack() as bound:
            self._socket = bound.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            self._socket.bind((s.host, s.rdt_port))
            self._socket.setblocking(False)
            self.rdt_port = int(self._socket.getsockname()[1])
            self.sender = Sender(self._socket, self.faults, s.host)
            bound.callback(self.sender.close)
            if s.pages:
                pages = Pages(self)
                bound.callback(pages.close)
                self.http_port = pages.port
                tcp = BoxTcp(self)
                bound.callback(tcp.close)
                self.tcp_port = tcp.port
            self._wake, self._woken = socket.socketpair()
            bound.callback(self._wake.close)
            bound.callback(self._woken.close)
            self._bound = bound.pop_all()
        self._started = self._powered = time.monotonic()
        self._thread = threading.Thread(target=self._serve, name="rdt box", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop serving; may be called twice."""
        if self._thread is None:
            return
        self._wake.send(b"x")
        self._thread.join()
        self._thread = None
        self._bound.close()

    @property
    def client(self) -> tuple[str, int] | None:
        """Who is being streamed to."""
        request = self._request
        return None if request is None else request.client

    def _serve(self) -> None:
        while True:
            request = self._request
            wait = None if request is None else max(request.due - time.monotonic(), 0.0)
            ready, _, _ = select.select([self._socket, self._woken], [], [], wait)
            if self._woken in ready:
                return
            if self._socket in ready:
                self._obey()
            if self._request is not None:
                self._stream(self._request)

    def _obey(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                datagram, client = self._socket.recvfrom(2048)
                asked = protocol.parse_request(datagram)
                if asked is not None:
                    self._command(*asked, client)

    def _command(self, command: int, count: int, client: tuple[str, int]) -> None:
        onrobot = self.settings.family == "onrobot"
        if command in _STARTS:
            self._begin(command, count, client)
        elif onrobot and command == Command.PERIOD and count:
            self.rate, self._true_rate = round(1000.0 / count), 1000.0 / count
        elif onrobot and command == Command.FILTER:
            self.low_pass = count
        elif command in (Command.STOP, Command.RESET_LATCH, Command.BIAS):
            self._request = None
            if command == Command.RESET_LATCH:
                self.latched = False
            elif command == Command.BIAS:
                self._bias[:] = 0
                if count or not onrobot:
                    self._bias[:] = self.reading(time.monotonic())[0]

    def _begin(self, command: int, count: int, client: tuple[str, int]) -> None:
        if self.faults.lost_starts > 0:
            self.faults.lost_starts -= 1
        elif self.enabled:
            self.sender.forget()
            self._request = _Request(
                client,
                left=count or np.inf,
                records=self.records if command == Command.START_BUFFERED else 1,
                begun=time.monotonic(),
                period=1.0 / self._true_rate,
            )

    def _stream(self, request: _Request) -> None:
        """Send what is due: at absolute deadlines, so that a late one makes no later one late."""
        now = time.monotonic()
        if now - request.due > _LATEST:
            # The computer slept; a real box would have gone on.
            request.number = int((now - request.begun) / request.period)
        while request.due <= now:
            datagram = b"".join(self._record(request) for _ in range(request.size))
            speaks = now - self._started < self.faults.silent_at
            if speaks and request.number <= self.faults.silent_after:
                self.sender.send(datagram, request.client)
            if request.left <= 0:
                self._request = None
                return

    def _record(self, request: _Request) -> bytes:
        request.number += 1
        request.left -= 1
        if not self.faults.stalled:
            self._sampled = request.begun + request.number * request.period
        counts, status = self.reading(self._sampled)
        passed = self.passed(self._sampled)
        return protocol.encode(request.number, passed, status, counts)

"""Wires in simulated time: TCP connections and datagrams that behave like the system's own."""

import socket
from collections import deque
from collections.abc import Callable

from dmpcli.errors import InstrumentError
from dmpcli.instruments.netft.udp_receiver import HELD, Datagram
from tests.faults.world import World


class Connection:
    """One end of a TCP connection, with the methods of a socket that the drivers use.

    Parameters
    ----------
    world : World
    receive : callable
        What the other end does with bytes that arrive there.
    """

    def __init__(self, world: World, receive: Callable[[bytes], None]) -> None:
        self._world, self._receive = world, receive
        self._timeout: float | None = None
        self._inbox = bytearray()
        self._cut = self._closed = False
        self.delay = 2e-4  # s, one way
        self.heard: Callable[[], None] = lambda: None

    @property
    def closed(self) -> bool:
        """Whether nothing passes any more, at either end."""
        return self._closed or self._cut

    def settimeout(self, timeout: float | None) -> None:
        """As of a socket."""
        self._timeout = timeout

    def setsockopt(self, *_: object) -> None:
        """Nothing to set."""

    def sendall(self, content: bytes) -> None:
        """Send; what is on its way arrives, also after the connection is closed."""
        if self.closed:
            raise BrokenPipeError(32, "Broken pipe")
        self._world.at(self._world.now() + self.delay, lambda: self._receive(content))

    def recv(self, size: int, flags: int = 0) -> bytes:
        """Wait for bytes for as long as the timeout says."""
        now = self._world.now()
        patience = 3600.0 if self._timeout is None else self._timeout
        if not self._inbox and not self.closed:
            self._world.wait(lambda: self._inbox or self.closed, now + patience)
        if self._inbox:
            content = bytes(self._inbox[:size])
            if not flags & socket.MSG_PEEK:
                del self._inbox[:size]
            return content
        if self.closed:
            return b""
        if self._timeout == 0.0:
            raise BlockingIOError(11, "Resource temporarily unavailable")
        raise TimeoutError("timed out")

    def drained(self) -> bytes:
        """Return what has arrived, without waiting."""
        content = bytes(self._inbox)
        self._inbox.clear()
        return content

    def shutdown(self, _: int) -> None:
        """As of a socket."""
        self._closed = True

    def close(self) -> None:
        """As of a socket."""
        self._closed = True

    def put(self, content: bytes, delay: float | None = None) -> None:
        """Send from the other end."""

        def arrive() -> None:
            if not self.closed:
                self._inbox += content
                self.heard()

        if not self.closed:
            self._world.at(self._world.now() + (self.delay if delay is None else delay), arrive)

    def cut(self) -> None:
        """End the connection from the other end."""
        self._cut = True
        self.heard()


class Exchange:
    """Who listens where.

    Parameters
    ----------
    world : World
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self.services: dict[int, Callable[[], Connection]] = {}
        self.made: dict[int, list[Connection]] = {}
        self.refuses = False

    def connect(self, host: str, port: int, patience: float, what: str) -> Connection:
        """Stand in for `dmpcli.instruments.sockets.connect`."""
        del host
        if self.refuses:
            self._world.sleep(patience)
            raise InstrumentError(f"{what}: cannot be reached (no answer); check address")
        self._world.sleep(5e-4)
        made = self.services[port]()
        self.made.setdefault(port, []).append(made)
        return made

    def cut(self, port: int) -> None:
        """End all connections to a port."""
        for each in self.made.get(port, ()):
            each.cut()


class Mailbox:
    """Stands in for `UdpReceiver`: datagrams as they come, none from a thread.

    Parameters
    ----------
    world : World
    out : callable
        Takes a datagram that is sent, and whom it comes from.
    """

    ADDRESS = ("127.0.0.1", 50_000)

    def __init__(self, world: World, out: Callable[[bytes, "Mailbox"], None]) -> None:
        self._world, self._out = world, out
        self._held: deque[Datagram] = deque(maxlen=HELD)
        self._closed = False
        self.dropped = 0

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        """Send one datagram."""
        del address
        self._world.at(self._world.now() + 2e-4, lambda: self._out(datagram, self))

    def sendto(self, datagram: bytes, source: tuple[str, int], delay: float = 2e-4) -> None:
        """Have a datagram arrive."""

        def arrive() -> None:
            if not self._closed:
                self.dropped += len(self._held) == HELD
                self._held.append(Datagram(self._world.now(), source, datagram))

        self._world.at(self._world.now() + delay, arrive)

    def take(self) -> list[Datagram]:
        """As of a `UdpReceiver`."""
        taken = list(self._held)
        self._held.clear()
        return taken

    def peek(self) -> tuple[Datagram, ...]:
        """As of a `UdpReceiver`."""
        return tuple(self._held)

    def close(self) -> None:
        """As of a `UdpReceiver`."""
        self._closed = True

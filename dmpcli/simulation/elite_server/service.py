"""TCP services of the virtual controller: one thread accepts, one serves each client."""

import contextlib
import errno
import os
import socket
import threading
import time
from collections.abc import Callable

from dmpcli.errors import DmpError, InputError, InstrumentError
from dmpcli.simulation.elite_server import rpc
from dmpcli.simulation.elite_server.lab import VirtualLab
from dmpcli.simulation.elite_server.monitor import PERIOD
from dmpcli.simulation.elite_server.parameters import RpcError

_PATIENCE = 5.0  # s that a client may take to read what it is sent


def unbound(name: str, host: str, port: int, error: OSError | UnicodeError) -> DmpError:
    """Return why a service cannot be had, by the option that is to blame.

    Parameters
    ----------
    name : str
        Of the service; its option is ``--NAME-port``.
    host : str
    port : int
    error : OSError or UnicodeError
    """
    number = getattr(error, "errno", None)  # below 0 of the resolver
    if number is None or number < 0 or number == errno.EADDRNOTAVAIL:
        return InputError(
            f"--host {host}: is no address of this computer; leave it out to serve loopback alone"
        )
    return InstrumentError(
        f"--{name}-port {port} on {host}: {os.strerror(number)}; 0 takes a free one"
    )


class TcpService:
    """Listens on one port and serves every client in a thread of its own.

    Parameters
    ----------
    name : str
        For messages.
    host : str
    port : int
        0 asks for a free one.
    serve : callable
        Serves one connected socket until the client is gone or an OSError says so.

    Attributes
    ----------
    port : int
        As bound.

    Raises
    ------
    InputError, InstrumentError
        The host is not this computer's; the port cannot be had.
    """

    def __init__(
        self, name: str, host: str, port: int, serve: Callable[[socket.socket], None]
    ) -> None:
        self._serve = serve
        self._clients: set[socket.socket] = set()
        self._guard = threading.Lock()
        self._closed = False
        try:
            self._listener = socket.create_server((host, port))
        except (OSError, UnicodeError) as error:
            raise unbound(name, host, port, error) from None
        self.port = int(self._listener.getsockname()[1])
        self._thread = threading.Thread(target=self._accept, name=name, daemon=True)
        self._thread.start()

    def drop(self) -> None:
        """Cut the connections that there are now."""
        with self._guard:
            clients = list(self._clients)
        for client in clients:
            with contextlib.suppress(OSError):
                client.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Serve no longer; may be called twice."""
        self._closed = True
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.drop()
        self._thread.join(timeout=_PATIENCE)

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            with self._guard:
                self._clients.add(client)
            if self._closed:
                self._leave(client)
                return
            threading.Thread(target=self._attend, args=(client,), daemon=True).start()

    def _attend(self, client: socket.socket) -> None:
        try:
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._serve(client)
        except OSError:
            pass  # the client is gone, or is slower than one may be
        finally:
            self._leave(client)

    def _leave(self, client: socket.socket) -> None:
        with self._guard:
            self._clients.discard(client)
        client.close()


class ControllerService:
    """The virtual EC66 on its two ports.

    Parameters
    ----------
    lab : VirtualLab
    host : str
    robot_port, monitor_port : int
        JSON-RPC and monitor; 0 asks for a free one.

    Attributes
    ----------
    robot_port, monitor_port : int
        As bound.

    Raises
    ------
    InputError, InstrumentError
        The host is not this computer's; a port cannot be had.
    """

    def __init__(
        self, lab: VirtualLab, host: str = "127.0.0.1", robot_port: int = 0, monitor_port: int = 0
    ) -> None:
        self._lab = lab
        self._robot = TcpService("robot", host, robot_port, self._serve_requests)
        try:
            self._monitor = TcpService("monitor", host, monitor_port, self._serve_frames)
        except DmpError:
            self._robot.close()
            raise
        self.robot_port, self.monitor_port = self._robot.port, self._monitor.port
        lab.drop = self.drop

    def drop(self, which: str = "both") -> None:
        """Cut the connections of ``robot``, ``monitor`` or ``both``."""
        for name, service in (("robot", self._robot), ("monitor", self._monitor)):
            if which in (name, "both"):
                service.drop()

    def close(self) -> None:
        """Serve no longer; may be called twice."""
        self._robot.close()
        self._monitor.close()

    def _serve_requests(self, client: socket.socket) -> None:
        requests = rpc.RequestLines()
        newline = self._lab.controller.habits.newline
        while received := client.recv(4096):
            try:
                for line in requests.feed(received):
                    client.sendall(rpc.answer(line, self._lab.call, newline))
            except RpcError as error:
                client.sendall(rpc.refusal(error, None, newline))

    def _serve_frames(self, client: socket.socket) -> None:
        client.settimeout(_PATIENCE)
        due = time.monotonic()
        while True:
            client.sendall(self._lab.frame())
            # A server that was late sends no burst.
            due = max(due + PERIOD, time.monotonic())
            time.sleep(max(due - time.monotonic(), 0.0))

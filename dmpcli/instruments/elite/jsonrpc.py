"""JSON-RPC to an EC controller over TCP: one request, one reply, within a time.

A connection that has said something wrong, or nothing, is not used again: what it says next could
be the answer to something else.
"""

import contextlib
import json
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from dmpcli.errors import InstrumentError
from dmpcli.instruments import sockets
from dmpcli.instruments.elite.replies import BadReplyError, ReplyBuffer, result_of

_ENCODER = json.JSONEncoder(separators=(",", ":"), allow_nan=False)
_AT_ONCE = struct.pack("ii", 1, 0)  # of SO_LINGER: on, no time left


class Client:
    """One connection to the controller's port 8055; may be used from several threads.

    Parameters
    ----------
    host : str
    port : int
    patience : float
        For connecting and for each reply, s.
    """

    def __init__(self, host: str, port: int, patience: float) -> None:
        self._host, self._port, self._patience = host, port, patience
        self._what = f"robot {host}:{port}"
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None
        self._buffer = ReplyBuffer()
        self._number = 0

    @property
    def connected(self) -> bool:
        """Whether there is a connection that has not failed."""
        return self._socket is not None

    def connect(self) -> None:
        """Connect, anew if it was connected.

        Raises
        ------
        InstrumentError
        """
        with self._lock:
            self._drop()
            self._socket = sockets.connect(self._host, self._port, self._patience, self._what)

    def call(
        self, method: str, params: dict[str, Any] | None = None, patience: float | None = None
    ) -> Any:
        """Send a request and return the result of its reply, decoded.

        Parameters
        ----------
        method : str
        params : dict, optional
        patience : float, optional
            s; that of the client by default.

        Raises
        ------
        Refusal
            The controller answers with an error.
        InstrumentError
            No answer in time, one that cannot be believed, or a connection that is gone.
        """
        deadline = time.monotonic() + (self._patience if patience is None else patience)
        with self._exclusive(method, deadline):
            self._send(method, params, deadline)
            return self._receive(method, deadline)

    def notify(self, method: str, params: dict[str, Any]) -> None:
        """Send a request that the controller does not answer.

        Raises
        ------
        InstrumentError
            The connection is gone, or does not take it in time.
        """
        deadline = time.monotonic() + self._patience
        with self._exclusive(method, deadline):
            self._send(method, params, deadline)

    def poll(self) -> None:
        """Notice without waiting that the other end is gone; while a call is under way, nothing.

        Raises
        ------
        InstrumentError
            The connection is gone.
        """
        if not self._lock.acquire(blocking=False):
            return
        try:
            if self._socket is None:
                raise InstrumentError(f"{self._what}: the connection is gone")
            self._socket.settimeout(0.0)
            try:
                if self._socket.recv(1, socket.MSG_PEEK) == b"":
                    raise self._failed("looking on", "the controller closed the connection")
            except BlockingIOError:
                return  # nothing to be read: alive
            except OSError as error:
                raise self._failed("looking on", sockets.words(error)) from None
        finally:
            self._lock.release()

    def close(self) -> None:
        """Disconnect; may be called twice."""
        with self._lock:
            self._drop()

    @contextmanager
    def _exclusive(self, method: str, deadline: float) -> Iterator[None]:
        if not self._lock.acquire(timeout=max(deadline - time.monotonic(), 0.0)):
            raise InstrumentError(f"{self._what}: {method}: another request takes too long")
        try:
            yield
        finally:
            self._lock.release()

    def _send(self, method: str, params: dict[str, Any] | None, deadline: float) -> None:
        if self._socket is None:
            raise InstrumentError(f"{self._what}: {method}: the connection is gone")
        if not self._buffer.empty:
            raise self._failed(method, "a reply came that nobody asked for")
        self._number += 1
        request = {"method": method, "params": params or {}, "jsonrpc": "2.0", "id": self._number}
        line = _ENCODER.encode(request).encode() + b"\n"
        try:
            self._socket.settimeout(_left(deadline))
            self._socket.sendall(line)
        except OSError as error:
            raise self._failed(method, sockets.words(error)) from None

    def _receive(self, method: str, deadline: float) -> Any:
        assert self._socket is not None
        try:
            while (reply := self._buffer.take()) is None:
                self._socket.settimeout(_left(deadline))
                received = self._socket.recv(4096)
                if not received:
                    raise self._failed(method, "the controller closed the connection")
                self._buffer.feed(received)
            return result_of(reply, self._number)
        except OSError as error:
            raise self._failed(method, sockets.words(error)) from None
        except BadReplyError as error:
            raise self._failed(method, f"its reply {error}") from None

    def _failed(self, method: str, why: str) -> InstrumentError:
        self._drop()
        return InstrumentError(f"{self._what}: {method}: {why}")

    def _drop(self) -> None:
        if self._socket is not None:
            # What still waits to be sent must not arrive later: a set-point after the stop.
            with contextlib.suppress(OSError):
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _AT_ONCE)
            self._socket.close()
        self._socket = None
        self._buffer = ReplyBuffer()


def _left(deadline: float) -> float:
    left = deadline - time.monotonic()
    if left <= 0.0:
        raise TimeoutError
    return left

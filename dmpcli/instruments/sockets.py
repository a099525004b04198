"""TCP connections that are made within a time, name look-up included."""

import contextlib
import socket
import threading
import time
from typing import Any

from dmpcli.errors import InstrumentError


def connect(host: str, port: int, patience: float, what: str) -> socket.socket:
    """Connect, or say within `patience` s that it cannot be.

    Parameters
    ----------
    host : str
    port : int
    patience : float
        s.
    what : str
        For messages: what is at the other end.

    Raises
    ------
    InstrumentError
    """
    deadline = time.monotonic() + patience
    reason = "no answer"
    for family, kind, protocol, _, address in resolved(host, port, patience, what):
        left = deadline - time.monotonic()
        if left <= 0.0:
            break
        made = socket.socket(family, kind, protocol)
        try:
            made.settimeout(left)
            made.connect(address)
            made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except OSError as error:
            made.close()
            reason = words(error)
        else:
            return made
    raise InstrumentError(f"{what}: cannot be reached ({reason}); check address, cable and power")


def words(error: OSError) -> str:
    """Say in words what a socket failed with."""
    return "no answer" if isinstance(error, TimeoutError) else error.strerror or str(error)


def resolved(host: str, port: int, patience: float, what: str) -> list[Any]:
    """Look a host up, or say within `patience` s that it is not known; see `connect`.

    Returns
    -------
    list of tuple
        As of `socket.getaddrinfo`.
    """
    # The resolver has no timeout of its own; a name that nobody knows may take it many seconds.
    found: list[Any] = []

    def look_up() -> None:
        with contextlib.suppress(OSError, UnicodeError):
            found.extend(socket.getaddrinfo(host, port, type=socket.SOCK_STREAM))

    thread = threading.Thread(target=look_up, daemon=True)
    thread.start()
    thread.join(patience)
    if not found:
        raise InstrumentError(f"{what}: nobody knows this host; check the address")
    return found

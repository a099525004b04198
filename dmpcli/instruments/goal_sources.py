"""Where a goal that moves comes from: a schedule that was read, or datagrams of another program.

A datagram is 32 bytes in network order, ``!4sI3d``: ``DMPg``, a number that goes up with each one
(modulo 2^32), and x, y, z of the goal in mm, base frame. What is not such a datagram, is no finite
number, is older than the last one, or comes from somebody else than the first sender, is not
believed; it is told.
"""

import contextlib
import socket
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol
from urllib.parse import parse_qsl, urlsplit

import numpy as np

from dmpcli.arrays import Floats, finite
from dmpcli.errors import InputError, InstrumentError

DATAGRAM = struct.Struct("!4sI3d")
MAGIC = b"DMPg"
LOOPBACK = "127.0.0.1"
BACK = "goals come again"
LARGEST = 1e5
"""mm: what lies further away is no goal of an arm."""

_TURN, _HALF = 2**32, 2**31
# Datagrams that are looked at in one cycle; the newest of them counts.
_AT_ONCE = 64
_PATIENCE = (0.02, 3600.0)

Letter = tuple[bytes, tuple[str, int]]
"""Content of a datagram, and address and port of its sender."""


@dataclass(frozen=True)
class GoalNews:
    """What a source says.

    Attributes
    ----------
    position : array, shape (3,), or None
        The goal, mm, base frame; None where it says no goal that can be believed.
    kind : str
        What is wrong, in a few words that are the same each time; or how the sender fares.
    detail : str
        More of it.
    status : bool
        Whether it is how the sender fares, and no goal that was not believed.
    """

    position: Floats | None
    kind: str = ""
    detail: str = ""
    status: bool = False


class GoalSource(Protocol):
    """Says where the goal is now."""

    name: str

    def take(self, now: float, elapsed: float) -> list[GoalNews]:
        """Return what is new, oldest first; never waits.

        Parameters
        ----------
        now : float
            s since the first set-point of the run.
        elapsed : float
            s since the stroke's first set-point; below 0 before.
        """

    def close(self) -> None:
        """Listen no more; may be called twice."""


class ScheduledGoals:
    """Goals at times that are known before.

    Parameters
    ----------
    name : str
        Of the file.
    t : array, shape (n,)
        s since the stroke's first set-point, not decreasing.
    goals : array, shape (n, 3)
        mm.
    """

    def __init__(self, name: str, t: Floats, goals: Floats) -> None:
        self.name, self._t, self._goals = name, t, goals
        self._taken = 0

    def take(self, now: float, elapsed: float) -> list[GoalNews]:
        """As of a `GoalSource`: of those that are due the last one."""
        del now
        due = int(np.searchsorted(self._t, elapsed + 1e-9, side="right"))
        new, self._taken = range(self._taken, due), max(due, self._taken)
        return [GoalNews(self._goals[i]) for i in new]

    def close(self) -> None:
        """Nothing is open."""


class DatagramGoals:
    """Goals that another program sends.

    Parameters
    ----------
    name : str
    receive : callable
        Returns a datagram that has come, and None where there is none.
    patience : float
        So long after the last goal that was believed the sender counts as silent, s.
    sender : str
        The only address that is believed; empty takes that of the first goal.
    close : callable, optional
    """

    def __init__(
        self,
        name: str,
        receive: Callable[[], Letter | None],
        patience: float = 1.0,
        sender: str = "",
        close: Callable[[], None] = lambda: None,
    ) -> None:
        self.name, self._receive, self._patience, self._sender = name, receive, patience, sender
        self.close = close
        self._source: tuple[str, int] | None = None
        self._number = 0
        self._heard: float | None = None
        self._silent = False

    def take(self, now: float, elapsed: float) -> list[GoalNews]:
        """As of a `GoalSource`; says too when the sender falls silent, and when it is back."""
        del elapsed
        if self._heard is None:
            self._heard = now
        news: list[GoalNews] = []
        for _ in range(_AT_ONCE):
            letter = self._receive()
            if letter is None:
                break
            one = self._believed(*letter)
            if one.position is not None:
                self._heard = now
                if self._silent:
                    news.append(GoalNews(None, BACK, status=True))
                self._silent = False
            news.append(one)
        if not self._silent and now - self._heard > self._patience:
            self._silent = True
            waited = f"for {self._patience:g} s"
            news.append(GoalNews(None, "no goal comes", waited, status=True))
        return news

    def _believed(self, content: bytes, source: tuple[str, int]) -> GoalNews:
        address = source[0]
        if self._sender and address != self._sender:
            return GoalNews(None, "another sender", address)
        known = self._source
        # After a silence the same computer may begin anew, from another port.
        anew = self._silent and known is not None and address == known[0]
        if known not in (None, source) and not anew:
            return GoalNews(None, "another sender", f"{address}:{source[1]}")
        if len(content) != DATAGRAM.size or content[:4] != MAGIC:
            return GoalNews(None, "no goal datagram", f"{len(content)} bytes")
        _, number, *xyz = DATAGRAM.unpack(content)
        position = np.array(xyz)
        if not finite(position):
            return GoalNews(None, "no finite numbers")
        if np.abs(position).max() > LARGEST:
            return GoalNews(None, "beyond 100 m")
        if self._source is not None and not self._silent:
            ahead = (number - self._number) % _TURN
            if not 0 < ahead < _HALF:
                return GoalNews(None, "sent twice" if ahead == 0 else "older than the last one")
        self._source, self._number = source, number
        return GoalNews(position)


def check(url: str) -> tuple[str, int, float, str]:
    """Take a URL apart: ``udp://HOST:PORT?from=ADDRESS&patience=S``.

    Returns
    -------
    host : str
        The address of this computer that is listened on; the loopback where it says none.
    port : int
    patience : float
        s.
    sender : str
        Empty where it says none.

    Raises
    ------
    InputError
        The URL is wrong.
    """
    host, port, options = _parts(url)
    patience, sender = options.pop("patience", "1"), options.pop("from", "")
    if options:
        raise InputError(
            f"--goal-from {url}: no option {next(iter(options))}; it has from and patience"
        )
    try:
        waited = float(patience)
    except ValueError:
        waited = np.nan
    low, high = _PATIENCE
    if not low <= waited <= high:
        raise InputError(f"--goal-from {url}: patience is a number from {low:g} to {high:g} s")
    return host, port, waited, sender


def datagrams(url: str) -> DatagramGoals:
    """Listen where a URL says; see `check`.

    Raises
    ------
    InputError
        The URL is wrong.
    InstrumentError
        Nobody can listen there.
    """
    host, port, waited, sender = check(url)
    name = f"udp://{host}:{port}"
    try:
        kind = socket.AF_INET6 if ":" in host else socket.AF_INET
        made = socket.socket(kind, socket.SOCK_DGRAM)
    except OSError as error:
        raise InstrumentError(f"--goal-from {name}: {error.strerror or error}") from None
    try:
        made.setblocking(False)
        made.bind((host, port))
    except OSError as error:
        made.close()
        raise InstrumentError(
            f"--goal-from {name}: cannot listen there: {error.strerror or error}; see which "
            "program has the port, and whether the address is this computer's"
        ) from None

    def receive() -> Letter | None:
        # What the network refuses shows as silence, which is told.
        with contextlib.suppress(OSError):
            content, source = made.recvfrom(DATAGRAM.size + 1)
            return content, (str(source[0]), int(source[1]))
        return None

    return DatagramGoals(name, receive, waited, sender, made.close)


def _parts(url: str) -> tuple[str, int, dict[str, str]]:
    try:
        parts = urlsplit(url)
        port = parts.port
        options = parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query))
    except ValueError as error:
        raise InputError(f"--goal-from {url}: {error}") from None
    if parts.scheme != "udp" or not port or parts.path.strip("/") or "@" in parts.netloc:
        raise InputError(
            f"--goal-from {url}: give udp://HOST:PORT, where HOST is the address of this computer "
            "to listen on and udp://:PORT the loopback; or a file of goals"
        )
    return parts.hostname or LOOPBACK, port, _once(url, options)


def _once(url: str, pairs: Sequence[tuple[str, str]]) -> dict[str, str]:
    options = dict(pairs)
    if len(options) < len(pairs):
        raise InputError(f"--goal-from {url}: an option is given twice")
    return options

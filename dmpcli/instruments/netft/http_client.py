"""The box's pages and its TCP interface: where its settings are read and changed.

Every call has a deadline, whatever the network does. Pages are fetched without a proxy: a box
stands in the laboratory.
"""

import http.client
import io
import socket
import threading
import time
from dataclasses import dataclass
from typing import Any

from dmpcli.instruments.netft.settings import (
    CALIBRATION_SIZE,
    READCALINFO,
    BoxInfo,
    Scale,
    calibration_page,
    read_calibration,
    read_pages,
)

_LARGEST_PAGE = 1 << 20


class NoAnswerError(Exception):
    """Nobody answers, or not with what was asked for; the text says why."""


def resolve(host: str, wait: float) -> str:
    """Return the IPv4 address of a host.

    A name server that does not answer can hold a look-up for half a minute, and nothing ends it:
    so it runs in a thread that is left behind.

    Parameters
    ----------
    host : str
    wait : float
        s.

    Raises
    ------
    NoAnswerError
    """
    found: list[str] = []
    failed: list[str] = []

    def look_up() -> None:
        try:
            found.append(socket.gethostbyname(host))
        except (OSError, UnicodeError) as error:
            failed.append(getattr(error, "strerror", None) or str(error))

    thread = threading.Thread(target=look_up, name="look-up", daemon=True)
    thread.start()
    thread.join(wait)
    if not found:
        reason = failed[0] if failed else f"no name server answered within {wait:g} s"
        raise NoAnswerError(f"{host} has no address: {reason}")
    return found[0]


@dataclass(frozen=True)
class Box:
    """Where a box listens.

    Attributes
    ----------
    host : str
        IPv4 address.
    http, tcp : int
        Ports.
    """

    host: str
    http: int
    tcp: int

    def info(self, wait: float) -> BoxInfo:
        """Read ``netftapi2.xml``, and ``netftcalapi.xml`` where there is one.

        Parameters
        ----------
        wait : float
            s.

        Raises
        ------
        NoAnswerError
            There is no such page.
        ValueError
            The page is not what it should be.
        """
        deadline = time.monotonic() + wait
        api = self._get("/netftapi2.xml", deadline)
        try:
            calibration = self._get(calibration_page(api), deadline)
        except NoAnswerError:
            calibration = None
        return read_pages(api, calibration)

    def set(self, page: str, key: str, value: int, wait: float) -> None:
        """Change one setting, as in ``comm.cgi?comrdtrate=100``.

        Parameters
        ----------
        page : str
            Of the box's web server, without a slash before it.
        key : str
        value : int
        wait : float
            For the whole answer, s.

        Raises
        ------
        NoAnswerError
            None in time, or an error status; a redirect is an answer.
        """
        self._get(f"/{page}?{key}={value}", time.monotonic() + wait)

    def calibration(self, wait: float) -> Scale:
        """Ask for scale and units by READCALINFO over TCP.

        Raises
        ------
        NoAnswerError
            Nobody answers.
        ValueError
            The answer is not one.
        """
        deadline = time.monotonic() + wait
        reply = b""
        try:
            with socket.create_connection((self.host, self.tcp), timeout=wait) as connection:
                connection.sendall(READCALINFO)
                while len(reply) < CALIBRATION_SIZE:
                    connection.settimeout(_left(deadline))  # each byte may be the last for long
                    part = connection.recv(CALIBRATION_SIZE - len(reply))
                    if not part:
                        break
                    reply += part
        except OSError as error:
            raise NoAnswerError(f"TCP port {self.tcp}: {_reason(error)}") from None
        return read_calibration(reply)

    def _get(self, path: str, deadline: float) -> bytes:
        try:
            with socket.create_connection((self.host, self.http), _left(deadline)) as stream:
                connection = http.client.HTTPConnection(self.host, self.http)
                connection.sock = _Wire(stream, deadline)
                connection.request("GET", path)
                response = connection.getresponse()
                # Redirects are how a box answers to a changed setting.
                if response.status >= 400:
                    raise NoAnswerError(
                        f"HTTP port {self.http}: {path} is answered with {response.status}"
                    )
                page = b""
                while part := response.read1(65536):
                    page += part
                    if len(page) > _LARGEST_PAGE:
                        raise NoAnswerError(f"HTTP port {self.http}: {path} has no end")
                return page
        except (OSError, http.client.HTTPException) as error:
            raise NoAnswerError(f"HTTP port {self.http}: {_reason(error)}") from None


class _Wire:
    """A connection with one deadline for all that goes over it, as `HTTPConnection` uses a socket.

    A socket's own time-out begins anew with each byte: a page that drips, or one interim answer
    after the other, would hold a call for ever.
    """

    def __init__(self, stream: socket.socket, deadline: float) -> None:
        self._socket, self._deadline = stream, deadline

    def sendall(self, data: bytes) -> None:
        self._socket.settimeout(_left(self._deadline))
        self._socket.sendall(data)

    def makefile(self, mode: str) -> io.BufferedReader:  # noqa: ARG002
        return io.BufferedReader(_Incoming(self._socket, self._deadline))

    def close(self) -> None:
        """Leave it open: the answer is still read after `HTTPConnection` has done with it."""


class _Incoming(io.RawIOBase):
    """What comes in, until the deadline."""

    def __init__(self, incoming: socket.socket, deadline: float) -> None:
        super().__init__()
        self._socket, self._deadline = incoming, deadline

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        self._socket.settimeout(_left(self._deadline))
        return self._socket.recv_into(buffer)


def _left(deadline: float) -> float:
    left = deadline - time.monotonic()
    if left <= 0.0:
        raise TimeoutError("timed out")
    return left


def _reason(error: Exception) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return str(text).lower()

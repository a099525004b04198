"""How the simulated box's datagrams leave it: in order and once, unless a fault is asked for."""

import contextlib
import socket

import numpy as np

from dmpcli.instruments.netft.protocol import RECORD
from dmpcli.simulation.netft_server.faults import BoxFaults


class Sender:
    """Sends datagrams.

    Parameters
    ----------
    endpoint : socket
        The box's.
    faults : BoxFaults
    host : str
        From which foreign datagrams are sent, by another port.

    Attributes
    ----------
    offered : int
        Datagrams that were to be sent.
    lost, duplicated, reordered, malformed, foreign : int
        How often each fault was done.
    """

    def __init__(self, endpoint: socket.socket, faults: BoxFaults, host: str) -> None:
        self._socket, self._faults = endpoint, faults
        self._rng = np.random.default_rng([faults.seed, 0xF7])
        self._stranger = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._stranger.bind((host, 0))
        self._held: bytes | None = None
        self.offered = 0
        self.lost = self.duplicated = self.reordered = self.malformed = self.foreign = 0

    def send(self, datagram: bytes, client: tuple[str, int]) -> None:
        """Send one datagram, with the faults that chance has for it."""
        f = self._faults
        self.offered += 1
        # Five draws each time, so that one fault's chances do not change another's.
        lost, twice, later, senseless, strange = self._rng.random(5)
        if strange < f.foreign:
            self.foreign += 1
            self._out(self._stranger, self._rng.bytes(RECORD.itemsize), client)
        if senseless < f.malformed:
            self.malformed += 1
            self._out(self._socket, datagram[:-1], client)
        if lost < f.loss:
            self.lost += 1
            return
        if later < f.reordering and self._held is None:
            self.reordered += 1
            self._held = datagram
            return
        self._out(self._socket, datagram, client)
        if twice < f.duplication:
            self.duplicated += 1
            self._out(self._socket, datagram, client)
        if self._held is not None:
            self._out(self._socket, self._held, client)
            self._held = None

    def forget(self) -> None:
        """Drop what was held back of a stream that has ended."""
        self._held = None

    def close(self) -> None:
        """Close what was opened here."""
        self._stranger.close()

    def _out(self, endpoint: socket.socket, datagram: bytes, client: tuple[str, int]) -> None:
        # A client that is gone is no reason for a box to stop.
        with contextlib.suppress(OSError):
            endpoint.sendto(datagram, client)

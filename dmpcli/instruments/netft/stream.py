"""From datagrams to samples: what is believed, what is dropped, and what is a fault.

A fault is final: after it nothing is believed any more. A reading that the box itself flags, or
that lies outside the measuring range, is handed out as an unhealthy sample, so that it is seen
once, and is a fault too.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from dmpcli.arrays import Floats, within
from dmpcli.instruments.netft import protocol
from dmpcli.instruments.netft.sequence import Sequence, Verdict
from dmpcli.instruments.netft.status import Family, describe, serious
from dmpcli.instruments.netft.udp_receiver import Datagram
from dmpcli.instruments.protocols import Sample

SILENCE = 0.1
"""s without a believable record, after which the stream counts as dead."""

ONE_LOST = 2.5
"""Periods that pass at most where one record is lost."""

MALFORMED = 10
"""So many senseless datagrams in a row are a fault."""

LEAP = 1.0
"""N from one reading to the next, beyond which it is asked whether the box was set otherwise."""

_LEAP = np.full(3, LEAP)
_AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")


@dataclass
class LossCounter:
    """What was not taken as it came, since the start of the stream.

    Attributes
    ----------
    malformed : int
        Datagrams of a wrong length.
    foreign : dict
        Datagrams from elsewhere, by ``address:port``.
    warnings : int
        Records whose status is a warning only; they are believed.
    """

    malformed: int = 0
    foreign: dict[str, int] = field(default_factory=dict)
    warnings: int = 0


@dataclass
class Stream:
    """One request's records.

    Parameters
    ----------
    source : tuple
        Address and port of the box; nothing from elsewhere is believed.
    per_count : array, shape (6,)
        N and N·m in one count.
    limit : array, shape (6,)
        Measuring range, N and N·m.
    family : str
        Whose status bits.
    rate : float
        Hz.
    heard : float
        When the last record that was taken arrived, s; at first, since when it is waited for.
    frozen : int
        So many records in a row, alike in all six counts, are a fault; 0 is no matter how many.

    Attributes
    ----------
    sequence : Sequence
    tally : LossCounter
    fault : str or None
        What is wrong; final.
    leapt : bool
        Whether the force has leapt from one reading to the next, as it does where somebody sets a
        bias; whoever looks into it sets it back.
    """

    source: tuple[str, int]
    per_count: Floats
    limit: Floats
    family: Family
    rate: float
    heard: float
    frozen: int = 0
    sequence: Sequence = field(init=False)
    tally: LossCounter = field(default_factory=LossCounter)
    fault: str | None = None
    leapt: bool = False
    _force: Floats | None = None
    _newest: float = -math.inf
    _senseless: int = 0
    _dropped: str = ""
    _counts: bytes = b""
    _alike: int = 0

    def __post_init__(self) -> None:
        """Begin to count: no stream loses more at once than it sends in a second."""
        self.sequence = Sequence(longest_jump=max(round(self.rate), 64))

    def take(self, letters: Iterable[Datagram]) -> list[Sample]:
        """Take in datagrams.

        Parameters
        ----------
        letters : iterable of Datagram
            As they arrived.

        Returns
        -------
        list of Sample
            Oldest first; an unhealthy one is the last.
        """
        samples: list[Sample] = []
        for letter in letters:
            if self.fault is not None:
                break
            records = self._open(letter)
            if records is not None:
                self._read(records, letter.t, samples)
        return samples

    def listen(self, now: float) -> None:
        """Make silence a fault.

        Parameters
        ----------
        now : float
            s, on the clock of the letters.
        """
        # One record that the network loses is no silence, however slow the stream.
        if self.fault is not None or now - self.heard <= max(SILENCE, ONE_LOST / self.rate):
            return
        why = self._dropped or "another client may have taken the stream, or check cable and power"
        self.fault = f"silent for {now - self.heard:.2f} s; {why}"

    def _open(self, letter: Datagram) -> protocol.Records | None:
        if letter.source != self.source:
            host = f"{letter.source[0]}:{letter.source[1]}"
            count = self.tally.foreign[host] = self.tally.foreign.get(host, 0) + 1
            self._dropped = f"{count} datagrams from {host}, which is not the sensor, were dropped"
            return None
        records = protocol.records(letter.content)
        if records is None:
            self.tally.malformed += 1
            self._make_no_sense(f"the last one has {len(letter.content)} bytes")
        return records

    def _make_no_sense(self, why: str) -> None:
        self._senseless += 1
        self._dropped = f"{self._senseless} malformed datagrams were dropped, {why}"
        if self._senseless >= MALFORMED:
            self.fault = f"{self._senseless} malformed datagrams in a row, {why}"

    def _read(self, records: protocol.Records, arrived: float, samples: list[Sample]) -> None:
        # A buffered datagram's last record is new; the others are a period older each.
        age = (len(records) - 1) / self.rate
        for rdt_sequence, ft_sequence, status, counts in records.tolist():
            verdict = self.sequence.judge(rdt_sequence, ft_sequence)
            if verdict is Verdict.TAKEN:
                self._senseless, self._dropped = 0, ""
                self.heard = arrived
                # No two samples have one time, also where a burst came at once.
                self._newest = max(arrived - age, math.nextafter(self._newest, math.inf))
                wrench = np.array(counts) * self.per_count
                reason = self._unhealthy(status, wrench)
                lost = self.sequence.lost
                samples.append(Sample(self._newest, rdt_sequence, wrench, not reason, lost, reason))
                if reason:
                    self.fault = f"sample {rdt_sequence}: {reason}"
                else:
                    self._compare(np.asarray(counts).tobytes())
                    before, self._force = self._force, wrench[:3]
                    if before is not None and not within(wrench[:3] - before, _LEAP):
                        self.leapt = True
            elif verdict is Verdict.BACKWARD:
                self.fault = f"record {rdt_sequence}: {verdict.value}"
            elif verdict is Verdict.JUMP:
                self._make_no_sense(verdict.value)
            else:
                count = self.sequence.refused[verdict]
                self._dropped = f"{count} records were dropped, {verdict.value}"
            if self.fault is not None:
                return
            age -= 1.0 / self.rate

    def _compare(self, counts: bytes) -> None:
        """Make readings that never change a fault: a live sensor's noise changes them."""
        self._alike = self._alike + 1 if counts == self._counts else 1
        self._counts = counts
        if self.frozen and self._alike >= self.frozen:
            self.fault = (
                f"{self._alike} readings in a row are alike in all six counts, though their "
                "numbers go on: the sensor has frozen; check its cable, or give its URL frozen=0"
            )

    def _unhealthy(self, status: int, wrench: Floats) -> str:
        """Say why a reading must not be believed; empty where it may."""
        if serious(status):
            return describe(status, self.family)
        self.tally.warnings += 1 if status else 0
        if within(wrench, self.limit):
            return ""
        axis = int(np.argmin(np.abs(wrench) < self.limit))
        return (
            f"{_AXES[axis]} = {wrench[axis]:.4g} is not within the measuring range, "
            f"±{self.limit[axis]:g}"
        )

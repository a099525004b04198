"""Which records to take: in order, once, and only while the sensor's own counter goes on.

Both sequences are compared modulo 2^32, where less than half a turn ahead is newer. A record that
is not taken never changes what comes after it.
"""

from dataclasses import dataclass, field
from enum import Enum

TURN = 2**32
_HALF = TURN // 2


class Verdict(Enum):
    """What becomes of a record; the value says why it is not taken."""

    TAKEN = "taken"
    DUPLICATE = "sent twice"
    OLD = "older than the last one"
    JUMP = "its number jumps further than the stream can have gone"
    STALL = "ft_sequence stands still: the box repeats one reading"
    BACKWARD = "ft_sequence went backward: the box restarted"


def ahead(new: int, old: int) -> int:
    """How far `new` is ahead of `old`, -2^31 to 2^31 - 1, through any wrap."""
    return (new - old + _HALF) % TURN - _HALF


@dataclass
class Sequence:
    """Follows one request's records.

    Parameters
    ----------
    longest_jump : int
        Records that can have been lost at once. A number further ahead is not this stream's.

    Attributes
    ----------
    lost : int
        Records that never came. One that comes after a newer one stays lost: it is not taken.
    refused : dict
        How often each verdict other than ``TAKEN`` was given.
    """

    longest_jump: int
    lost: int = 0
    refused: dict[Verdict, int] = field(default_factory=dict)
    _rdt: int | None = None
    _ft: int | None = None

    def judge(self, rdt_sequence: int, ft_sequence: int) -> Verdict:
        """Take in one record's numbers.

        Parameters
        ----------
        rdt_sequence, ft_sequence : int
            0 to 2^32 - 1.

        Returns
        -------
        Verdict
        """
        verdict, missing = self._compare(rdt_sequence, ft_sequence)
        if verdict is Verdict.TAKEN:
            self._rdt, self._ft = rdt_sequence, ft_sequence
            self.lost += missing
        else:
            self.refused[verdict] = self.refused.get(verdict, 0) + 1
        return verdict

    def _compare(self, rdt: int, ft: int) -> tuple[Verdict, int]:
        if self._rdt is None or self._ft is None:
            # A request's first record is number 1; not every box of another make keeps to that.
            missing = rdt - 1
            return Verdict.TAKEN, missing if 0 <= missing <= self.longest_jump else 0
        step, progress = ahead(rdt, self._rdt), ahead(ft, self._ft)
        if step == 0:
            return Verdict.DUPLICATE, 0
        if step < 0:
            return Verdict.OLD, 0
        if step > self.longest_jump + 1:
            return Verdict.JUMP, 0
        if progress == 0:
            return Verdict.STALL, 0
        if progress < 0:
            return Verdict.BACKWARD, 0
        return Verdict.TAKEN, step - 1

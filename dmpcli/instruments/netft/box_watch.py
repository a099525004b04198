"""Whether a box is still set as it was: its scale, its units, and what it takes off as its bias.

A counter that goes on and a sound status tell nothing of these: somebody presses "Bias" on the
box's page, or another configuration is made active, and all forces are others from then on. They
are read and compared, and never written: a tool file's zero holds for the box's own bias. How far
an arm is led meanwhile grows with the force, so a look is due at once where the force has leapt.
"""

import threading

from dmpcli.instruments.netft.http_client import Box, NoAnswerError
from dmpcli.instruments.netft.settings import BoxInfo

_PATIENCE = 1.0
"""s for one look."""

PAUSE = 0.1
"""s from one look to the next at least, however often it is asked for: a box serves few."""


class BoxWatch:
    """A thread that looks at a box's pages again and again; the loop waits for none of it.

    Parameters
    ----------
    pages : Box
    before : BoxInfo
        As the box was when the stream began.
    every : float
        s between two looks.

    Attributes
    ----------
    fault : str or None
        What has changed; final.
    """

    def __init__(self, pages: Box, before: BoxInfo, every: float) -> None:
        self._pages, self._before, self._every = pages, before, every
        self.fault: str | None = None
        self._ending, self._asked = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._watch, name="box watch", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Look for the last time, and no more; may be called twice."""
        if self._ending.is_set():
            return
        self._ending.set()
        self._asked.set()
        self._thread.join(2.0 * _PATIENCE)
        if self.fault is None:
            self._look()

    def look_soon(self) -> None:
        """Have the thread look without waiting for its time; returns at once."""
        self._asked.set()

    def _watch(self) -> None:
        while self.fault is None:
            self._asked.wait(self._every)
            self._asked.clear()
            if self._ending.is_set():
                return
            self._look()
            if self._ending.wait(PAUSE):
                return

    def _look(self) -> None:
        # A page that does not answer says nothing: its server is slow at times, and the stream,
        # whose silence is a fault, is another part of the box.
        try:
            now = self._pages.info(_PATIENCE)
        except NoAnswerError:
            return
        except ValueError as error:
            self.fault = f"its page says what it did not before: {error}"
            return
        self.fault = changed(self._before, now)


def changed(before: BoxInfo, now: BoxInfo) -> str | None:
    """Say what of scale, units and bias is another than before; None where nothing is.

    Parameters
    ----------
    before, now : BoxInfo
    """
    if now.scale != before.scale:
        return f"its scale was changed, from {_scale(before)} to {_scale(now)}"
    if before.bias is not None and now.bias != before.bias:
        return f"its bias was changed, from {_counts(before)} to {_counts(now)} counts"
    return None


def _scale(box: BoxInfo) -> str:
    scale = box.scale
    return (
        f"{scale.counts_per_force:g} counts per {scale.force_unit} and "
        f"{scale.counts_per_torque:g} per {scale.torque_unit}"
    )


def _counts(box: BoxInfo) -> str:
    return "none" if box.bias is None else " ".join(f"{value:g}" for value in box.bias)

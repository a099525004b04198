"""What a control loop says while it runs: a terminal that hangs must not hold up the loop."""

import queue
import threading
from typing import TYPE_CHECKING

from dmpcli.messages import warn

if TYPE_CHECKING:
    from dmpcli.control.contact_policy import ContactEvent

_TOLD = ("lost", "too hard", "oscillating")


class LaterTeller:
    """Warns at once, or from a thread of its own.

    Parameters
    ----------
    realtime : bool
        Whether a real clock runs, for which nothing may wait.
    """

    def __init__(self, realtime: bool) -> None:
        self._queue: queue.SimpleQueue[str | None] | None = None
        if realtime:
            self._queue = queue.SimpleQueue()
            self._thread = threading.Thread(target=self._tell, daemon=True)
            self._thread.start()

    def say(self, text: str) -> None:
        """Warn of something."""
        if self._queue is None:
            warn(text)
        else:
            self._queue.put(text)

    def contact(self, event: "ContactEvent") -> None:
        """Tell how a contact has changed, if a person should know of it now."""
        if event.state in _TOLD or event.detail.startswith("saturated"):
            self.say(str(event))

    def close(self) -> None:
        """Wait, shortly, until all is told."""
        if self._queue is not None:
            self._queue.put(None)
            self._thread.join(timeout=1.0)

    def _tell(self) -> None:
        assert self._queue is not None
        while (said := self._queue.get()) is not None:
            warn(said)

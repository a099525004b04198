"""What a control loop says while it runs: a terminal that hangs must not hold up the loop."""

import queue
import threading

from dmpcli.control.contact_policy import ContactEvent
from dmpcli.messages import warn

_TOLD = ("lost", "too hard", "oscillating")


class ContactTeller:
    """Tells the troubles of a contact as they happen: at once, or from a thread of its own.

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

    def __call__(self, event: ContactEvent) -> None:
        """Tell an event if a person should know of it now."""
        if event.state not in _TOLD and not event.detail.startswith("saturated"):
            return
        if self._queue is None:
            warn(str(event))
        else:
            self._queue.put(str(event))

    def close(self) -> None:
        """Wait, shortly, until all is told."""
        if self._queue is not None:
            self._queue.put(None)
            self._thread.join(timeout=1.0)

    def _tell(self) -> None:
        assert self._queue is not None
        while (said := self._queue.get()) is not None:
            warn(said)

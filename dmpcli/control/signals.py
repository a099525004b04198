"""Signals as a request that the loop reads, not as an exception in its midst.

SIGINT and SIGTERM, and what a terminal sends: SIGQUIT, and SIGHUP when it is closed, unless that is
ignored (``nohup``). SIGTSTP (Ctrl-Z) is ignored: a loop that is suspended leaves the arm to itself.
"""

import contextlib
import signal
from types import FrameType, TracebackType
from typing import Any

_COUNTED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
_LAST = 3


class Interruption:
    """While it is entered, signals are counted instead of ending the process.

    The third is the last one: a loop that is stuck after two would not heed it either. Handlers
    are then as they were before, so that a fourth ends the process; the third itself does not, for
    the second's stop may still be under way.

    Attributes
    ----------
    number : int or None
        The first signal that came.
    count : int
        How many came; from the second on the arm stops at once.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self.count = 0
        self._before: dict[int, Any] = {}
        self._handlers = contextlib.ExitStack()

    def __enter__(self) -> "Interruption":
        # A stack, since a signal that has not been taken over yet, or not any more, may raise here.
        with contextlib.ExitStack() as handlers:
            for number in _COUNTED:
                if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                    self._take(handlers, number, self.receive)
            self._take(handlers, signal.SIGTSTP, signal.SIG_IGN)
            self._handlers = handlers.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._handlers.close()

    def _take(self, handlers: contextlib.ExitStack, number: int, handler: Any) -> None:
        self._before[number] = signal.getsignal(number)
        handlers.callback(signal.signal, number, self._before[number])
        signal.signal(number, handler)

    def receive(self, number: int, frame: FrameType | None = None) -> None:  # noqa: ARG002
        """Count one signal."""
        self.number = self.number or number
        self.count += 1
        if self.count == _LAST:
            for known, handler in self._before.items():
                if known != signal.SIGTSTP:
                    signal.signal(known, handler)

"""Signals as a request that the loop reads, not as an exception in its midst.

SIGINT and SIGTERM, and what a terminal sends: SIGQUIT, and SIGHUP when it is closed, unless that is
ignored (``nohup``). SIGTSTP (Ctrl-Z) is ignored: a loop that is suspended leaves the arm to itself.
"""

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

    def __enter__(self) -> "Interruption":
        for number in _COUNTED:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                self._before[number] = signal.signal(number, self.receive)
        self._before[signal.SIGTSTP] = signal.signal(signal.SIGTSTP, signal.SIG_IGN)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        # SIGINT last: its usual handler may raise at once, and none may be left as it was here.
        for number, handler in reversed(self._before.items()):
            signal.signal(number, handler)

    def receive(self, number: int, frame: FrameType | None = None) -> None:  # noqa: ARG002
        """Count one signal."""
        self.number = self.number or number
        self.count += 1
        if self.count == _LAST:
            for known, handler in self._before.items():
                if known != signal.SIGTSTP:
                    signal.signal(known, handler)

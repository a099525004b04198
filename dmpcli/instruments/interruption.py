"""SIGINT and SIGTERM as a request that the loop reads, not as an exception in its midst."""

import signal
from types import FrameType, TracebackType
from typing import Any


class Interruption:
    """While it is entered, signals are counted instead of ending the process.

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
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self.receive)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def receive(self, number: int, frame: FrameType | None = None) -> None:  # noqa: ARG002
        """Count one signal."""
        self.number = self.number or number
        self.count += 1

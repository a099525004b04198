"""``dmpcli simulate`` in a process of its own, as a person would start it."""

import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import TracebackType

DMPCLI = str(Path(sys.executable).parent / "dmpcli")
FREE_PORTS = tuple(
    word
    for port in ("sensor", "http", "tcp", "robot", "monitor")
    for word in (f"--{port}-port", "0")
)


class Lab:
    """A lab that serves until it is left.

    Attributes
    ----------
    line : str
        What it printed when it was ready.
    sensor, robot : str
        URLs for ``--sensor`` and ``--robot``.
    code : int
        Its exit code, once it was left.
    told : str
        What it said on standard error, once it was left.
    """

    def __init__(self, *options: str) -> None:
        self._process = subprocess.Popen(
            [DMPCLI, "simulate", *FREE_PORTS, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        # A lab that says nothing must not hang the tests.
        watchdog = threading.Timer(60.0, self._process.kill)
        watchdog.start()
        assert self._process.stdout is not None
        self.line = self._process.stdout.readline()
        watchdog.cancel()
        words = dict(word.split("=", 1) for word in self.line.split()[1:] if "=" in word)
        self.sensor, self.robot = words.get("sensor", ""), words.get("robot", "")
        self.code, self.told, self.rest = -1, "", ""

    def __enter__(self) -> "Lab":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.leave()

    def leave(self, number: int = signal.SIGINT) -> None:
        """End it by a signal; what it printed after its first line is in `rest`."""
        if self._process.poll() is None:
            self._process.send_signal(number)
        self.rest, self.told = self._process.communicate(timeout=60.0)
        self.code = self._process.returncode

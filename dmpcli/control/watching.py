"""Lets a person at the terminal see a run while it goes on, without a part in the loop.

A thread looks at the log's last row a few times a second and puts what it sees into memory that a
process of its own draws from (`dmpcli.live_view`). The loop adds rows as ever and waits for nobody.
"""

import contextlib
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from dmpcli.control.servo_loop import PlanLoop
from dmpcli.live_view import EVERY, SIZE, SharedSnapshot
from dmpcli.messages import diverted, watched
from dmpcli.records.row_buffer import RowBuffer
from dmpcli.spatial.rotations import to_euler

_PATIENCE = 2.0
"""s for which the view may take to draw its last picture."""


class RunView:
    """What a person sees of a run or a recording.

    Parameters
    ----------
    title : str
    rows : RowBuffer
        Of a `RunLog` or a `DemonstrationLog`.
    period : float
        s.
    share : callable
        From the last time in the log, s, to the share done, 0 to 1; None where nobody knows.
    """

    def __init__(
        self,
        title: str,
        rows: RowBuffer,
        period: float,
        share: Callable[[float], float | None] = lambda _: None,
    ) -> None:
        self._title, self._rows, self.period, self._share = title, rows, period, share
        self._worst, self._seen = 0.0, 0

    @property
    def last_clock(self) -> float | None:
        """When the last row's state was read, s, on the loop's clock; None while there is none."""
        count = len(self._rows)
        return float(self._rows.numbers("clock", count - 1)[0]) if count else None

    def now(self) -> dict[str, Any] | None:
        """Return the picture of the last row; None while there is none."""
        count = len(self._rows)
        if count == 0:
            return None
        last = count - 1
        one: Callable[[str], Any] = lambda name: self._rows.numbers(name, last)[0]  # noqa: E731
        groups = self._rows.groups
        runs = "actual" in groups
        place, turn = ("actual", "actual_rotation") if runs else ("position", "rotation")
        angles = to_euler(np.asarray(one(turn)).reshape(3, 3))
        t = float(one("t"))
        seen: dict[str, Any] = {
            "title": self._title,
            "t": t,
            "share": self._share(t),
            "pose": [*map(float, one(place)), *map(float, angles)],
        }
        if "wrench" in groups and np.isfinite(wrench := one("wrench")).all():
            seen["force"], seen["torque"] = wrench[:3].tolist(), wrench[3:].tolist()
        if "coupling" in groups:
            seen["contact"] = f"pressing, led by {float(one('coupling')):.2f} mm along the normal"
        return seen | self._timing(last) | self._words(last)

    def _timing(self, last: int) -> dict[str, float]:
        """How late the set-points were: as the log of a run has it, of a recording by its clock."""
        if "lateness" in self._rows.groups:
            late = self._rows.numbers("lateness", self._seen)
        else:
            late = np.abs(np.diff(self._rows.numbers("clock", max(self._seen - 1, 0))))
            late = np.maximum(late - self.period, 0.0)
        self._seen = last + 1
        if not len(late):
            return {}
        self._worst = max(self._worst, float(late.max()))
        return {"late": 1e3 * float(late[-1]), "worst": 1e3 * self._worst}

    def _words(self, last: int) -> dict[str, str]:
        names = [name for name in ("phase", "id", "state") if name in self._rows.texts]
        said = [word for name in names for word in self._rows.words(name, last, last + 1)]
        return {"state": "  ".join(word for word in said if word)}


def of_plan(loop: PlanLoop) -> RunView:
    """Return the view of a loop that draws plans: the share done is that of all of them."""
    whole = loop.duration
    return RunView("executing", loop.log.rows, loop.period, lambda t: min(t / whole, 1.0))


@contextlib.contextmanager
def live(view: Callable[[], RunView], wanted: bool) -> Iterator[Callable[[str], None]]:
    """Show a run while this is entered; nothing where nobody sits at a terminal.

    Parameters
    ----------
    view : callable
        Makes the view, where there is one.
    wanted : bool
        Whether the run takes real time.

    Yields
    ------
    callable
        Takes the reason why the run ended, to be shown last.
    """
    if not (wanted and watched()):
        yield lambda _: None
        return
    with contextlib.ExitStack() as stack:
        try:
            file = stack.enter_context(tempfile.TemporaryFile())
            file.truncate(SIZE)
            process = subprocess.Popen(
                [sys.executable, "-m", "dmpcli.live_view", str(file.fileno())],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                pass_fds=(file.fileno(),),
                start_new_session=True,
                text=True,
            )
        except OSError:  # a view that cannot be had must not cost the run
            yield lambda _: None
            return
        memory = SharedSnapshot(file.fileno())
        stack.callback(memory.close)
        publisher = _Publisher(view(), memory)
        stack.callback(_end, process)
        with diverted(lambda text: _printed(process, text)):
            publisher.start()
            try:
                yield publisher.close
            finally:
                publisher.close("")


class _Publisher(threading.Thread):
    """Puts the picture of now where the view reads it."""

    def __init__(self, view: RunView, memory: SharedSnapshot) -> None:
        super().__init__(name="live view", daemon=True)
        self._view, self._memory, self._over = view, memory, threading.Event()

    def run(self) -> None:
        """Look, and wait."""
        while not self._over.wait(self._pause()):
            self._look({})

    def _pause(self) -> float:
        """Return how long to wait, s: to look half-way between two deadlines disturbs neither.

        Else a look every so many cycles would, at some phase, meet each of their wakings.
        """
        last = self._view.last_clock
        if last is None:
            return EVERY
        period = self._view.period
        phase = (time.monotonic() + EVERY - last) % period
        return EVERY + 0.5 * period - phase

    def close(self, reason: str) -> None:
        """Look once more, and no more; may be called twice."""
        if self._over.is_set():
            return
        self._over.set()
        self.join(1.0)
        self._look({"reason": reason})

    def _look(self, more: dict[str, str]) -> None:
        # A view that fails must not cost the run, nor write into its terminal.
        with contextlib.suppress(Exception):
            seen = self._view.now()
            if seen is not None:
                self._memory.write(seen | more)


def _printed(process: "subprocess.Popen[str]", text: str) -> bool:
    """Have a message printed above the view; False where it cannot be."""
    if process.poll() is not None or process.stdin is None:
        return False
    try:
        process.stdin.write(text + "\n")
        process.stdin.flush()
    except (OSError, ValueError):
        return False
    return True


def _end(process: "subprocess.Popen[str]") -> None:
    with contextlib.suppress(OSError, ValueError):
        if process.stdin is not None:
            process.stdin.close()
    try:
        process.wait(_PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()

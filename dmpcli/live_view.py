"""The live view of a run, in a process of its own: what the loop does, some times a second.

    python -m dmpcli.live_view FD VIEW

It draws on standard error what stands in the shared memory FD (`SharedRow`), as VIEW (`RowView`, as
JSON) says what that is, prints above it the lines that come on standard input, and ends with that.
The loop copies each row of its log there, and neither knows nor waits for anybody.
"""

import contextlib
import json
import math
import mmap
import os
import signal
import struct
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.table import Table

    from dmpcli.arrays import Floats

EVERY = 0.5
"""s between two pictures."""

_GLANCE = 0.0005
"""s between two looks for a new row."""

SIZE = 4096

ABOVE, END = "+", "="
"""How a line of standard input begins that is printed above the picture, and that of the end."""

READY = b"ready\n"
"""What the view says once it has loaded all that it needs."""

_HEAD = struct.Struct("<QQdd")
_TEXT = 1024
_BETWEEN = "\x1f"


@dataclass(frozen=True)
class RowView:
    """What a person sees of a log's rows.

    Attributes
    ----------
    title : str
    period : float
        s.
    whole : float or None
        How long it will take, s; None where nobody knows.
    groups : dict of int
        How many numbers each group of a row holds, in order.
    texts : tuple of str
        Names of its texts, in order.
    """

    title: str
    period: float
    whole: float | None
    groups: Mapping[str, int]
    texts: Sequence[str]

    def json(self) -> str:
        """Return it as text."""
        return json.dumps(asdict(self))

    @classmethod
    def of_json(cls, text: str) -> "RowView":
        """Return what `json` has written."""
        return cls(**json.loads(text))

    def picture(
        self,
        numbers: Sequence[float],
        words: Sequence[str],
        late: float,
        worst: float,
    ) -> dict[str, Any]:
        """Return what `table` shows of a row.

        Parameters
        ----------
        numbers : sequence of float
            Of all groups, one after the other: mm, s, N and N·m; rotations as nine of a matrix.
        words : sequence of str
            Its texts, in order.
        late, worst : float
            By how much the last cycle was late, and the latest so far, s.

        Returns
        -------
        dict
            Lateness in ms; wrench and contact only where the row has them.
        """
        at: dict[str, list[float]] = {}
        first = 0
        for name, count in self.groups.items():
            at[name] = list(numbers[first : first + count])
            first += count
        runs = "actual" in at
        place, turn = ("actual", "actual_rotation") if runs else ("position", "rotation")
        t = at["t"][0]
        seen: dict[str, Any] = {
            "title": self.title,
            "t": t,
            "share": None if self.whole is None else min(t / self.whole, 1.0),
            "pose": [*at[place], *_euler(at[turn])],
            "late": 1e3 * late,
            "worst": 1e3 * worst,
        }
        if all(map(math.isfinite, at.get("wrench", [math.nan]))):
            seen["force"], seen["torque"] = at["wrench"][:3], at["wrench"][3:]
        if "coupling" in at:
            seen["contact"] = f"pressing, led by {at['coupling'][0]:.2f} mm along the normal"
        said = dict(zip(self.texts, words, strict=False))
        shown = [said[name] for name in ("phase", "id", "state") if said.get(name)]
        return seen | {"state": "  ".join(shown)}


def _euler(turn: list[float]) -> list[float]:
    """X-Y-Z Euler angles of a rotation's nine numbers, rad."""
    import numpy as np

    from dmpcli.spatial.rotations import to_euler

    return [float(angle) for angle in to_euler(np.reshape(turn, (3, 3)))]


class SharedRow:
    """A log's last row in shared memory, and how late the loop was: whole, or not read.

    One process writes, any may read; nobody waits for anybody. The number before the row is odd
    while it is written. Writing takes two microseconds and asks nobody for memory.

    Parameters
    ----------
    fd : int
        Of a file of `SIZE` bytes.
    view : RowView
    """

    def __init__(self, fd: int, view: RowView) -> None:
        import numpy as np

        self._memory = mmap.mmap(fd, SIZE)
        self._view = view
        whole = np.frombuffer(self._memory, dtype=np.uint64)
        self._number, self._size = whole[:1], whole[1:2]
        numbers = np.frombuffer(self._memory, dtype=np.float64)
        self._late = numbers[2:4]
        first = (_HEAD.size + _TEXT) // 8
        self._row = numbers[first : first + sum(view.groups.values())]
        starts, at = {}, 0
        for name, count in view.groups.items():
            starts[name], at = at, at + count
        self._lateness, self._clock = starts.get("lateness"), starts.get("clock", 0)
        self._count, self._worst, self._before = 0, 0.0, math.nan
        self._words: Sequence[str] = ()

    def put(self, row: "Floats", words: Sequence[str]) -> None:
        """Replace what stands there.

        Parameters
        ----------
        row : array, shape (numbers of all groups,)
        words : sequence of str
        """
        if self._lateness is None:
            now = float(row[self._clock])
            late, self._before = max(now - self._before - self._view.period, 0.0), now
            late = late if late == late else 0.0  # the first row has none before it
        else:
            late = float(row[self._lateness])
        if late > self._worst:
            self._worst = late
        self._count += 2
        self._number[0] = self._count - 1
        self._late[0], self._late[1] = late, self._worst
        self._row[:] = row
        if words != self._words:
            text = _BETWEEN.join(words).encode()[:_TEXT]
            self._size[0] = len(text)
            self._memory[_HEAD.size : _HEAD.size + len(text)] = text
            self._words = tuple(words) if isinstance(words, tuple) else list(words)
        self._number[0] = self._count

    def await_next(self) -> None:
        """Wait for the next row, two periods at most; after it the loop sleeps for most of one."""
        number, until = int(self._number[0]), time.monotonic() + 2.0 * self._view.period
        while int(self._number[0]) == number and time.monotonic() < until:
            time.sleep(_GLANCE)

    def read(self) -> dict[str, Any] | None:
        """Return the picture of what stands there; None where nothing does, or it is written."""
        number = int(self._number[0])
        if number == 0 or number % 2:
            return None
        size, row, late = int(self._size[0]), self._row.tolist(), self._late.tolist()
        text = bytes(self._memory[_HEAD.size : _HEAD.size + size])
        if int(self._number[0]) != number:
            return None
        words = text.decode(errors="replace").split(_BETWEEN)
        return self._view.picture(row, words, *late)


def table(seen: Mapping[str, Any]) -> "Table":
    """Return the picture of a snapshot: a line for each thing it holds.

    Parameters
    ----------
    seen : mapping
        ``title``, ``t`` and ``share`` (0 to 1, or None), ``pose`` (mm and rad), ``force`` (N) and
        ``torque`` (N·m), ``late`` and ``worst`` (ms), ``contact`` and ``state`` in words, and at
        the end ``reason``; what is missing is not shown.
    """
    from rich.progress_bar import ProgressBar
    from rich.table import Table
    from rich.text import Text

    shown = Table(box=None, show_header=False, pad_edge=False)
    shown.add_column(style="bold")
    shown.add_column(width=60)
    # As texts: what stands in brackets in the name of a stroke is no markup.
    shown.add_row(seen["title"], Text(f"{seen['t']:.1f} s   {seen.get('state', '')}"))
    if seen.get("share") is not None:
        shown.add_row(f"{100 * seen['share']:3.0f} %", ProgressBar(1.0, seen["share"], width=50))
    if "pose" in seen:
        x, y, z, rx, ry, rz = seen["pose"]
        at = f"{x:9.2f} {y:9.2f} {z:9.2f} mm"
        shown.add_row("tool", f"{at}   {rx:6.3f} {ry:6.3f} {rz:6.3f} rad")
    if seen.get("force") is not None:
        fx, fy, fz = seen["force"]
        size = math.sqrt(fx * fx + fy * fy + fz * fz)
        shown.add_row("force", f"{fx:7.2f} {fy:7.2f} {fz:7.2f} N   |F| {size:.2f} N")
    if seen.get("contact"):
        shown.add_row("contact", Text(seen["contact"]))
    if math.isfinite(seen.get("late", math.nan)):
        late, worst = seen["late"], seen["worst"]
        shown.add_row("late", f"{late:.2f} ms, worst so far {worst:.2f} ms")
    if seen.get("reason"):
        shown.add_row("ended", Text(seen["reason"]))
    return shown


def show(fd: int, view: RowView) -> None:
    """Draw until standard input ends."""
    from rich.console import Console
    from rich.live import Live

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGTSTP, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    row, ended, reason = SharedRow(fd, view), threading.Event(), list[str]()
    _euler([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    with Live(console=Console(stderr=True), auto_refresh=False, transient=False) as live:
        live.update(table({"title": view.title, "t": 0.0}), refresh=True)

        def listen() -> None:
            for line in sys.stdin:
                said = json.loads(line[1:])
                if line[0] == END:
                    reason.append(said)
                else:
                    live.console.print(said, markup=False, highlight=False, emoji=False)
            ended.set()

        threading.Thread(target=listen, daemon=True).start()
        _stand_back()
        os.write(1, READY)
        over = False
        while not over:
            over = ended.wait(EVERY)
            if not over:
                # A picture takes 3 ms: it begins as the loop falls asleep.
                row.await_next()
            seen = row.read()
            if seen is not None:
                live.update(table(seen | {"reason": "".join(reason)}), refresh=True)


def _stand_back() -> None:
    """Let everything else go first: a loop that wakes takes the processor from this at once."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
        return
    with contextlib.suppress(OSError, AttributeError):
        os.nice(19)


if __name__ == "__main__":
    show(int(sys.argv[1]), RowView.of_json(sys.argv[2]))

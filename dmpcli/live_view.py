"""The live view of a run, in a process of its own: what the loop does, some times a second.

    python -m dmpcli.live_view FD

It draws on standard error what stands in the shared memory FD (`SharedSnapshot`), prints above it
the lines that come on standard input, and ends with that. The loop neither knows nor waits for it.
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
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.table import Table

EVERY = 0.2
"""s between two pictures."""

SIZE = 4096
_HEAD = struct.Struct("<QI")


class SharedSnapshot:
    """What a run looks like now: JSON in shared memory, whole or as it was before.

    One process writes, any may read. The number before the text is odd while it is written.

    Parameters
    ----------
    fd : int
        Of a file of `SIZE` bytes.
    """

    def __init__(self, fd: int) -> None:
        self._memory = mmap.mmap(fd, SIZE)
        self._number = 0

    def write(self, content: Mapping[str, Any]) -> None:
        """Replace what stands there."""
        text = json.dumps(content, ensure_ascii=False).encode()
        if len(text) > SIZE - _HEAD.size:
            return
        self._number += 2
        _HEAD.pack_into(self._memory, 0, self._number - 1, len(text))
        self._memory[_HEAD.size : _HEAD.size + len(text)] = text
        _HEAD.pack_into(self._memory, 0, self._number, len(text))

    def read(self) -> dict[str, Any] | None:
        """Return what stands there; None where nothing does, or it is being written."""
        number, size = _HEAD.unpack_from(self._memory)
        if number == 0 or number % 2 or size > SIZE - _HEAD.size:
            return None
        text = bytes(self._memory[_HEAD.size : _HEAD.size + size])
        if _HEAD.unpack_from(self._memory)[0] != number:
            return None
        content: dict[str, Any] = json.loads(text)
        return content

    def close(self) -> None:
        """Let go of the memory."""
        self._memory.close()


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

    shown = Table(box=None, show_header=False, pad_edge=False)
    shown.add_column(style="bold")
    shown.add_column(width=60)
    shown.add_row(seen["title"], f"{seen['t']:.1f} s   {seen.get('state', '')}")
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
        shown.add_row("contact", seen["contact"])
    if seen.get("late") is not None:
        late, worst = seen["late"], seen["worst"]
        shown.add_row("late", f"{late:.2f} ms, worst so far {worst:.2f} ms")
    if seen.get("reason"):
        shown.add_row("ended", seen["reason"])
    return shown


def show(fd: int) -> None:
    """Draw until standard input ends."""
    # Whatever priority the loop was given, the picture has none.
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        os.nice(19)
    from rich.console import Console
    from rich.live import Live

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGTSTP, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    memory, ended = SharedSnapshot(fd), threading.Event()
    with Live(console=Console(stderr=True), auto_refresh=False, transient=False) as live:

        def listen() -> None:
            for line in sys.stdin:
                live.console.print(line.rstrip("\n"), markup=False, highlight=False)
            ended.set()

        threading.Thread(target=listen, daemon=True).start()
        over = False
        while not over:
            over = ended.wait(EVERY)
            seen = memory.read()
            if seen is not None:
                live.update(table(seen), refresh=True)


if __name__ == "__main__":
    show(int(sys.argv[1]))

"""Lets a person at the terminal see a run while it goes on, without a part in the loop.

The log's buffer copies each row into memory that a process of its own draws from
(`dmpcli.live_view`). The loop has no thread beside it, and waits for nobody.
"""

import contextlib
import json
import os
import select
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dmpcli.control.servo_loop import PlanLoop
from dmpcli.messages import diverted, watched
from dmpcli.records.row_buffer import RowBuffer

if TYPE_CHECKING:  # loaded where somebody watches
    from dmpcli.live_view import RowView

_PATIENCE = 2.0
"""s for which the view may take to load what it needs, and to draw its last picture."""


@dataclass(frozen=True)
class RunView:
    """What a person sees of a run or a recording.

    Attributes
    ----------
    title : str
    rows : RowBuffer
        Of a `RunLog` or a `DemonstrationLog`.
    period : float
        s.
    whole : float or None
        How long it will take, s; None where nobody knows.
    """

    title: str
    rows: RowBuffer
    period: float
    whole: float | None = None

    def of_rows(self) -> "RowView":
        """Return what the process that draws must know."""
        from dmpcli.live_view import RowView

        rows = self.rows
        return RowView(self.title, self.period, self.whole, rows.groups, list(rows.texts))


def of_plan(loop: PlanLoop) -> RunView:
    """Return the view of a loop that draws plans: the share done is that of all of them."""
    return RunView("executing", loop.log.rows, loop.period, loop.duration)


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
    from dmpcli.live_view import ABOVE, SIZE, SharedRow

    with contextlib.ExitStack() as stack:
        try:
            shown = view()
            file = stack.enter_context(tempfile.TemporaryFile())
            file.truncate(SIZE)
            seen = shown.of_rows()
            process = subprocess.Popen(
                [sys.executable, "-m", "dmpcli.live_view", str(file.fileno()), seen.json()],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                pass_fds=(file.fileno(),),
                start_new_session=True,
                text=True,
            )
        except OSError:  # a view that cannot be had must not cost the run
            yield lambda _: None
            return
        stack.callback(_end, process)
        _await(process)
        shown.rows.mirror = SharedRow(file.fileno(), seen).put
        with diverted(lambda text: _written(process, ABOVE, text)):
            try:
                yield lambda reason: _ended(process, reason)
            finally:
                shown.rows.mirror = None


def _await(process: "subprocess.Popen[str]") -> None:
    """Wait until the view has loaded what it needs, so that this does not fall into the run."""
    from dmpcli.live_view import READY

    assert process.stdout is not None
    with contextlib.suppress(OSError, ValueError):
        if select.select([process.stdout], [], [], _PATIENCE)[0]:
            os.read(process.stdout.fileno(), len(READY))


def _ended(process: "subprocess.Popen[str]", reason: str) -> None:
    from dmpcli.live_view import END

    _written(process, END, reason)
    # The last picture is waited for: it need not stand back any more.
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(process.pid, os.SCHED_OTHER, os.sched_param(0))


def _written(process: "subprocess.Popen[str]", kind: str, text: str) -> bool:
    """Give the view a line; False where it takes none."""
    if process.poll() is not None or process.stdin is None:
        return False
    try:
        process.stdin.write(f"{kind}{json.dumps(text)}\n")
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
    with contextlib.suppress(OSError, ValueError):
        if process.stdout is not None:
            process.stdout.close()

"""What a person types at the terminal, read without ever waiting for the rest of a line."""

import os
import select
import sys


def pressed() -> bool:
    """Tell whether Enter was pressed; never where no person sits there."""
    if not sys.stdin or not sys.stdin.isatty():
        return False
    return b"\n" in (typed() or b"")


def typed() -> bytes | None:
    """Return what waits on standard input: empty at its end, None where nothing waits.

    Ctrl-D hands over a line that has no end; whoever asks for a whole one would wait for it.
    """
    ready, _, _ = select.select([sys.stdin], [], [], 0.0)
    return os.read(sys.stdin.fileno(), 4096) if ready else None

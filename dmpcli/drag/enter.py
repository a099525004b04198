"""The Enter key as a person's sign that the recording is done."""

import select
import sys


def pressed() -> bool:
    """Tell whether a line waits on standard input; never where no person sits there."""
    if not sys.stdin or not sys.stdin.isatty():
        return False
    ready, _, _ = select.select([sys.stdin], [], [], 0.0)
    return bool(ready) and bool(sys.stdin.readline())

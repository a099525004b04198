"""Memory that stays with a process that draws part after part.

A part needs the same tens of megabytes again and again. The C library would give them back to the
system each time, and to have every page cleared anew costs more than the drawing.
"""

import contextlib
import ctypes

# Of glibc's malloc.h.
_TRIM_THRESHOLD, _MMAP_MAX = -1, -4
_MOST = (1 << 31) - 1


def keep() -> None:
    """Keep what is freed for the next part; does nothing where the C library is another one."""
    with contextlib.suppress(OSError, AttributeError, TypeError):
        library = ctypes.CDLL(None)
        library.mallopt(_TRIM_THRESHOLD, _MOST)
        library.mallopt(_MMAP_MAX, 0)

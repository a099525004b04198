"""Functions that are compiled to machine code, with the extra `fast`: numba.

Compiled without liberties of its own: no fused or reordered arithmetic, no threads, so that a
kernel gives the same bytes on every processor and whatever stands beside it in a batch. What was
compiled is kept beside the program, or where NUMBA_CACHE_DIR says; where nothing can be kept, each
process compiles for itself.
"""

import contextlib
from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Compile a function when it is called first, and keep it."""
    made = njit(cache=True, fastmath=False, nogil=True, error_model="numpy")(function)
    _forgive(made._cache)  # type: ignore[attr-defined]
    return cast(Function, made)


def _forgive(kept: Any) -> None:
    """Let a kernel be compiled anew where what is kept of it is another version's, or damaged.

    numba looks for the names of that version's types before it compares the source, and fails; so
    it does with what was cut short, and where the disk is full.
    """
    load, save = kept.load_overload, kept.save_overload

    def loaded(signature: Any, target: Any) -> Any:
        try:
            return load(signature, target)
        except Exception:
            with contextlib.suppress(OSError):
                kept.flush()
            return None

    def saved(signature: Any, data: Any) -> None:
        with contextlib.suppress(OSError):
            save(signature, data)

    kept.load_overload, kept.save_overload = loaded, saved

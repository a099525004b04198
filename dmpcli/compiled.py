"""Functions that are compiled to machine code, with the extra `fast`: numba.

Compiled without liberties of its own: no fused or reordered arithmetic, no threads, so that a
kernel gives the same bytes on every processor and whatever stands beside it in a batch. What was
compiled is kept beside the program, or where NUMBA_CACHE_DIR says.
"""

import pickle
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
    """Let a kernel be compiled anew where what is kept of it is another version's.

    numba looks for the names of that version's types before it compares the source, and fails.
    """
    load = kept.load_overload

    def loaded(signature: Any, target: Any) -> Any:
        try:
            return load(signature, target)
        except (AttributeError, ImportError, EOFError, pickle.UnpicklingError):
            kept.flush()
            return None

    kept.load_overload = loaded

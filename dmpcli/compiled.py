"""Functions that are compiled to machine code, with the extra `fast`: numba.

Compiled without liberties of its own: no fused or reordered arithmetic, no threads, so that a
kernel gives the same bytes on every processor and whatever stands beside it in a batch. What was
compiled is kept beside the program, or where NUMBA_CACHE_DIR says.
"""

from collections.abc import Callable
from typing import TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Compile a function when it is called first, and keep it."""
    made = njit(cache=True, fastmath=False, nogil=True, error_model="numpy")(function)
    return cast(Function, made)

"""Names for the array types that signatures use."""

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
"""Double-precision array; docstrings give the shape."""

Integers: TypeAlias = NDArray[np.int64]
Singles: TypeAlias = NDArray[np.float32]
Halves: TypeAlias = NDArray[np.int32]
"""Arrays of half the size, where kernels read much of them."""

Bytes: TypeAlias = NDArray[np.uint8]
Booleans: TypeAlias = NDArray[np.bool_]
AnyArray: TypeAlias = NDArray[Any]


def finite(*arrays: Floats) -> bool:
    """Tell whether every number of a few small arrays is finite: in plain floats, for loops."""
    for array in arrays:  # noqa: SIM110 (a generator would take as long again)
        if not all(map(math.isfinite, array.ravel().tolist())):
            return False
    return True


def within(values: Floats, limits: Floats) -> bool:
    """Tell whether every |value| is below its limit; in plain floats, as `finite`.

    Parameters
    ----------
    values, limits : array, shape (n,)
    """
    pairs = zip(values.tolist(), limits.tolist(), strict=True)
    for value, limit in pairs:  # noqa: SIM110 (a generator would take as long again)
        if not -limit < value < limit:
            return False
    return True

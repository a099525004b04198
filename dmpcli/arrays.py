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


def first_seen(values: Floats | Integers) -> tuple[Integers, Integers]:
    """Number values in the order in which each is first seen.

    Parameters
    ----------
    values : array, shape (n,)

    Returns
    -------
    numbers : array of int, shape (n,)
        From 0.
    first : array of int, shape (k,)
        Where each of the k values stands first, rising.
    """
    n = len(values)
    if n and (values == values[0]).all():
        return np.zeros(n, dtype=np.int64), np.zeros(1, dtype=np.int64)
    least, most = (int(values.min()), int(values.max())) if n else (0, 0)
    if values.dtype.kind == "f" or most - least > _SPAN + _TIMES * n:
        _, first, inverse = np.unique(values, return_index=True, return_inverse=True)
        of: Integers = np.asarray(inverse.reshape(-1), dtype=np.int64)
    else:  # without sorting: of the places of one number the last that is written stays
        of = np.asarray(values - least, dtype=np.int64)
        first = np.full(most - least + 1, n)
        first[of[::-1]] = np.arange(n - 1, -1, -1)
    order = np.argsort(first, kind="stable")
    rank = np.empty(len(first), dtype=np.int64)
    rank[order] = np.arange(len(first))
    first = first[order]
    return rank[of], first[first < n]


_SPAN, _TIMES = 1 << 16, 8
"""Whole numbers in so wide a range, and so many times as wide as they are many, are sorted."""

"""Rows of numbers as text with six decimals, compiled: what strokes come to in CSV files."""

import math
from collections.abc import Sequence

import numpy as np

from dmpcli.arrays import Bytes, Floats, Integers
from dmpcli.compiled import kernel

_WIDEST = 24
"""Characters of a number and its comma: those that would have more are left to Python."""

_LARGEST = 2.0**52
"""Millionths beyond this are no whole numbers any more."""

_COMMA, _LINE, _MINUS, _POINT, _ZERO = (int(byte) for byte in b",\n-.0")


@kernel
def written(heads: Bytes, ends: Integers, numbers: Floats, out: Bytes) -> int:
    """Write rows: a head, numbers with commas before them, an end of line.

    Parameters
    ----------
    heads : array of uint8
        What the rows begin with, one after the other.
    ends : array of int, shape (k,)
        Where each head ends.
    numbers : array, shape (k, c)
        Of those that are not finite the comma alone is written.
    out : array of uint8
        Long enough for `_WIDEST` a number.

    Returns
    -------
    int
        How long the text is; -1 where the last digit of a number is not known for sure.
    """
    digits = np.empty(24, dtype=np.uint8)
    at, begin = 0, 0
    for i in range(len(ends)):
        for j in range(begin, ends[i]):
            out[at] = heads[j]
            at += 1
        begin = ends[i]
        for j in range(numbers.shape[1]):
            out[at] = _COMMA
            at += 1
            value = numbers[i, j]
            if not np.isfinite(value):
                continue
            size = abs(value) * 1e6
            whole = math.floor(size)
            rest = size - whole
            # The product is rounded by half a unit in its last place at most.
            if size >= _LARGEST or abs(rest - 0.5) <= 1e-15 * size + 1e-300:
                return -1
            left = int(whole) + (1 if rest > 0.5 else 0)
            if math.copysign(1.0, value) < 0.0:
                out[at] = _MINUS
                at += 1
            held = 0
            while left > 0 or held < 7:
                digits[held] = _ZERO + left % 10
                left //= 10
                held += 1
            while held > 0:
                held -= 1
                out[at] = digits[held]
                at += 1
                if held == 6:
                    out[at] = _POINT
                    at += 1
        out[at] = _LINE
        at += 1
    return at


def rows(heads: Sequence[str], numbers: Floats) -> str | None:
    """Return rows of a CSV file: heads, then numbers (k, c) as ``%.6f`` or nothing without one.

    None where Python must write them: a number stands half way between two decimals, or is huge.
    """
    text = "".join(heads)
    sized = heads if text.isascii() else [head.encode() for head in heads]
    ends = np.cumsum(list(map(len, sized)), dtype=np.int64)
    whole = np.frombuffer(text.encode(), dtype=np.uint8)
    out = np.empty(len(whole) + len(heads) + _WIDEST * numbers.size, dtype=np.uint8)
    length = written(whole, ends, np.ascontiguousarray(numbers), out)
    return None if length < 0 else out[:length].tobytes().decode()

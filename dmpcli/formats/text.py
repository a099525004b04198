"""Numbers as text, many at a time."""

import math

import numpy as np

from dmpcli.arrays import Floats


def rows(values: Floats, line: str) -> list[str]:
    """Return one line per row.

    Parameters
    ----------
    values : array, shape (n, k)
    line : str
        With k fields of ``%``.
    """
    # Zero with a minus is a difference that nobody means.
    clean = np.asarray(values, dtype=float) + 0.0
    return [line % tuple(row) for row in clean.tolist()]


def number(value: float, digits: int) -> str:
    """Return a number with so many decimals, without trailing zeros or a minus before zero."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def significant(value: float, digits: int = 7) -> str:
    """Return a number to some significant digits, never with an exponent."""
    if value == 0.0:
        return "0"
    return number(value, max(0, digits - 1 - math.floor(math.log10(abs(value)))))

"""Checks of numbers that need no settings model."""

import math
from collections.abc import Sequence

from dmpcli.errors import InputError, beside


def within(option: str, values: Sequence[float], largest: float) -> None:
    """Refuse NaN and infinity, which the option parser lets pass, and numbers beyond all sense.

    Parameters
    ----------
    option : str
        What messages call the numbers.
    values : sequence of float
    largest : float
        Of their absolute values, in their unit.

    Raises
    ------
    InputError
        Names the option and the value.
    """
    for value in values:
        if not math.isfinite(value):
            raise InputError(f"{option}: {value} is not a finite number")
        if abs(value) > largest:
            said = beside(value, math.copysign(largest, value), ".6g")
            raise InputError(f"{option}: {said} is beyond {largest:g}; check its unit")

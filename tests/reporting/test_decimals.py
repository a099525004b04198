"""Numbers as text by a kernel: what Python writes, character for character."""

import numpy as np
import pytest

from dmpcli import extras
from tests.extras_here import needs

pytestmark = [needs(extras.FAST), pytest.mark.thorough]


def by_python(heads, numbers):
    return "".join(
        head + "".join(f",{x:.6f}" if np.isfinite(x) else "," for x in row) + "\n"
        for head, row in zip(heads, numbers.tolist(), strict=True)
    )


@pytest.mark.parametrize("scale", [1e-9, 1e-6, 1e-3, 1.0, 50.0, 1e5])
def test_numbers_of_every_size_are_written_as_python_does(scale):
    from dmpcli.reporting import decimals

    numbers = scale * np.random.default_rng(0).normal(size=(300, 5))
    numbers[::7, 1], numbers[3, 2], numbers[4] = np.nan, np.inf, [0.0, -0.0, 1.0, -1.0, scale]
    heads = [f"batch ä,{i},part-00000.parquet" for i in range(300)]
    assert decimals.rows(heads, numbers) == by_python(heads, numbers)


@pytest.mark.parametrize("value", [0.0000005, 1.5e-6 + 1e-6, 123.4567895, 0.5**7, 1e10, -1e300])
def test_what_stands_half_way_or_is_huge_is_left_to_python_or_right(value):
    from dmpcli.reporting import decimals

    numbers = np.array([[value, 1.0]])
    assert decimals.rows(["a"], numbers) in (None, by_python(["a"], numbers))


def test_halves_of_the_last_digit_are_left_to_python():
    from dmpcli.reporting import decimals

    halves = (np.arange(1, 200) + 0.5) * 1e-6
    assert all(decimals.rows(["a"], np.array([[x]])) is None for x in halves)


def test_no_rows_are_no_text():
    from dmpcli.reporting import decimals

    assert decimals.rows([], np.empty((0, 3))) == ""

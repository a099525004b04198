"""Signals whose alternations can be counted by hand."""

import pytest

from dmpcli.admittance.oscillation import AlternationDetector


def told(values, size=1.0, count=4, window=10.0, period=1.0):
    """The detector after all values, and what it said at each."""
    one = AlternationDetector(size, count, window)
    return one, [one.feel(period * i, value) for i, value in enumerate(values)]


def test_so_many_alternations_of_the_size_are_an_oscillation():
    one, said = told([0.0, 1.0, 0.0, 1.0, 0.0, 1.0])
    assert said == [False, False, False, False, True, True]
    assert one.swing == 1.0
    assert one.grows


def test_smaller_ones_are_none_however_many():
    one, said = told([0.0, 0.96875] * 20)
    assert not any(said)
    assert (one.swing, one.grows) == (0.0, False)


@pytest.mark.parametrize(("window", "counts"), [(3.0, True), (2.96875, False)])
def test_those_that_lie_back_further_than_the_window_are_forgotten(window, counts):
    # Four alternations at 1, 2, 3 and 4 s.
    assert told([0.0, 1.0, 0.0, 1.0, 0.0], window=window)[1][-1] is counts


def test_a_slow_rise_is_one_alternation_from_its_lowest_to_its_highest_value():
    one, said = told([2.0, 0.5, 1.0, 2.0, 3.0, 4.0, 4.5], count=2)
    # 2 → 0.5 is the first, and then the rise, which is the larger the longer it goes on.
    assert said == [False, False, False, True, True, True, True]
    assert one.swing == 4.0
    one, _ = told([0.0, -0.5, -1.0, -2.0, -3.0], count=2)
    assert one.swing == 3.0


def test_what_falls_first_is_turned_by_a_rise():
    assert told([0.0, -1.0, 0.0], count=2)[1] == [False, False, True]
    assert told([0.0, 1.0, 0.0], count=2)[1] == [False, False, True]
    # Once it has fallen by the size, a further fall is no alternation of its own.
    assert told([0.0, -1.0, -2.0, -3.0], count=2)[1] == [False] * 4
    assert told([0.0, 1.0, 2.0, 3.0], count=2)[1] == [False] * 4


def swinging(*sizes):
    """Values whose alternations have these sizes, up and down."""
    values, sign = [0.0], 1.0
    for size in sizes:
        values.append(values[-1] + sign * size)
        sign = -sign
    return values


@pytest.mark.parametrize(
    ("sizes", "grows"),
    [
        ((10, 10, 9, 9), True),
        ((10, 10, 9, 8.875), False),
        ((10, 10, 9, 9, 9), True),
        ((10, 10, 9, 9, 8.875), False),
        ((4, 5, 6, 7), True),
        ((9,), False),
        ((9, 9), True),
    ],
)
def test_it_grows_where_the_later_half_is_no_smaller_than_nine_tenths_of_the_earlier(sizes, grows):
    one, _ = told(swinging(*sizes))
    assert one.swing == max(sizes)
    assert one.grows is grows


def test_begun_anew_it_knows_nothing():
    one, _ = told([0.0, 1.0, 0.0, 1.0, 0.0])
    one.reset()
    assert (one.swing, one.grows) == (0.0, False)
    # Its first value is where it begins again, wherever it was before.
    assert [one.feel(5.0 + i, v) for i, v in enumerate([7.0, 8.0, 7.0, 8.0, 7.0])] == (
        [False] * 4 + [True]
    )

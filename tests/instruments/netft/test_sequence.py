import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.instruments.netft.sequence import TURN, Sequence, Verdict, ahead

STEP = 70  # readings inside the box from one record to the next


def judged(numbers, longest_jump=100):
    """Verdicts on records by their unwrapped numbers; the box's own counter goes along."""
    sequence = Sequence(longest_jump)
    return [sequence.judge(n % TURN, STEP * n % TURN) for n in numbers], sequence


@given(st.integers(0, TURN - 1), st.integers(-(TURN // 2), TURN // 2 - 1))
def test_distance_is_right_through_the_wrap(number, distance):
    assert ahead((number + distance) % TURN, number) == distance


def test_records_in_order_are_taken_and_none_is_lost():
    verdicts, sequence = judged(range(1, 50))
    assert set(verdicts) == {Verdict.TAKEN}
    assert sequence.lost == 0


def test_a_gap_is_taken_and_counted():
    _, sequence = judged([1, 2, 5, 6, 10])
    assert sequence.lost == 2 + 3


def test_records_before_the_first_that_came_are_lost():
    _, sequence = judged([4, 5])
    assert sequence.lost == 3


def test_a_box_that_does_not_begin_at_one_has_lost_nothing():
    verdicts, sequence = judged([5_000_000, 5_000_001])
    assert verdicts == [Verdict.TAKEN] * 2
    assert sequence.lost == 0


def test_what_came_twice_or_late_is_dropped():
    verdicts, sequence = judged([1, 2, 2, 4, 3, 5])
    assert verdicts == [
        Verdict.TAKEN,
        Verdict.TAKEN,
        Verdict.DUPLICATE,
        Verdict.TAKEN,
        Verdict.OLD,
        Verdict.TAKEN,
    ]
    assert sequence.lost == 1
    assert sequence.refused == {Verdict.DUPLICATE: 1, Verdict.OLD: 1}


@pytest.mark.parametrize("gap", [1, 3])
def test_both_counters_wrap(gap):
    verdicts, sequence = judged(range(TURN - 20, TURN + 20, gap))
    assert set(verdicts) == {Verdict.TAKEN}
    assert sequence.lost == (gap - 1) * (len(verdicts) - 1)


def test_the_boxs_own_counter_may_wrap_alone():
    sequence = Sequence(100)
    numbers = [(k, (TURN - 3 * STEP + STEP * k) % TURN) for k in range(1, 10)]
    assert {sequence.judge(*pair) for pair in numbers} == {Verdict.TAKEN}


def test_a_jump_no_stream_can_make_is_not_taken_and_changes_nothing():
    verdicts, sequence = judged([1, 2, 2 + 102, 3], longest_jump=100)
    assert verdicts == [Verdict.TAKEN, Verdict.TAKEN, Verdict.JUMP, Verdict.TAKEN]
    assert sequence.lost == 0
    verdicts, sequence = judged([1, 2, 2 + 101], longest_jump=100)
    assert verdicts[-1] is Verdict.TAKEN
    assert sequence.lost == 100


def test_a_counter_that_stands_still_or_goes_back_is_seen():
    sequence = Sequence(100)
    assert sequence.judge(1, 700) is Verdict.TAKEN
    assert sequence.judge(2, 700) is Verdict.STALL
    assert sequence.judge(3, 699) is Verdict.BACKWARD
    assert sequence.judge(4, 701) is Verdict.TAKEN
    assert sequence.lost == 2


@given(
    st.integers(1, TURN - 1),
    st.lists(st.integers(0, 60), min_size=1, max_size=80),
)
def test_whatever_the_network_does_what_is_taken_is_in_order_and_the_rest_is_counted(first, jumble):
    numbers = [first + offset for offset in jumble]
    verdicts, sequence = judged(numbers)
    taken = [n for n, v in zip(numbers, verdicts, strict=True) if v is Verdict.TAKEN]
    assert taken == sorted(set(taken))
    assert taken[-1] == max(numbers)
    missing_before = (first + jumble[0]) % TURN - 1
    counted = missing_before if 0 <= missing_before <= 100 else 0
    assert sequence.lost == counted + taken[-1] - taken[0] + 1 - len(taken)
    assert sum(sequence.refused.values()) == len(numbers) - len(taken)

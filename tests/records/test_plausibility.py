"""Units are doubted by what a stroke would be in them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.records import plausibility
from dmpcli.records.layouts import LENGTH, TIME
from dmpcli.records.plausibility import Measures, doubts, likely, measures

T = np.linspace(0.0, 8.0, 401)
LINE = np.column_stack([15.0 * T, 0 * T, 0 * T])


def test_the_measures_of_a_straight_stroke():
    found = measures(T, LINE)
    assert found.extent == pytest.approx(120.0)
    assert found.speed == pytest.approx(15.0)
    assert found.duration == pytest.approx(8.0)
    assert doubts(found, "mm", "s") == []


def test_rests_do_not_slow_the_mean_speed_nor_noise_quicken_it():
    rest = 1000
    t = np.arange(rest + len(T) + rest) * 0.02
    path = np.vstack([np.tile(LINE[0], (rest, 1)), LINE, np.tile(LINE[-1], (rest, 1))])
    assert measures(t, path).speed == pytest.approx(15.0, rel=0.15)
    noisy = path + np.random.default_rng(1).normal(0, 0.1, path.shape)
    assert measures(t, noisy).speed == pytest.approx(15.0, rel=0.25)


@given(st.sampled_from(["m", "cm", "in"]), st.sampled_from(["s", "ms", "us", "ns"]))
def test_a_hands_stroke_in_another_unit_is_doubted_naming_it(length, time):
    # 300 mm in 10 s are beyond doubt in mm and s, and in no two units of length at once.
    true = Measures(300.0, 30.0, 10.0)
    seen = true.scaled(1 / LENGTH[length], 1 / TIME[time])
    guess = likely(seen, "mm", "s")
    if seen.plausible():
        return
    assert seen.scaled(LENGTH[guess.get("length", "mm")], TIME[guess.get("time", "s")]).plausible()
    if length == "m":
        assert guess == {"length": "m"} | ({} if time == "s" else {"time": time})


@given(st.floats(5, 4000), st.floats(2, 1000))
def test_no_plausible_stroke_is_doubted(extent, speed):
    assert doubts(Measures(extent, speed, extent / speed), "mm", "s") == []


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (Measures(4.0, 1.0, 4.0), "is 4 mm large"),
        (Measures(6000.0, 100.0, 60.0), "is 6e+03 mm large"),
        (Measures(100.0, 0.4, 250.0), "moves at 0.4 mm/s in the mean"),
        (Measures(100.0, 2500.0, 1.0), "moves at 2.5e+03 mm/s in the mean"),
        (Measures(100.0, 1.0, 3700.0), "lasts 3700 s"),
    ],
)
def test_each_bound_is_doubted(found, said):
    (doubt,) = doubts(found, "mm", "s")
    assert said in doubt
    assert "-unit" in doubt


def test_metres_said_of_a_table_in_mm_are_doubted_naming_mm():
    assert likely(Measures(120_000.0, 15_000.0, 8.0), "m", "s") == {"length": "mm"}


def test_a_point_that_never_moves_has_no_speed():
    assert measures(T, np.zeros((len(T), 3))) == Measures(0.0, 0.0, 8.0)
    assert plausibility.EXTENT[0] > plausibility.REFUSED

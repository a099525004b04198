"""How many functions a stroke takes, and how a reproduction is judged."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from dmpcli.dmp import basis_search
from dmpcli.dmp.basis_search import Problem, Quality, Tolerance, judged, nearest, search
from dmpcli.dmp.curve import Curve
from dmpcli.dmp.transformation_system import TransformationGains, critical


def problem(position, duration, intervals=None, closed=False):
    """Problem of positions (M, 3) at even times."""
    x = np.column_stack([position, np.zeros((len(position), 3))])
    d = np.full(6, 20.0)
    spring = TransformationGains(critical(d), d, 0.5 * duration)
    curve = Curve.through(x, duration, intervals or len(x) - 1)
    return Problem(curve, spring, 1.0, "spacing", closed)


def loops(count, samples=3001, duration=30.0):
    t = np.linspace(0.0, 1.0, samples)
    a = 2 * np.pi * count * t
    return problem(
        np.column_stack([200 * t + 8 * np.sin(a), 10 * np.cos(a) - 10, 0 * t]), duration, 8 * count
    )


def test_a_simple_stroke_takes_as_many_as_the_paper():
    t = np.linspace(0.0, 1.0, 501)
    simple = problem(np.column_stack([100 * t, 20 * np.sin(2 * np.pi * t), 0 * t]), 5.0)
    for method in ("lwr", "ridge"):
        found = search(simple, method, Tolerance(0.1))
        assert len(found.basis) == basis_search.FIRST
        assert found.quality.excess(Tolerance(0.1)) <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("method", ["lwr", "ridge"])
def test_more_loops_take_more_and_stay_within_the_tolerance(method):
    sizes = []
    for count in (5, 15, 30):
        found = search(loops(count), method, Tolerance(0.1))
        assert found.quality.excess(Tolerance(0.1)) <= 1.0
        assert found.quality.end <= 1e-8
        sizes.append(len(found.basis))
    assert sizes == sorted(sizes)
    assert sizes[-1] > sizes[0]


def test_a_tighter_tolerance_takes_more():
    loose, tight = (search(loops(15), "lwr", Tolerance(x)) for x in (1.0, 0.02))
    assert len(tight.basis) * tight.passes > len(loose.basis) * loose.passes
    assert tight.quality.rms <= 0.02


def test_n_alone_is_taken_whatever_it_reaches():
    found = search(loops(30), "lwr", Tolerance(0.1), count=50)
    assert len(found.basis) == 50
    assert found.quality.excess(Tolerance(0.1)) > 1.0
    assert found.quality.end <= 1e-8


def test_passes_alone_are_taken():
    found = search(loops(10), "lwr", Tolerance(0.1), count=100, passes=2)
    assert found.passes == 2


def test_no_more_functions_than_the_band_carries():
    """Eleven samples, and a tolerance that nothing reaches."""
    t = np.linspace(0.0, 1.0, 11)
    few = problem(np.column_stack([100 * t, 20 * np.sin(4 * t), 0 * t]), 5.0)
    found = search(few, "lwr", Tolerance(1e-9))
    assert len(found.basis) <= max(basis_search.FIRST, 16 * 10)


def test_the_judge_sees_what_a_mean_does_not():
    ok = Quality(0.05, 0.3, 0.0, (30.0, 30.05), 0.0)
    assert ok.excess(Tolerance(0.1)) <= 1.0
    for worse in (
        Quality(0.11, 0.3, 0.0, None, 0.0),
        Quality(0.05, 0.41, 0.0, None, 0.0),
        Quality(0.05, 0.3, 0.0, (30.0, 30.2), 0.0),
        Quality(0.05, 0.3, 0.0, None, np.radians(0.11)),
    ):
        assert worse.excess(Tolerance(0.1)) > 1.0


def test_judging_a_stroke_that_lost_its_waves():
    t = np.linspace(0.0, 1.0, 801)
    there = np.zeros((801, 6))
    there[:, 0], there[:, 1] = 300 * t, 15 * np.sin(2 * np.pi * 9 * t)
    here = there * [1.0, 0.5, 1.0, 1.0, 1.0, 1.0]
    quality = judged(there, here, closed=False)
    assert quality.wave == pytest.approx((30.0, 15.0), abs=0.01)
    assert judged(there, there, closed=False).rms == pytest.approx(0.0, abs=1e-9)
    assert judged(there, here, closed=True).wave is None
    flat = there * [1.0, 0.0, 1.0, 1.0, 1.0, 1.0]
    assert judged(there, flat, closed=False).wave == (pytest.approx(30.0, abs=0.01), 0.0)


@pytest.mark.slow
@settings(max_examples=40)
@given(seed=st.integers(0, 1000))
def test_nearest_is_the_distance_to_a_dense_path(seed):
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, 400)
    k, a = rng.integers(1, 4, 3), rng.normal(0.0, 20.0, 3)
    path = a * np.sin(np.pi * np.outer(t, k)) + np.outer(t, [60.0, 0.0, 0.0])
    points = path[::7] + rng.normal(0.0, 0.5, (len(path[::7]), 3))
    fine = np.linspace(0.0, 1.0, 40_001)
    dense = np.column_stack([np.interp(fine, t, c) for c in path.T])
    np.testing.assert_allclose(nearest(points, path), cdist(points, dense).min(axis=1), atol=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["lwr", "ridge"])
def test_the_most_functions_stay_within_the_time_and_memory_of_their_samples(method):
    import tracemalloc

    tracemalloc.start()
    found = search(loops(30), method, Tolerance(0.1), count=2000)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.quality.rms <= 0.02
    assert peak < 2**29  # a dense matrix alone would be 250 MB, and there were several


def test_a_forced_response_is_negligible_by_the_extent_of_its_own_kind():
    """Positions of extent 5 beside angles of extent 12: the two are not added up."""
    u = np.linspace(0.0, 1.0, 11)[:, None]
    demonstrated = u * [3.0, 4.0, 0.0, 12.0, 0.0, 0.0]
    for size, factors in ((4.0, [1, 1]), (8.0, [3, 1]), (13.0, [3, 3])):
        forced = np.full((11, 6), basis_search.NEGLIGIBLE * size)
        found = basis_search._alpha_f(3.0 * forced, forced, demonstrated)
        np.testing.assert_allclose(found, np.repeat(factors, 3), rtol=1e-12)


def test_what_bulges_by_just_so_much_of_its_length_is_no_line():
    length = 1024.0
    for part, line in ((0.999, True), (1.0, False)):
        half = 0.5 * part * basis_search.LINE * length
        v = half * np.r_[np.sin(np.linspace(0.0, 2.0 * np.pi, 401))]
        v[[100, 300]] = half, -half
        x = np.column_stack([np.linspace(0.0, length, 401), v, 0.0 * v])
        found = basis_search.waves(x, x)
        assert found is None if line else found == pytest.approx((2.0 * half, 2.0 * half))

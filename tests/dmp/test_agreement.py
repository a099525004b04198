"""Which of several demonstrations does not belong, by hand."""

import numpy as np
import pytest

from dmpcli.dmp import agreement

U = np.linspace(0.0, 1.0, 201)
PATH = np.column_stack([200 * U, 30 * U * np.sin(2 * np.pi * U), 150 * U**2 * (1 - U)])
"""With a height that is another one backwards."""


def backwards(path):
    """As its own chart shows it: u from its start to its goal, turned about w."""
    return (path[::-1] - path[-1]) * [-1.0, -1.0, 1.0]


def told(paths):
    return [(doubt.index, doubt.kind) for doubt in agreement.reversals(np.array(paths))]


def test_the_other_way_is_told_in_its_own_chart_whatever_its_height():
    other = backwards(PATH)
    assert agreement._rms(PATH - other) > 5.0
    assert told([PATH, other, PATH, PATH]) == [(1, "opposite")]
    assert told([PATH, PATH[::-1], PATH]) == [(1, "opposite")]
    mirrored = other * [1.0, 1.0, -1.0]
    assert told([PATH, mirrored, PATH]) == []


@pytest.mark.parametrize("against", [[4], [3, 4], [0, 2]])
def test_fewer_than_half_that_run_the_other_way_are_the_ones_told(against):
    paths = [backwards(PATH) if i in against else PATH for i in range(5)]
    assert told(paths) == [(i, "opposite") for i in against]


def test_where_the_one_in_the_midst_is_of_the_minority_its_like_are_told():
    """Two that are alike to the last bit, and three the other way that differ a little."""
    rng = np.random.default_rng(1)
    other = [backwards(PATH) + rng.normal(0.0, 1.0, 3) for _ in range(3)]
    apart = agreement._apart(np.array([PATH, PATH, *other]))
    assert np.median(apart, axis=1).argmin() >= 2
    assert told([PATH, PATH, *other]) == [(0, "opposite"), (1, "opposite")]


def test_a_closed_path_begun_elsewhere_is_told_with_the_part_of_its_length():
    a = 2.0 * np.pi * U
    ring = np.column_stack([50 * np.cos(a) + 9 * np.cos(2 * a), 30 * np.sin(a), 0 * a])
    paths = np.array([ring, np.r_[ring[60:], ring[1:61]], ring])
    [doubt] = agreement.reversals(paths)
    assert (doubt.index, doubt.kind) == (1, "start")
    assert doubt.shift == pytest.approx(0.7)
    assert doubt.distance == pytest.approx(agreement.distances(paths)[1])
    back = np.array([ring, np.r_[ring[60:], ring[1:61]][::-1], ring])
    assert [d.kind for d in agreement.reversals(back)] == ["opposite"]


def test_a_path_is_closed_whose_gap_is_a_quarter_of_its_extent():
    for gap, closed in ((0.0, True), (0.24, True), (0.26, False)):
        path = np.array([[0.0, 0, 0], [3, 4, 0], [5 * gap, 0, 0]])
        path[1] *= 1.0
        size = np.linalg.norm(np.ptp(path, axis=0))
        path[2, 0] = gap * size
        assert agreement._closed(path) == closed


def test_distances_are_those_from_the_mean_of_the_others():
    x = np.random.default_rng(2).normal(size=(4, 30, 3))
    for i, found in enumerate(agreement.distances(x)):
        others = np.delete(x, i, axis=0).mean(axis=0)
        assert found == pytest.approx(np.sqrt(np.mean(np.sum((x[i] - others) ** 2, axis=1))))
    assert agreement.distances(x[:1]).tolist() == [0.0]
    assert agreement.spread(x) == pytest.approx(x.std(axis=0))


def test_an_outlier_is_five_times_as_far_as_the_others_and_beyond_the_noise():
    rng = np.random.default_rng(3)
    x = PATH + rng.normal(0.0, 0.5, (5, 1, 3))
    quiet, none = np.full(5, 0.1), np.empty(0, dtype=int)
    assert agreement.strangers(x, quiet, none) == []
    typical = np.median(agreement._apart(x), axis=1)
    x[2] = x.mean(axis=0) + [0.0, 20.0 * np.median(typical), 0.0]
    assert [(d.index, d.kind) for d in agreement.strangers(x, quiet, none)] == [(2, "outlier")]
    assert agreement.strangers(x, np.full(5, 20.0), none) == []
    assert agreement.strangers(x, quiet, np.array([2])) == []
    # Two alone cannot tell which of them it is.
    assert agreement.strangers(x[1:3], quiet[:2], none) == []
    shape = np.stack([x[0], x[1], PATH * [1.0, -8.0, 1.0]])
    assert [(d.index, d.kind) for d in agreement.strangers(shape, quiet, none)] == [(2, "shape")]


def test_one_between_two_that_run_the_other_way_each_in_another_manner_is_the_one_told():
    """One is recorded backward, the other seen in its own chart: far apart, and both against it."""
    others = [PATH[::-1], backwards(PATH)]
    assert told([PATH, *others]) == [(0, "opposite")]


@pytest.mark.parametrize("n", [1, 2])
def test_two_waves_to_either_side_are_told_though_they_are_near(n):
    """Their mean is a straight line, and they are less than a quarter of the extent apart."""
    wave = np.column_stack([190 * U, 31 * np.sin(4 * np.pi * U), 0 * U])
    x = np.array([wave] * n + [wave * [1.0, -1.0, 1.0]])
    assert agreement._apart(x)[0, -1] < 0.25 * np.linalg.norm([190, 62])
    found = agreement.strangers(x, np.full(n + 1, 0.05), np.empty(0, dtype=int))
    assert n in [doubt.index for doubt in found]
    higher = np.array([wave] * n + [wave * [1.0, 1.2, 1.0]])
    assert agreement.strangers(higher, np.full(n + 1, 8.0), np.empty(0, dtype=int)) == []

"""Damped Newton steps for feet: single steps by hand, and the search kept to what was best."""

import numpy as np

from dmpcli.surfaces import tangential
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere
from tests.surfaces import fields

PLATE = Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))


def charts(count):
    start = np.tile([[0.0, 0.0, 0.0]], (count, 1))
    return PLATE.charts(start, start + [50.0, 0.0, 0.0])


def state(count=2, samples=3):
    at = np.zeros((count, samples, 2))
    position = np.tile([30.0, 4.0, 2.0], (count, samples, 1))
    free = np.ones((count, samples), dtype=bool)
    return tangential._NewtonState(charts(count), position, at, free, None)


def test_a_stroke_that_fares_worse_keeps_what_was_best_while_another_fares_better():
    search = state()
    for gaps, ats in (([0.5, 0.9], [1.0, 1.0]), ([0.8, 0.4], [2.0, 2.0]), ([0.6, 0.3], [3.0, 3.0])):
        search.gap[:] = np.array(gaps)[:, None, None] * [1.0, 0.0]
        search.at[:] = np.array(ats)[:, None, None]
        search._keep(np.array([0, 1]))
    assert search.best.at[:, 0, 0].tolist() == [1.0, 3.0]
    np.testing.assert_allclose(search.score, [1.5, 0.9])


def test_what_is_far_counts_as_one_millimetre_and_what_is_held_not_at_all():
    search = state(1, 3)
    search.free[0, 2] = False
    search.gap[0] = [[30.0, 40.0], [0.3, 0.4], [9.0, 9.0]]
    search._keep(np.array([0]))
    np.testing.assert_allclose(search.score, [1.5])


def test_beyond_a_border_the_way_is_towards_the_position_and_its_half():
    mesh = Mesh(*fields.grid(lambda x, y: np.stack([x, y, 0 * x], -1), 9, 9, (-20, 20), (-20, 20)))
    start = np.array([[-10.0, 0.0, 0.0]])
    one = mesh.charts(start, start + [20.0, 0.0, 0.0])
    at = np.array([[[5.0, 3.0], [60.0, 0.0], [29.8, 0.0]]])
    position = np.zeros((1, 3, 3))
    free = np.ones((1, 3), dtype=bool)
    search = tangential._NewtonState(one, position, at, free, None)
    search._difference(np.array([0]))
    assert search.fresh.tolist() == [True]
    np.testing.assert_array_equal(search.jacobian[0, 1:], np.tile(-np.eye(2), (2, 1, 1)))
    np.testing.assert_allclose(search.jacobian[0, 0], -np.eye(2), atol=1e-9)
    np.testing.assert_allclose(search.at[0], [[5.0, 3.0], [30.0, 0.0], [29.8, 0.0]])
    np.testing.assert_allclose(search.gap[0, 0], [5.0, -3.0], atol=1e-9)


def test_a_step_solves_its_two_equations_or_goes_towards_the_position():
    J = np.array([[[[2.0, 1.0], [0.5, 3.0]], [[0.2, 0.0], [0.0, 0.2]], [[-1.0, 0.0], [0, 1.0]]]])
    gap = np.array([[[1.0, -2.0], [3.0, 4.0], [3.0, 4.0]]])
    found = tangential._solve(J, gap)
    np.testing.assert_allclose(found[0, 0], np.linalg.solve(J[0, 0], gap[0, 0]))
    np.testing.assert_allclose(found[0, 1:], -gap[0, 1:])
    assert not tangential._solve(J, np.full((1, 3, 2), np.nan)).any()


def test_steps_are_no_longer_than_their_bound():
    found = tangential._limited(np.array([[[30.0, 40.0], [3.0, 4.0], [0.0, 0.0]]]))
    np.testing.assert_allclose(found, [[[12.0, 16.0], [3.0, 4.0], [0.0, 0.0]]])


def test_a_jacobian_carried_on_foretells_the_step_that_was_taken():
    rng = np.random.default_rng(1)
    J, move, change = (
        rng.normal(size=(2, 4, 2, 2)),
        rng.normal(size=(2, 4, 2)),
        rng.normal(size=(2, 4, 2)),
    )
    free = np.ones((2, 4), dtype=bool)
    free[0, 1] = False
    change[1, 2] = np.nan
    move[1, 3] = 0.0
    found = tangential._carried_on(J, move, change, free)
    foretold = np.einsum("btij,btj->bti", found, move)
    kept = np.array([[0, 1, 0, 0], [0, 0, 1, 1]], dtype=bool)
    np.testing.assert_array_equal(found[kept], J[kept])
    np.testing.assert_allclose(foretold[~kept], change[~kept], atol=1e-12)
    square = np.stack([-move[..., 1], move[..., 0]], axis=-1)  # nothing else is learned
    np.testing.assert_allclose(np.einsum("btij,btj->bti", found - J, square), 0.0, atol=1e-12)


def test_the_nearer_of_two_feet_is_kept_unless_it_is_to_be_replaced():
    def sought(at, height, good):
        count = len(height)
        return tangential.Sought(
            np.full((1, count, 2), at),
            np.array([height]),
            np.full((1, count), at),
            np.array([good]),
        )

    one = sought(1.0, [1.0, -1.0, 3.0, 1.0], [True, True, False, True])
    two = sought(2.0, [-0.5, 2.0, 9.0, 0.5], [True, True, True, True])
    free = np.array([[True, True, True, False]])
    better = one.better(two, free)
    assert better.height.tolist() == [[-0.5, -1.0, 9.0, 1.0]]
    assert better.at[0, :, 0].tolist() == better.area[0].tolist() == [2.0, 1.0, 2.0, 1.0]
    assert better.good.all()
    assert one.better(two, free, replace=True).height.tolist() == [[-0.5, 2.0, 9.0, 1.0]]
    without = one.without(np.array([[True, False, False, False]]), np.full((1, 4, 2), 7.0))
    assert without.good.tolist() == [[False, True, False, True]]
    assert without.at[0, :, 1].tolist() == [7.0, 1.0, 1.0, 1.0]
    assert without.height[0].tolist() == [0.0, -1.0, 3.0, 1.0]


def test_differences_are_taken_so_near_that_even_a_small_ball_is_nearly_flat_there():
    """On a ball of 2 mm: a quotient over 1.5 mm would be off by a tenth."""
    ball = Sphere(np.zeros(3), 2.0)
    start = np.array([[2.0, 0.0, 0.0]])
    one = ball.charts(start, np.array([[0.0, 2.0, 0.0]]))
    free = np.ones((1, 1), dtype=bool)
    search = tangential._NewtonState(one, start[:, None], np.zeros((1, 1, 2)), free, None)
    search._difference(np.array([0]))
    np.testing.assert_allclose(search.jacobian[0, 0], -np.eye(2), atol=0.02)


def test_a_gap_of_just_a_nanometre_is_settled():
    search = state(2, 1)
    search.gap[:, 0, 0], search.gap[:, 0, 1] = [1e-6, np.nextafter(1e-6, 1.0)], 0.0
    assert search.live().tolist() == [1]


def test_a_gap_that_is_no_less_than_half_of_the_least_has_stalled(monkeypatch):
    search = state(2, 1)
    search.fresh[:], search.least[:] = True, 2.0
    search.gap[:, 0], search.jacobian[:] = [2.0, 0.0], -np.eye(2)
    now = np.array([[[1.0, 0.0]], [[np.nextafter(1.0, 0.0), 0.0]]])
    monkeypatch.setattr(search, "_look", lambda *_: (now, np.zeros((2, 1))))
    search.step(np.array([0, 1]))
    assert search.stalled.tolist() == [[1], [0]]


def test_nothing_is_learned_from_a_change_that_is_known_in_one_part_only():
    J, free = -np.eye(2)[None, None], np.ones((1, 1), dtype=bool)
    for change in ([np.nan, 1.0], [1.0, np.nan]):
        found = tangential._carried_on(J, np.array([[[1.0, 2.0]]]), np.array([[change]]), free)
        np.testing.assert_array_equal(found, J)

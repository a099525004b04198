"""Polygons cut into triangles: what they enclose is covered once, whatever the first corner."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.spatial import rotations
from dmpcli.surfaces import polygons

U = [[0, 0], [60, 0], [60, 40], [40, 40], [40, 10], [20, 10], [20, 40], [0, 40]]


def cut(*outlines, turn=(0.0, 0.0, 0.0)):
    """Cut flat outlines, turned in space."""
    flat = np.concatenate([np.asarray(o, dtype=float) for o in outlines])
    V = np.column_stack([flat, np.zeros(len(flat))]) @ rotations.exp(np.array(turn)).T
    return V, polygons.cut(V, np.arange(len(V)), np.array([len(o) for o in outlines]))


def areas(V, F, turn=(0.0, 0.0, 0.0)):
    """Signed areas of triangles about the turned z axis."""
    a, b, c = np.moveaxis(V[F], 1, 0)
    return np.cross(b - a, c - a) @ rotations.exp(np.array(turn))[:, 2] / 2.0


def shoelace(outline):
    x, y = np.asarray(outline, dtype=float).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2.0)


@pytest.mark.parametrize("first", range(8))
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.3, -1.1, 0.7), (np.pi, 0.0, 0.0)])
def test_a_notch_stays_empty_whatever_the_first_corner(first, turn):
    V, found = cut(np.roll(U, first, axis=0), turn=turn)
    size = areas(V, found.F, turn)
    assert size.min() > 0.0, "wound as the outline is"
    assert size.sum() == pytest.approx(1800.0)
    assert len(found.crossed) == 0
    middle = V[found.F].mean(axis=1) @ rotations.exp(np.array(turn))
    assert not np.any((abs(middle[:, 0] - 30) < 10) & (middle[:, 1] > 10))


@pytest.mark.parametrize("first", range(4))
def test_an_arrowhead_of_four_corners_is_cut_at_its_notch(first):
    V, found = cut(np.roll([[0, 0], [10, 0], [2, 2], [0, 10]], first, axis=0))
    size = areas(V, found.F)
    assert size.min() > 0.0
    assert size.sum() == pytest.approx(20.0)


@pytest.mark.parametrize("first", range(4))
def test_a_bent_quadrilateral_gets_the_same_diagonal_whatever_its_first_corner(first):
    V = np.array([[0, 0, 0], [10, 0, 1], [12, 12, 0], [0, 10, 1]], dtype=float)
    found = polygons.cut(V, np.roll(np.arange(4), first), np.array([4]))
    assert {1, 3} <= set(found.F[0].tolist()) & set(found.F[1].tolist())


def test_a_hole_that_is_reached_by_a_bridge_stays_empty():
    hole = [
        [0, 0],
        [40, 0],
        [40, 40],
        [0, 40],
        [0, 0],
        [10, 10],
        [10, 30],
        [30, 30],
        [30, 10],
        [10, 10],
    ]
    V, found = cut(hole)
    assert areas(V, found.F).min() >= 0.0
    assert areas(V, found.F).sum() == pytest.approx(1200.0)
    assert len(found.crossed) == 0


def test_outlines_that_cross_themselves_are_told():
    bow, square = [[0, 0], [10, 10], [10, 0], [0, 10]], [[0, 0], [1, 0], [1, 1], [0, 1]]
    star = [[np.cos(a), np.sin(a)] for a in np.arange(5) * 4 * np.pi / 5]
    _, found = cut(square, bow, star, U)
    assert found.crossed.tolist() == [1, 2]


def test_triangles_come_in_the_order_of_the_polygons():
    shapes = [U, U[:3], [[0, 0], [1, 0], [1, 1], [0, 1]], U, U[:3]]
    _, found = cut(*shapes)
    begins = np.cumsum([0] + [len(s) for s in shapes])
    owner = np.searchsorted(begins, found.F, side="right") - 1
    assert (owner == owner[:, :1]).all()
    assert np.bincount(owner[:, 0]).tolist() == [6, 1, 2, 6, 1]
    assert (np.diff(owner[:, 0]) >= 0).all()


def test_no_polygons_make_no_triangles():
    nothing = np.empty(0, dtype=np.int64)
    assert polygons.cut(np.empty((0, 3)), nothing, nothing).F.shape == (0, 3)


def test_a_round_outline_of_many_corners_is_cut_and_a_comb_of_many_is_not():
    angle = np.linspace(0.0, 2 * np.pi, 200_000, endpoint=False)
    disc = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) * 100.0
    all_of_it = np.arange(len(disc)), np.array([len(disc)])
    assert polygons.too_large(disc, *all_of_it) is None
    found = polygons.cut(disc, *all_of_it)
    assert areas(disc, found.F).sum() == pytest.approx(np.pi * 1e4, rel=1e-8)
    teeth = disc * (1.0 + 0.1 * (np.arange(len(disc)) % 2))[:, None]
    assert polygons.too_large(teeth, *all_of_it) == 0


outlines = st.integers(3, 40).flatmap(
    lambda n: st.tuples(
        st.lists(st.floats(0.2, 1.0), min_size=n, max_size=n),
        st.lists(st.floats(0.1, 1.0), min_size=n, max_size=n),
        st.integers(0, n - 1),
        st.booleans(),
    )
)


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(outlines, st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_the_area_of_any_outline_is_kept_whatever_its_first_corner(shape, turn):
    radii, gaps, first, clockwise = shape
    # Seen from the middle no corner hides another: such an outline never crosses itself.
    angle = np.cumsum(gaps) / np.sum(gaps) * 2 * np.pi
    outline = 30.0 * np.array(radii)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    outline = np.roll(outline, first, axis=0)[:: -1 if clockwise else 1]
    whole = shoelace(outline)
    V, found = cut(outline, U, turn=turn)
    size = areas(V, found.F, turn)
    ours = found.F[:, 0] < len(outline)
    assert size[ours].sum() == pytest.approx(whole, rel=1e-9, abs=1e-9)
    assert np.abs(size[ours]).sum() == pytest.approx(abs(whole), rel=1e-6, abs=1e-9)
    assert size[~ours].sum() == pytest.approx(1800.0)

"""The places that are proposed for a stroke lie on the part, and a stroke between them has room."""

import numpy as np
import pytest

from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.open_patches import Footprint, open_patches, places_for
from tests.records.meshes import box


def ball(radius, rings=40, sides=64):
    """A closed sphere, wound outwards."""
    polar = np.linspace(0.0, np.pi, rings + 1)[1:-1]
    around = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.stack(
        [
            np.outer(np.sin(polar), np.cos(around)),
            np.outer(np.sin(polar), np.sin(around)),
            np.repeat(np.cos(polar)[:, None], sides, axis=1),
        ],
        axis=-1,
    ).reshape(-1, 3)
    V = radius * np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])
    at = np.arange((rings - 1) * sides).reshape(rings - 1, sides)
    a, b = at[:-1].ravel(), np.roll(at, -1, axis=1)[:-1].ravel()
    c, d = at[1:].ravel(), np.roll(at, -1, axis=1)[1:].ravel()
    top, low = len(V) - 2, len(V) - 1
    F = np.concatenate(
        [
            np.stack([a, c, b], axis=1),
            np.stack([b, c, d], axis=1),
            np.stack([np.full(sides, top), at[0], np.roll(at[0], -1)], axis=1),
            np.stack([np.full(sides, low), np.roll(at[-1], -1), at[-1]], axis=1),
        ]
    )
    return V, F


def test_of_a_block_the_top_comes_first_and_the_way_is_along_its_longer_side():
    V, F = box((100.0, 60.0, 40.0))
    found = open_patches(V, F)
    top = found[0]
    assert top.area == pytest.approx(6000.0)
    np.testing.assert_allclose(top.normal, [0.0, 0.0, 1.0], atol=1e-12)
    assert top.start[2] == pytest.approx(V[:, 2].max())
    np.testing.assert_allclose(top.goal - top.start, [60.0, 0.0, 0.0], atol=1e-9)
    assert [round(one.area) for one in found[1:]] == [6000, 4000, 4000]


@pytest.mark.parametrize(
    ("size", "way"),
    [((60.0, 100.0, 40.0), [0.0, 60.0, 0.0]), ((10.0, 60.0, 100.0), [0.0, 0.0, 60.0])],
)
def test_a_way_that_has_no_x_leads_towards_plus_y_and_one_without_both_upwards(size, way):
    """Of the largest faces: the top, and a side that stands."""
    found = max(open_patches(*box(size), 6), key=lambda one: one.area)
    np.testing.assert_allclose(found.goal - found.start, way, atol=1e-9)


def test_a_way_has_room_beside_it_also_where_the_middle_of_the_patch_is_near_its_rim():
    """An L of two blocks: the middle of its top lies at the inner corner."""
    outline = np.array([[0, 0], [100, 0], [100, 20], [20, 20], [20, 80], [0, 80]], dtype=float)
    V = np.concatenate([np.column_stack([outline, np.full(6, z)]) for z in (0.0, 10.0)])
    cap = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    sides = [[i, (i + 1) % 6, 6 + (i + 1) % 6] for i in range(6)]
    sides += [[i, 6 + (i + 1) % 6, 6 + i] for i in range(6)]
    F = np.concatenate([cap[:, ::-1], cap + 6, sides])
    top = open_patches(V, F)[0]
    assert top.normal[2] == pytest.approx(1.0)
    for point in (top.start, top.goal):
        x, y, z = point
        assert z == pytest.approx(10.0)
        assert (1.0 < y < 19.0 and 1.0 < x < 99.0) or (1.0 < x < 19.0 and 1.0 < y < 79.0)


def test_a_curved_surface_has_one_patch_and_its_way_lies_on_it():
    V, F = ball(80.0)
    [found] = open_patches(V, F)
    assert found.area == pytest.approx(4.0 * np.pi * 80.0**2, rel=0.01)
    for point in (found.start, found.goal):
        assert Mesh(V, F).closest(point[None]).distance[0] < 1e-9
        assert np.linalg.norm(point) == pytest.approx(80.0, rel=0.01)


def test_two_equal_calls_give_equal_bytes():
    V, F = ball(80.0)
    first, second = open_patches(V, F)[0], open_patches(V, F)[0]
    assert first.start.tobytes() == second.start.tobytes()


def wave(length=40.0, height=10.0):
    s = np.linspace(0.0, 1.0, 5)
    path = np.column_stack([length * s, 0.5 * height * np.sin(2 * np.pi * s)])
    return Footprint(length, path)


def laid_on(patch, stroke):
    """The stroke's points on the plane between its start and goal."""
    u = patch.goal - patch.start
    stretch = np.linalg.norm(u) / stroke.length
    u = u / np.linalg.norm(u)
    v = np.cross(patch.normal, u)
    return patch.start + stretch * stroke.path[:, :1] * u + stroke.path[:, 1:] * v


def lengths_and_turns(found):
    way = [patch.goal - patch.start for patch in found]
    length = np.array([np.linalg.norm(u) for u in way])
    return length, np.degrees([np.arctan2(u[1], u[0]) for u in way])


def test_on_a_block_a_stroke_lies_in_the_middle_of_its_top_first_and_from_left_to_right():
    V, F = box((100.0, 60.0, 40.0))
    patches = list(places_for(V, F, wave(), 2))
    assert len(patches) == 2
    first = patches[0][0]
    np.testing.assert_allclose(first.start, [-20.0, 0.0, 20.0], atol=1e-9)
    np.testing.assert_allclose(first.goal, [20.0, 0.0, 20.0], atol=1e-9)
    assert len(patches[0]) == 3
    # To be turned a little costs less than to lie beside the middle.
    length, turn = lengths_and_turns(patches[0])
    np.testing.assert_allclose(length, 40.0)
    np.testing.assert_allclose(turn, [0.0, 0.0, 15.0], atol=1e-6)
    beside = [0.5 * (patch.start + patch.goal) for patch in patches[0]]
    np.testing.assert_allclose(beside, np.tile([0.0, 0.0, 20.0], (3, 1)), atol=1e-9)


def test_a_stroke_lies_whole_within_each_place_that_is_named_for_it():
    V, F = box((100.0, 60.0, 40.0))
    for stroke in (wave(38.0, 30.0), wave(70.0, 20.0)):
        for found in places_for(V, F, stroke, 3):
            for patch in found:
                points = laid_on(patch, stroke)
                assert (np.abs(points) <= np.array([50.0, 30.0, 20.0]) + 1e-6).all()
                assert np.linalg.norm(patch.goal - patch.start) >= 0.55 * stroke.length - 1e-9


def test_what_is_too_long_for_a_face_is_turned_and_shortened_or_not_laid_there():
    V, F = box((100.0, 60.0, 40.0))
    length, turn = lengths_and_turns(next(places_for(V, F, wave(85.0, 4.0), 1)))
    np.testing.assert_allclose(length, 85.0)
    np.testing.assert_allclose(turn[0], 0.0, atol=1e-9)
    # The top is 116.6 mm from corner to corner.
    length, turn = lengths_and_turns(next(places_for(V, F, wave(150.0, 4.0), 1)))
    np.testing.assert_allclose(length, 0.7 * 150.0)
    np.testing.assert_allclose(
        np.abs(turn) % 180.0 % 150.0, 30.0 * (np.abs(turn) % 180.0 < 90.0), atol=1e-6
    )
    assert next(places_for(V, F, wave(300.0, 4.0), 1)) == []
    # 70 mm across its line it has room aslant alone.
    across = Footprint(20.0, wave().path * [0.5, 7.0])
    found = next(places_for(V, F, across, 1))
    assert lengths_and_turns(found)[1].min() >= 30.0 - 1e-6
    assert all((np.abs(laid_on(patch, across)) <= [50.0, 30.0, 20.1]).all() for patch in found)


def test_on_a_face_that_looks_along_x_the_line_is_along_y():
    V, F = box((10.0, 100.0, 60.0))
    for found in places_for(V, F, wave(), 2):
        for patch in found[:1]:
            u = patch.goal - patch.start
            assert abs(patch.normal[0]) == pytest.approx(1.0) or patch.normal[2] > 0.9
            if abs(patch.normal[0]) > 0.9:
                np.testing.assert_allclose(u, [0.0, 40.0, 0.0], atol=1e-9)


def test_of_a_ball_the_upper_side_is_drawn_on_and_a_closed_stroke_is_not_turned():
    V, F = ball(40.0, 20, 32)
    open_ = next(iter(places_for(V, F, wave(20.0, 4.0))))
    assert all(patch.start[2] > 25.0 and patch.goal[2] > 25.0 for patch in open_)
    a = np.linspace(0.0, 2.0 * np.pi, 25)
    circle = Footprint(0.0, 5.0 * np.column_stack([np.cos(a) - 1.0, np.sin(a)]))
    for patch in next(iter(places_for(V, F, circle))):
        np.testing.assert_array_equal(patch.start, patch.goal)
        assert patch.start[2] > 25.0


def test_places_are_looked_for_on_eight_patches_unless_told_otherwise():
    V, F = box((100.0, 60.0, 40.0))
    two = np.concatenate([V, V + [300.0, 0.0, 0.0]]), np.concatenate([F, F + len(V)])
    too_long = Footprint(0.0, np.array([[0.0, 0.0], [900.0, 0.0]]))
    assert list(places_for(*two, too_long)) == [[]] * 8
    assert list(places_for(*two, too_long, 12)) == [[]] * 12

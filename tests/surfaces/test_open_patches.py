"""The places that are proposed for a stroke lie on the part, and a stroke between them has room."""

import numpy as np
import pytest

from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.open_patches import open_patches
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

"""Many strokes on a surface have the figures that `on_surface` gives each of them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.metrics import many_on_surface as many
from dmpcli.metrics import on_surface as one


def taught(random, m, loops):
    s = np.linspace(0.0, 1.0, m)
    u = 100.0 * s + 30.0 * np.sin(2 * np.pi * loops * s)
    v = 40.0 * np.sin(4 * np.pi * s) + random.normal(0.0, 0.01, m)
    return s, np.column_stack([u, v, 5.0 * np.maximum(0.0, np.sin(9.0 * s))])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.integers(2, 300), st.sampled_from([0, 2, 5]))
def test_heights_are_taken_where_the_demonstration_passes_nearest(seed, m, loops):
    random = np.random.default_rng(seed)
    s, place = taught(random, m, loops)
    stretch = random.uniform(0.3, 3.0, 4)
    t = np.sort(random.uniform(0.0, 1.0, 60))
    uv = np.stack([np.interp(t, s, place[:, k]) for k in (0, 1)])[:, None].repeat(4, axis=1)
    uv[0] *= stretch[:, None]
    uv += random.normal(0.0, 10.0 ** random.uniform(-6, 1.5), uv.shape)
    found = many.TaughtHeights(s, place).at(t, uv, stretch)
    for i, k in enumerate(stretch):
        wanted = one.height_there(uv[:, i].T, place * [k, 1.0, 1.0])
        np.testing.assert_allclose(found[i], wanted, atol=1e-9)


def test_a_level_demonstration_has_one_height():
    place = np.column_stack([np.arange(5.0), np.zeros(5), np.full(5, 0.25)])
    found = many.TaughtHeights(np.linspace(0, 1, 5), place)
    assert (found.at(np.zeros(3), np.zeros((2, 2, 3)), np.ones(2)) == 0.25).all()


@pytest.mark.parametrize("seed", [0, 1])
def test_lengths_tilts_and_heights_are_those_of_each_stroke(seed):
    random = np.random.default_rng(seed)
    foot = random.normal(0.0, 50.0, (3, 40, 3))
    normal = random.normal(size=(3, 40, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    position = foot + random.normal(0.0, 2.0, (3, 40, 1)) * normal
    heights, lengths = many.heights(position, foot, normal), many.path_lengths(foot)
    rotation = np.linalg.qr(random.normal(size=(3, 40, 3, 3)))[0]
    tilts = many.tilts(-rotation[..., 2], normal)
    stretched = many.stretched_lengths(foot[0, :, :2], np.array([0.5, 2.0]))
    for i in range(3):

        def there(_, found=(foot[i], normal[i])):
            return found

        wanted = one.height(position[i], there)
        np.testing.assert_allclose(heights[i], wanted, atol=1e-12)
        np.testing.assert_allclose(tilts[i], one.tilt(rotation[i], normal[i]), atol=1e-12)
        steps = np.linalg.norm(np.diff(foot[i], axis=0), axis=1)
        assert lengths[i] == pytest.approx(steps.sum())
    for k, found in zip((0.5, 2.0), stretched, strict=True):
        steps = np.linalg.norm(np.diff(foot[0, :, :2] * [k, 1.0], axis=0), axis=1)
        assert found == pytest.approx(steps.sum())


def test_heights_that_rounding_alone_tells_apart_are_level(monkeypatch):
    phase = np.linspace(0.0, 1.0, 40)
    place = np.stack([9.0 * phase, np.sin(9.0 * phase), 2.0 + 1e-14 * np.sin(99.0 * phase)], axis=1)
    taught = many.TaughtHeights(phase, place)
    monkeypatch.setattr(taught, "_nearest", None)  # nothing is looked for
    uv = np.stack([place[:, :2].T + 0.3] * 3, axis=1)
    assert taught.at(phase, uv, np.array([0.5, 1.0, 2.0])) == pytest.approx(2.0, abs=1e-12)

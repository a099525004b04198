"""Kernels measure strokes as numpy does, but for rounding; the nearest is the nearest of all."""

import numpy as np
import pytest

from dmpcli import extras
from dmpcli.metrics import deviation, many_on_surface, motion, wave_height
from dmpcli.spatial import rotations
from tests.extras_here import needs
from tests.metrics.varied import strokes

pytestmark = [needs(extras.FAST), pytest.mark.thorough]


def alike(found, wanted):
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)


def to_all_segments(points, corners):
    """Distances of points (n, 3) to the nearest of all segments of a curve (m, 3)."""
    a, b = corners[:-1], np.diff(corners, axis=0)
    gap = points[:, None] - a
    size = np.maximum(np.sum(b * b, axis=1), 1e-300)
    share = np.clip(np.sum(gap * b, axis=-1) / size, 0.0, 1.0)
    return np.linalg.norm(gap - share[..., None] * b, axis=-1).min(axis=1)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("corners", [2, 3, 40, 300])
def test_the_nearest_segment_is_the_nearest_of_all(seed, corners):
    rng = np.random.default_rng(seed)
    place = strokes(rng, 2, corners)[seed % 2]
    if seed == 3:
        place = np.concatenate([place, place[::-1]])  # there and back, over the same places
    wide = rng.uniform(0.3, 2.5, 5)
    off = 10.0 ** rng.uniform(-7, 1.5, (5, 1, 1))
    path = (
        strokes(rng, 5, 60) if seed == 4 else place[np.linspace(0, len(place) - 1, 60).astype(int)]
    )
    x = path * np.stack([wide, 1 + 0 * wide, 1 + 0 * wide], -1)[:, None]
    x = x + off * rng.normal(size=(5, 60, 3))
    taught = deviation.Taught(np.sort(rng.uniform(0, 9, len(place))), place, compiled=True)
    t = np.linspace(0.0, 2.0, 60)
    found = taught.deviations(t, x.transpose(2, 0, 1), wide)
    for i, stretch in enumerate(wide):
        apart = to_all_segments(x[i], place * [stretch, 1.0, 1.0])
        assert found.nearest_max[i] == pytest.approx(apart.max(), rel=1e-9, abs=1e-12)
        assert found.nearest_rms[i] == pytest.approx(np.sqrt(np.mean(apart**2)), abs=1e-12)
    pure = deviation.Taught(taught.phase, place).deviations(t, x.transpose(2, 0, 1), wide)
    alike(found.phase_rms, pure.phase_rms)
    alike(found.phase_max, pure.phase_max)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("corners", [2, 30, 250])
def test_heights_are_those_beside_the_nearest_corner_of_all(seed, corners):
    rng = np.random.default_rng(seed)
    place = strokes(rng, 2, corners)[seed % 2]
    place[:, 2] = rng.normal(size=corners)
    if seed == 2:
        place[corners // 3 : corners // 2] = place[corners // 3]  # a rest: the first one counts
    wide = rng.uniform(0.3, 2.5, 4)
    x = place[np.linspace(0, corners - 1, 50).astype(int)]
    x = x * np.stack([wide, 1 + 0 * wide, 1 + 0 * wide], -1)[:, None]
    uv = (x + 10.0 ** rng.uniform(-6, 1.5) * rng.normal(size=x.shape)).transpose(2, 0, 1)[:2]
    phase = np.linspace(0.0, 1.0, corners)
    found = many_on_surface.TaughtHeights(phase, place, compiled=True).at(
        np.linspace(0, 1, 50), uv, wide
    )
    for b, stretch in enumerate(wide):
        flat = place[:, :2] * [stretch, 1.0]
        for i, p in enumerate(uv[:, b].T):
            at = int(np.argmin(np.linalg.norm(flat - p, axis=1)))
            best, height = np.inf, 0.0
            for one in (max(at - 1, 0), min(at, corners - 2)):
                a, way = flat[one], flat[one + 1] - flat[one]
                share = np.clip((p - a) @ way / max(way @ way, 1e-300), 0.0, 1.0)
                apart = float(np.linalg.norm(p - a - share * way))
                if apart < best - 1e-12:
                    best, height = (
                        apart,
                        place[one, 2] + share * np.diff(place[one : one + 2, 2])[0],
                    )
            assert found[b, i] == pytest.approx(height, abs=1e-6)


@pytest.mark.parametrize("samples", [5, 6, 33, 120, 501])
@pytest.mark.parametrize("step", [0.02, 0.1, 1 / 16])
def test_motions_are_those_of_numpy(samples, step):
    rng = np.random.default_rng(samples)
    x = strokes(rng, 6, samples)
    x[3] = x[3, 0]
    x[4, : samples // 2] = x[4, 0]
    p = np.ascontiguousarray(x.transpose(2, 0, 1))
    t = 3.0 + step * np.arange(samples)
    for at in (t, t + 0.3 * step * np.sin(np.arange(samples))):
        pure = motion.motions(at, p, x[:, 1], x[:, -2])
        found = motion.motions(at, p, x[:, 1], x[:, -2], compiled=True)
        for name in ("length", "peak_speed", "start_error", "goal_error", "ldlj", "sparc"):
            alike(getattr(found, name), getattr(pure, name))
        assert np.isnan(found.ldlj[3])


@pytest.mark.parametrize("samples", [3, 7, 40, 400])
def test_turning_points_are_those_of_numpy(samples):
    rng = np.random.default_rng(samples)
    v = np.concatenate(
        [
            strokes(rng, 6, samples)[..., 1],
            np.round(strokes(rng, 3, samples)[..., 1]),
            np.cumsum(rng.integers(-1, 2, (3, samples)), axis=1),
            np.where(np.arange(samples) % 2, 1.0, -1.0)[None],  # more turns than there is room for
            np.zeros((1, samples)),
        ]
    )
    length, closed = np.full(len(v), 60.0), np.arange(len(v)) == 1
    for share in (0.01, 0.1, 0.7):
        pure = wave_height.many_waves(v, length, closed, share)
        found = wave_height.many_waves(v, length, closed, share, compiled=True)
        np.testing.assert_array_equal(found.stroke, pure.stroke)
        np.testing.assert_array_equal(found.index, pure.index)
        np.testing.assert_array_equal(found.value, pure.value)


def test_tilts_heights_lengths_and_spreads_are_those_of_numpy():
    from dmpcli.metrics.kernels import lying
    from dmpcli.metrics.kernels import strokes as kernels

    rng = np.random.default_rng(7)
    x = strokes(rng, 4, 30)
    normal = rng.normal(size=x.shape)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    angles = rng.uniform(-3.0, 3.0, (4, 30, 3))
    angles[1, 5:9] = angles[1, 5]
    up = -rotations.from_euler(angles)[..., 2]
    most, mean = np.empty((2, 4))
    for n in (normal, normal[:, :1].copy()):
        lying.tilts(angles[..., 0].copy(), angles[..., 1].copy(), n, most, mean)
        wanted = many_on_surface.tilts(up, np.broadcast_to(n, x.shape))
        alike(most, wanted.max(axis=1))
        alike(mean, wanted.mean(axis=1))
    foot = x - rng.normal(size=(4, 30, 1)) * normal
    height, length = np.empty((4, 30)), np.empty(4)
    lying.over_feet(x, foot, normal, height, length)
    alike(height, many_on_surface.heights(x, foot, normal))
    alike(length, many_on_surface.path_lengths(foot))
    n, point, sign = normal[0, 0], x[1, 1], np.array([1.0, -1.0, 1.0, -1.0])
    p = np.ascontiguousarray(x.transpose(2, 0, 1))
    lying.over_plane(p, point, n, sign, height, length)
    up_there = (x - point) @ n
    alike(height, sign[:, None] * up_there)
    flat = x - up_there[..., None] * n
    alike(length, many_on_surface.path_lengths(flat))
    off = rng.normal(size=(4, 30))
    rms = np.empty(4)
    lying.spreads(height, off, most, rms)
    alike(most, np.abs(height - off).max(axis=1))
    alike(rms, np.sqrt(np.mean((height - off) ** 2, axis=1)))
    axes = np.linalg.qr(rng.normal(size=(4, 3, 3)))[0]
    place = kernels.charted(p, x[:, 0].copy(), np.ascontiguousarray(axes))
    wanted = np.einsum("bni,bij->jbn", x - x[:, :1], axes)
    alike(place, wanted)

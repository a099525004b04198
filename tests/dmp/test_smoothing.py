"""Even grids, low-pass and derivatives, by closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from dmpcli.dmp.smoothing import differentiated, evenly_sampled, is_even, low_pass, moving_part
from dmpcli.spatial.trajectory import Trajectory


def test_uneven_samples_come_onto_an_even_grid_of_the_median_rate():
    rng = np.random.default_rng(1)
    t = 3.0 + np.cumsum(np.where(rng.uniform(size=400) < 0.1, 0.013, 0.01))
    assert not is_even(t)

    def path(t):
        return np.stack([np.sin(t), np.cos(2 * t), 0.1 * t**2], axis=1)

    rotation = Rotation.from_rotvec(np.outer(0.4 * t, [0.0, 0.6, 0.8]))
    found = evenly_sampled(Trajectory(t, path(t), rotation.as_matrix()))
    assert found.t[0] == 0.0
    assert found.t[-1] == pytest.approx(t[-1] - t[0])
    assert is_even(found.t)
    assert np.diff(found.t) == pytest.approx(0.01, rel=2e-3)
    assert found.position == pytest.approx(path(found.t + t[0]), abs=1e-6)
    # The last time may be later than the last sample's by rounding.
    at = np.minimum(found.t + t[0], t[-1])
    np.testing.assert_allclose(found.rotation, Slerp(t, rotation)(at).as_matrix(), atol=1e-9)
    assert evenly_sampled(Trajectory(t, path(t))).rotation is None


def test_even_samples_are_left_but_for_the_rounding_of_their_times():
    t = 7.0 + np.round(np.arange(200) / 130.0, 7)
    stroke = Trajectory(t, np.random.default_rng(2).normal(size=(200, 3)))
    assert is_even(t)
    found = evenly_sampled(stroke)
    assert found.t == pytest.approx(np.arange(200) / 130.0, abs=1e-6)
    assert np.ptp(np.diff(found.t)) < 1e-12
    assert found.position is stroke.position
    shifted = t.copy()
    shifted[100] += 2e-4 / 130.0
    assert not is_even(shifted)
    shifted[100] = t[100] + 0.5e-4 / 130.0
    assert is_even(shifted)


@pytest.mark.parametrize("frequency", [1.0, 5.0, 8.0])
def test_the_low_pass_has_a_butterworths_gain_twice_and_no_phase(frequency):
    rate, cutoff = 100.0, 5.0
    t = np.arange(4000) / rate
    x = np.stack([np.sin(2 * np.pi * frequency * t), np.cos(2 * np.pi * frequency * t)], axis=1)
    warped = np.tan(np.pi * frequency / rate) / np.tan(np.pi * cutoff / rate)
    inner = slice(500, -500)
    expected = x[inner] / (1.0 + warped**8)
    assert low_pass(x, rate, cutoff)[inner] == pytest.approx(expected, abs=1e-6)


def test_no_cutoff_and_one_beyond_the_rate_leave_samples_as_they_are():
    x = np.random.default_rng(3).normal(size=(50, 2))
    assert low_pass(x, 100.0, None) is x
    assert low_pass(x, 100.0, 50.0) is x
    assert not np.array_equal(low_pass(x, 100.0, 49.0), x)
    # Too short for the filter to settle: the ends hold what there is.
    assert low_pass(np.ones((6, 1)), 100.0, 0.5) == pytest.approx(np.ones((6, 1)))


def test_derivatives_of_polynomials_of_fifth_degree_are_exact():
    t = np.linspace(0.0, 2.0, 41)
    p = [np.polynomial.Polynomial(c) for c in ([1, -2, 3, 0.5, -0.2, 0.1], [0, 1, 0, -1, 0, 0.3])]
    found = differentiated(t, np.stack([f(t) for f in p], axis=1))
    for i, f in enumerate(p):
        assert found.x[:, i] == pytest.approx(f(t))
        assert found.velocity[:, i] == pytest.approx(f.deriv()(t), abs=1e-8)
        assert found.acceleration[:, i] == pytest.approx(f.deriv(2)(t), abs=1e-6)


def test_idle_ends_are_outside_the_moving_part_but_for_a_margin():
    t = np.arange(1000) / 100.0
    x = np.interp(t, [0.0, 2.0, 8.0, 9.99], [0.0, 0.0, 60.0, 60.0])
    part = moving_part(t, np.stack([x, 0 * x, 0 * x], axis=1))
    # Moving from sample 200 to 800, whose neighbours' differences move too; 5 % of it beside.
    assert part.start == pytest.approx(200 - 30, abs=2)
    assert part.stop == pytest.approx(800 + 30, abs=3)
    assert moving_part(t, np.zeros((1000, 3))) == slice(0, 1000)
    assert moving_part(t, np.stack([5 * t, 0 * t, 0 * t], axis=1)) == slice(0, 1000)


def test_forces_come_along_to_an_even_grid():
    t = np.linspace(0.0, 2.0, 81)
    t[1:-1] += 1e-3 * np.sin(np.arange(79.0))
    force = np.column_stack([3.0 * t, 1.0 - t, 0.0 * t])
    stroke = Trajectory(t, np.column_stack([50.0 * t, 0 * t, 0 * t]), contact_force=force)
    found = evenly_sampled(stroke)
    assert found.t == pytest.approx(np.linspace(0.0, 2.0, 81))
    expected = np.column_stack([3.0 * found.t, 1.0 - found.t, 0.0 * found.t])
    assert found.contact_force == pytest.approx(expected, abs=1e-12)

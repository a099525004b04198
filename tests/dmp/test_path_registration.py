"""Correspondences of paths: the identity, and pairs that are held together."""

import numpy as np
import pytest

from dmpcli.dmp import path_registration
from dmpcli.dmp.path_registration import PLACES, Correspondence

PLACE = np.linspace(0.0, 1.0, 41)


def test_without_pins_each_place_is_its_own():
    same = Correspondence()
    np.testing.assert_array_equal(same(PLACE), PLACE)
    np.testing.assert_array_equal(same.slope(PLACE), 1.0)
    splined = Correspondence(path_registration._averages())
    np.testing.assert_allclose(splined(PLACE), PLACE, atol=1e-12)
    np.testing.assert_allclose(splined.slope(PLACE), 1.0, atol=1e-9)


def test_pins_are_met_and_the_slope_is_the_derivative():
    held = Correspondence().pinned({0.25: 0.5, 0.75: 0.8})
    assert held(np.array([0.0, 0.25, 0.75, 1.0])) == pytest.approx([0.0, 0.5, 0.8, 1.0])
    h = 1e-6
    inner = PLACE[1:-1] + 0.001
    by_differences = (held(inner + h) - held(inner - h)) / (2.0 * h)
    np.testing.assert_allclose(held.slope(inner), by_differences, rtol=1e-5, atol=1e-8)


def test_a_path_at_the_identity_s_places_is_the_path():
    u = np.linspace(0.0, 1.0, PLACES)
    path = np.column_stack([300.0 * u, 50.0 * np.sin(6.0 * u), u**2])
    found = path_registration._at(path, path_registration._averages())
    np.testing.assert_allclose(found, path, atol=1e-9)

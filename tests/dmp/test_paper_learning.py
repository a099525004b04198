"""The factor of a forced response, as the paper's method learns it."""

from types import SimpleNamespace

import numpy as np
import pytest

from dmpcli.dmp import paper_learning
from dmpcli.dmp.skill import Response


@pytest.mark.parametrize(("size", "factors"), [(90.0, [1, 1]), (110.0, [3, 1]), (260.0, [3, 3])])
def test_a_forced_response_is_negligible_by_the_extent_of_its_own_kind(size, factors):
    """Positions go 60 and 80 mm along two axes, so 100 mm; angles by 250 of their unit."""
    u = np.linspace(0.0, 1.0, 11)[:, None]
    signal = SimpleNamespace(x=u * [60.0, 80.0, 0.0, 250.0, 0.0, 0.0])
    none = np.zeros((11, 6))
    forced = np.full((11, 6), 1e-9 * size)
    # What is left of the demonstration is three times the forced response.
    homogeneous = signal.x - 3.0 * forced
    at_goal = np.divide(homogeneous, signal.x[-1], out=none.copy(), where=signal.x[-1] != 0.0)
    still = signal.x[-1] == 0.0
    skill = SimpleNamespace(initial_velocity=np.ones(6))
    c = np.where(still, -3.0 * forced, 0.0)
    found = paper_learning._alpha_f(skill, [Response(none, at_goal, c, forced)], [signal])
    np.testing.assert_allclose(found, np.repeat(factors, 3), rtol=1e-5)

"""Which derivatives vanish at an end of a smoothing spline."""

import numpy as np
import pytest

from dmpcli.dmp import least_squares, spline_ends

U = np.linspace(0.0, 1.0, 401)
DESIGN = least_squares.uniform(401, 20)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize(
    ("powers", "conditions"),
    [((3,), 3), ((3, 4), 3), ((4,), 3), ((3, 5), 2), ((5,), 2)],
)
def test_at_rest_velocity_and_acceleration_vanish_and_the_fifth_where_it_may(
    powers, conditions, reverse
):
    """Polynomials of degree 5 are in the space: what vanishes there is known."""
    u = 1.0 - U if reverse else U
    x = 100.0 * sum(u**power for power in powers)[:, None] * [[1.0, -2.0, 0.5]]
    found = spline_ends.end(DESIGN, DESIGN.coefficients(x), 1e-12, reverse)
    assert found.rests
    assert found.conditions == conditions
    np.testing.assert_allclose(found.change, 0.0, atol=1e-6)

"""Orthonormal polynomials on even samples, against matrices and numpy's polynomials."""

import numpy as np
import pytest

from dmpcli.dmp import gram_polynomials


@pytest.mark.parametrize(("count", "degree"), [(3, 1), (3, 2), (9, 7), (94, 7), (2000, 5)])
def test_they_are_orthonormal_and_span_the_polynomials(count, degree):
    Q = gram_polynomials.at_samples(count, degree)
    assert Q.shape == (count, degree + 1)
    np.testing.assert_allclose(Q.T @ Q, np.eye(degree + 1), atol=1e-12)
    powers, _ = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, count), degree + 1, increasing=True))
    np.testing.assert_allclose(np.abs(np.sum(Q * powers, axis=0)), 1.0, rtol=1e-10)


@pytest.mark.parametrize("place", [-2.3, 0.0, 17.0, 40.6])
def test_a_polynomial_and_its_derivatives_are_found_anywhere(place):
    true = np.polynomial.Polynomial([3.0, -0.2, 0.04, -5e-4])
    y = true(np.arange(40.0))
    shares = gram_polynomials.at_samples(40, 3).T @ y
    found = gram_polynomials.at(40, 3, place, 4) @ shares
    wanted = [true(place), *(true.deriv(order)(place) for order in (1, 2, 3))]
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)


def test_few_samples_are_kept_and_cannot_be_written():
    Q = gram_polynomials.at_samples(50, 3)
    assert gram_polynomials.at_samples(50, 3) is Q or np.shares_memory(
        gram_polynomials.at_samples(50, 3), Q
    )
    with pytest.raises(ValueError, match="read-only"):
        Q[0, 0] = 1.0

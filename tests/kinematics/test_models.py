import numpy as np
import pytest

from dmpcli.errors import InputError
from dmpcli.kinematics import chain, inverse, models


def test_the_ec66_has_the_makers_limits_and_speeds():
    arm = models.model("ec66")
    assert np.degrees(arm.limits[2]) == pytest.approx([-160, 160])
    assert np.degrees(arm.limits[[0, 1, 3, 4, 5], 1]) == pytest.approx([360] * 5)
    # The URDF's velocities, rad/s.
    assert arm.speeds[[0, 2, 3]] == pytest.approx([2.61993, 3.31613, 4.53786], rel=1e-3)


def test_an_unknown_model_is_refused_with_the_names_that_there_are():
    with pytest.raises(InputError, match=r"'ec99': not known; there is ec66"):
        models.model("ec99")


def test_the_ur5e_stands_where_its_maker_says():
    """At zero the arm lies along -x: a2 + a3 out, d4 + d6 aside, d1 - d5 up."""
    arm = models.model("ur5e")
    at = chain.forward(arm, np.zeros(6))
    position, rotation = at.position, at.rotation
    np.testing.assert_allclose(position, [-817.2, -232.9, 62.8], atol=1e-9)
    np.testing.assert_allclose(rotation @ [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], atol=1e-12)


def test_the_ur5e_is_of_the_family_that_the_inverse_knows():
    arm = models.model("ur5e")
    for q in np.random.default_rng(1).uniform(-3.0, 3.0, (20, 6)):
        found = inverse.nearest(arm, chain.forward(arm, q), q)
        np.testing.assert_allclose(found, q, atol=1e-6)

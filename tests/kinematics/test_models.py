import numpy as np
import pytest

from dmpcli.errors import InputError
from dmpcli.kinematics import models


def test_the_ec66_has_the_makers_limits_and_speeds():
    arm = models.model("ec66")
    assert np.degrees(arm.limits[2]) == pytest.approx([-160, 160])
    assert np.degrees(arm.limits[[0, 1, 3, 4, 5], 1]) == pytest.approx([360] * 5)
    # The URDF's velocities, rad/s.
    assert arm.speeds[[0, 2, 3]] == pytest.approx([2.61993, 3.31613, 4.53786], rel=1e-3)


def test_an_unknown_model_is_refused_with_the_names_that_there_are():
    with pytest.raises(InputError, match=r"'ec99': not known; there is ec66"):
        models.model("ec99")

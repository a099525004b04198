import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.admittance.payload_identification import check_orientations, condition
from dmpcli.calibration.orientations import around
from dmpcli.dmp.options import CONDITION

HOME = Rotation.from_euler("xyz", [170, 5, -30], degrees=True).as_matrix()


@pytest.mark.parametrize("count", range(4, 31))
def test_any_number_of_poses_is_well_conditioned_at_45_degrees(count):
    R = around(HOME, count, np.pi / 4)
    assert R.shape == (count, 3, 3)
    assert condition(R) == pytest.approx(1.0 + np.sqrt(2.0))


@pytest.mark.parametrize(("degrees", "number"), [(60, 1.81), (45, 2.41), (30, 3.73), (20, 5.67)])
def test_the_condition_number_goes_with_the_tilt(degrees, number):
    assert condition(around(HOME, 12, np.radians(degrees))) == pytest.approx(number, rel=0.02)


def test_twelve_poses_within_ten_degrees_are_refused_as_they_should_be():
    with pytest.raises(Exception, match=f"over {CONDITION:g}"):
        check_orientations(around(HOME, 12, np.radians(10.0)))


def test_the_tools_axis_is_tilted_by_just_the_angle_asked_for():
    R = around(HOME, 12, 0.6)
    cosine = R[:, :, 2] @ HOME[:, 2]
    np.testing.assert_allclose(np.arccos(cosine), 0.6, atol=1e-12)


def test_the_way_from_one_pose_to_the_next_is_short_but_once_between_the_rounds():
    R = np.concatenate([HOME[None], around(HOME, 12, np.pi / 4), HOME[None]])
    turns = Rotation.from_matrix(R[1:]) * Rotation.from_matrix(R[:-1]).inv()
    angles = np.sort(np.degrees(turns.magnitude()))
    assert angles[-2] < 66
    assert angles[-1] < 125

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.calibration import result
from dmpcli.calibration.orientations import around
from dmpcli.errors import RefusedError
from dmpcli.records.static_poses import StaticPose
from dmpcli.simulation.mock import PEN, PEN_DOWN
from dmpcli.spatial import wrench

GEOMETRY = replace(PEN, weight=0.0, centre=np.zeros(3), zero=None)


def poses(tool=PEN, count=12, tilt=np.pi / 4):
    load = wrench.gravity(tool.weight, tool.inclination)
    made = []
    for i, R in enumerate(around(PEN_DOWN, count, tilt)):
        reading = wrench.of_weight(R @ tool.sensor_in_tcp, load, tool.centre) + tool.zero
        made.append(
            StaticPose(5.0 * i, np.zeros(3), R, 0.0, 0.0, reading, np.full(6, 0.02), 100, 0.0)
        )
    return made


def identified(taken, geometry=GEOMETRY):
    return result.identified(taken, geometry, condition=10.0, max_residual=0.3)


def test_the_tool_comes_back():
    found, remarks = identified(poses())
    tool = result.with_payload(GEOMETRY, found)
    assert remarks == []
    assert tool.weight == pytest.approx(PEN.weight)
    np.testing.assert_allclose(tool.centre, PEN.centre, atol=1e-9)
    np.testing.assert_allclose(tool.zero, PEN.zero, atol=1e-9)
    np.testing.assert_array_equal(tool.tcp_position, PEN.tcp_position)
    assert "12 of 12 poses used, condition numbers" in result.verdict(found)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ({"moved": 0.3}, "pose 4 is left out: the tool moved by 0.3 mm"),
        ({"turned": 0.01}, "pose 4 is left out: the tool moved by 0 mm, 0.01 rad"),
        ({"unsteady": 0.5}, "pose 4 is left out: the force changed by 0.5 N"),
        ({"unsteady": np.nan}, "pose 4 is left out: the force changed by nan N"),
    ],
)
def test_a_pose_that_did_not_rest_is_left_out_by_its_number(fault, words):
    taken = poses()
    taken[3] = replace(taken[3], **fault)
    found, remarks = identified(taken)
    assert remarks[0].startswith(words)
    assert np.flatnonzero(~found.used).tolist() == [3]
    assert found.payload.weight == pytest.approx(PEN.weight)
    assert result.verdict(found).startswith("11 of 12")


def test_a_pose_that_was_touched_is_left_out_by_what_contradicts():
    taken = poses()
    taken[7] = replace(taken[7], wrench=taken[7].wrench + np.array([0, 0, 2.0, 0, 0, 0]))
    found, remarks = identified(taken)
    assert len(remarks) == 1
    assert remarks[0].startswith("pose 8 is left out: it contradicts the others by 2 N")
    assert found.payload.weight == pytest.approx(PEN.weight)


def test_a_sensor_turned_otherwise_than_the_file_says_is_refused_with_the_reason():
    turned = Rotation.from_euler("z", 30, degrees=True).as_matrix()
    with pytest.raises(
        RefusedError, match=r"do not fit one tool: residual 2[^;]*; is the sensor turn"
    ):
        identified(poses(replace(PEN, sensor_rotation=turned, inclination=np.array([0.3, 0.2]))))


def test_nothing_but_moving_poses_is_refused():
    with pytest.raises(RefusedError, match="pose 1 is left out"):
        identified([replace(pose, moved=5.0) for pose in poses()])
    with pytest.raises(RefusedError, match="no pose was taken"):
        identified([])


def test_the_table_has_a_row_for_everything():
    found, _ = identified(poses())
    names = [row[0] for row in result.table(found)]
    assert names == [
        "weight",
        "centre of mass",
        "zero, force",
        "zero, torque",
        "inclination U V",
        "residual, force",
        "residual, torque",
        "drift, force",
    ]
    assert result.table(found)[1][1:] == ("1.00  -2.00  45.00", "0.00  0.00  0.00", "mm")

"""Tables that leave come back as they were, and other programs' words are kept."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError, RefusedError
from dmpcli.formats import csv_table, joint_table, tum
from dmpcli.formats.motion import Motion, MotionStroke
from dmpcli.kinematics import chain, models
from dmpcli.records import layouts, recordings
from dmpcli.records.file_io import Source
from tests.formats.motions import angle_between, motion, wave


def back(content, layout=None):
    return recordings.read(Source("back.csv", content), layout).stroke


@pytest.mark.parametrize(
    ("encode", "layout"), [(csv_table.encode, None), (tum.encode, layouts.LAYOUTS["tum"])]
)
def test_a_table_comes_back_to_the_last_digits(encode, layout):
    one = wave()
    read = back(encode(motion(one)), layout)
    np.testing.assert_allclose(read.t, one.t, atol=1e-12)
    np.testing.assert_allclose(read.position, one.position, atol=1e-9)
    assert angle_between(read.rotation, one.rotation).max() < 1e-9


def test_tum_is_metres_and_scipys_scalar_last_quaternion():
    one = wave()
    values = np.loadtxt(tum.encode(motion(one)).decode().splitlines())
    np.testing.assert_allclose(values[:, 1:4], one.position / 1000, atol=1e-15)
    R = Rotation.from_quat(values[:, 4:]).as_matrix()
    np.testing.assert_allclose(R, one.rotation, atol=1e-12)


def test_csv_names_its_units_and_its_angles_are_intrinsic_xyz():
    one = wave()
    head, *rows = csv_table.encode(motion(one)).decode().splitlines()
    assert head == "t [s],x [mm],y [mm],z [mm],rx [rad],ry [rad],rz [rad]"
    angles = np.array([row.split(",")[4:] for row in rows], dtype=float)
    np.testing.assert_allclose(
        Rotation.from_euler("XYZ", angles).as_matrix(), one.rotation, atol=1e-12
    )


def test_csv_holds_the_wrench_and_the_name_of_each_stroke():
    first = wave(samples=20, name="a, b")
    second = MotionStroke(first.t, first.position, wrench=np.full((20, 6), 2.5), id="c")
    head, *rows = csv_table.encode(motion(first, second)).decode().splitlines()
    assert head.startswith("id,t [s],x [mm]")
    assert head.endswith("fx [N],fy [N],fz [N],tx [N·m],ty [N·m],tz [N·m]")
    assert rows[0].startswith('"a, b",0,')
    assert rows[0].endswith(",,,,,,")
    assert rows[-1].endswith("2.5,2.5,2.5,2.5,2.5,2.5")
    assert ",,,," in rows[-1]  # no orientation


def test_tum_refuses_what_it_cannot_hold():
    bare = MotionStroke(np.arange(3.0), np.zeros((3, 3)))
    with pytest.raises(InputError, match="--orientation"):
        tum.encode(motion(bare))
    with pytest.raises(InputError, match=r"\{id\}"):
        tum.encode(motion(wave(), wave(name="2")))


def arm_stroke():
    """A stroke that the EC66 reaches, and the joints that it was made from."""
    arm = models.model("ec66")
    s = np.linspace(0.0, 1.0, 101)[:, None]
    q = np.array([0.1, 2.2, 1.5, -2.1, -1.5, 1.4]) + 0.2 * s * np.array([1, -1, 0.5, 1, 0.3, -1])
    at = chain.forward(arm, q)
    position, R = at.position, at.rotation
    return arm, q, Motion("arm", "trajectory", [MotionStroke(4.0 * s[:, 0], position, R)])


def test_joints_lead_the_arm_along_the_stroke():
    arm, q, given = arm_stroke()
    found = joint_table.with_joints(given, arm, None, q[0])
    np.testing.assert_allclose(found.strokes[0].joints, q, atol=1e-8)
    head, *rows = joint_table.encode(found).decode().splitlines()
    assert head == "t [s],q1 [rad],q2 [rad],q3 [rad],q4 [rad],q5 [rad],q6 [rad]"
    values = np.array([row.split(",") for row in rows], dtype=float)
    position = chain.forward(arm, values[:, 1:]).position
    np.testing.assert_allclose(position, given.strokes[0].position, atol=1e-6)


def test_joints_out_of_reach_are_refused_with_the_time():
    arm, _, given = arm_stroke()
    one = given.strokes[0]
    far = MotionStroke(one.t, one.position + [3000.0, 0, 0], one.rotation)
    with pytest.raises(RefusedError, match=r"out of reach at \d\.\d+ s"):
        joint_table.with_joints(motion(far), arm, None)

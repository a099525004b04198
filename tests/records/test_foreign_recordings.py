"""One stroke as other programs write it: each file is read to the same stroke, or refused."""

import re
import shlex

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError
from dmpcli.records import layouts
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import LAYOUTS, Layout, adapted, suited
from dmpcli.records.recordings import read
from tests.records.foreign import EPOCH, NS, QUATERNION, XYZ, R, T, motive, table

METRES = XYZ / 1000
POSES = (*METRES.T, *QUATERNION.T)
WXYZ = QUATERNION[:, [3, 0, 1, 2]]


def taken(text, layout=None, mapping=(), **given):
    base = LAYOUTS[layout] if layout else Layout()
    return read(Source("log.csv", text.encode()), adapted(base, mapping, given))


def assert_is_the_stroke(found, rotation=True, start=0.0):
    np.testing.assert_allclose(found.stroke.t, start + T, atol=1e-9)
    np.testing.assert_allclose(found.stroke.position, XYZ, atol=1e-5)
    if rotation:
        np.testing.assert_allclose(found.stroke.rotation, R.as_matrix(), atol=1e-6)
    else:
        assert found.stroke.rotation is None
    assert found.doubts == ()


ROS2 = (
    "header.stamp.sec,header.stamp.nanosec,header.frame_id,"
    "pose.position.x,pose.position.y,pose.position.z,"
    "pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w"
)
ROS1 = (
    "%time,field.header.seq,field.header.stamp,"
    "field.pose.position.x,field.pose.position.y,field.pose.position.z,"
    "field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,"
    "field.pose.orientation.w"
)
BAGPY = (
    "Time,header.seq,header.stamp.secs,header.stamp.nsecs,header.frame_id,"
    "pose.position.x,pose.position.y,pose.position.z,"
    "pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w"
)
PLOTJUGGLER = "__time," + ",".join(
    f"/tool/pose/{part}"
    for part in (*(f"position/{a}" for a in "xyz"), *(f"orientation/{a}" for a in "xyzw"))
)
EUROC = (
    "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
)
FRANKA = "time," + ",".join(f"O_T_EE[{i}]" for i in range(16))
BASE = np.array(["base"] * T.size)
SEQ = np.arange(T.size)
SECONDS = [f"{ns // 10**9}.{ns % 10**9:09d}" for ns in NS]
MATRIX = np.concatenate(
    [
        np.concatenate([R.as_matrix(), np.zeros((T.size, 1, 3))], axis=1),
        np.concatenate([METRES, np.ones((T.size, 1))], axis=1)[:, :, None],
    ],
    axis=2,
)
COLUMN_MAJOR = np.swapaxes(MATRIX, 1, 2).reshape(-1, 16)
RSI = "time,RIst.X,RIst.Y,RIst.Z,RIst.A,RIst.B,RIst.C"
KUKA_ABC = R.as_euler("ZYX", degrees=True)
FANUC_WPR = R.as_euler("xyz", degrees=True)

FILES = {
    "tum": ("tum", table("", SECONDS, *POSES, sep=" ")),
    "tum, commented head": (
        "tum",
        table("# timestamp tx ty tz qx qy qz qw", SECONDS, *POSES, sep=" "),
    ),
    "tum, a remark above": (
        "tum",
        table("# ground truth\n# made by hand", SECONDS, *POSES, sep=" "),
    ),
    "tum, bare head": ("tum", table("timestamp tx ty tz qx qy qz qw", SECONDS, *POSES, sep=" ")),
    "tum, numbered": ("tum", table("num t x y z qx qy qz qw", SEQ, SECONDS, *POSES, sep=" ")),
    "ros 2": ("ros", table(ROS2, NS // 10**9, NS % 10**9, BASE, *POSES)),
    "ros 1": ("ros", table(ROS1, NS, SEQ, NS, *POSES)),
    "bagpy": ("ros", table(BAGPY, SECONDS, SEQ, NS // 10**9, NS % 10**9, BASE, *POSES)),
    "plotjuggler": ("ros", table(PLOTJUGGLER, SECONDS, *POSES)),
    "euroc": ("euroc", table(EUROC, NS, *METRES.T, *WXYZ.T)),
    "euroc, more columns": ("euroc", table("", NS, *METRES.T, *WXYZ.T, *METRES.T)),
    "ur": (
        "ur",
        table(
            "timestamp " + " ".join(f"actual_TCP_pose_{i}" for i in range(6)),
            T,
            *METRES.T,
            *R.as_rotvec().T,
            sep=" ",
        ),
    ),
    "franka": ("franka", table(FRANKA, T, *COLUMN_MAJOR.T)),
    "kuka": ("kuka", table("t,X,Y,Z,A,B,C", T, *XYZ.T, *KUKA_ABC.T)),
    "kuka rsi": (
        "kuka",
        table(RSI, T, *XYZ.T, *KUKA_ABC.T),
    ),
    "fanuc": ("fanuc", table("t,X,Y,Z,W,P,R", T, *XYZ.T, *FANUC_WPR.T)),
    "motive": ("motive", motive()),
    "motive, byte order mark": ("motive", "\ufeff" + motive(version="1.25")),
}


@pytest.mark.parametrize("name", FILES)
def test_each_known_recorder_is_read_by_one_word(name):
    layout, text = FILES[name]
    assert_is_the_stroke(taken(text, layout))


@pytest.mark.parametrize("name", [n for n in FILES if not n.startswith(("tum", "euroc", "motive"))])
def test_without_the_word_the_one_that_fits_is_recognised_and_said(name):
    layout, text = FILES[name]
    assert suited(text.splitlines()[0].split(" " if layout == "ur" else ",")) == [layout]
    found = read(Source("log.csv", text.encode()))
    assert_is_the_stroke(found)
    assert found.told[0].startswith(f"recognised as --layout {layout}; ")


def test_where_two_layouts_could_be_none_is_taken(monkeypatch):
    _, text = FILES["kuka"]
    twin = layouts.LAYOUTS | {"other": layouts.LAYOUTS["kuka"]}
    monkeypatch.setattr(layouts, "LAYOUTS", twin)
    with pytest.raises(InputError, match=r"column 'x' is missing.* --layout kuka or other reads"):
        taken(text)


def test_an_option_of_a_recognised_table_counts():
    _, text = FILES["ur"]
    found = read(Source("log.csv", text.encode()), adapted(Layout(), (), {"length": "mm"}))
    assert found.told[0].startswith("recognised as --layout ur")
    assert np.ptp(found.stroke.position) < np.ptp(taken(text, "ur").stroke.position) / 100


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("tum", "line 1 holds 8 numbers, not names of columns; .*--layout tum"),
        ("tum, commented head", "names of the columns are commented out; --layout tum reads them"),
        ("euroc", "names of the columns are commented out; --layout euroc reads them"),
        ("motive", "is an export of Motive; --layout motive reads it"),
    ],
)
def test_a_table_without_names_of_its_own_is_refused_with_what_reads_it(name, message):
    with pytest.raises(InputError, match=message):
        taken(FILES[name][1])


@pytest.mark.parametrize("step", [1e-3, 1e-4])
@pytest.mark.parametrize("layout", ["tum", "ros", "euroc"])
def test_stamps_since_an_epoch_keep_their_nanoseconds(step, layout):
    ns = EPOCH * 10**9 + 123_456_789 + np.arange(T.size) * round(step * 1e9)
    stamps = [f"{n // 10**9}.{n % 10**9:09d}" for n in ns]
    text = {
        "tum": table("", stamps, *POSES, sep=" "),
        "ros": table(ROS2, ns // 10**9, ns % 10**9, BASE, *POSES),
        "euroc": table(EUROC, ns, *METRES.T, *WXYZ.T),
    }[layout]
    t = taken(text, layout).stroke.t
    # A double of 1.7e9 s is 2.4e-7 s from the next one.
    np.testing.assert_allclose(np.diff(t), step, rtol=0, atol=1e-12 if layout != "ros" else 2e-10)


def test_metres_and_milliseconds_read_as_mm_and_s_are_refused_or_doubted_by_option():
    with pytest.raises(InputError, match=r"0\.12 mm large .*--length-unit m;.*--length-unit mm"):
        taken(table("t,x,y,z", T, *METRES.T))
    assert_is_the_stroke(taken(table("t,x,y,z", T, *METRES.T), length="m"), rotation=False)
    (doubt,) = taken(table("t,x,y,z", 1000 * T, *XYZ.T)).doubts
    assert "moves at 0.025 mm/s" in doubt
    assert "lasts 8000 s" in doubt
    assert doubt.endswith("--time-unit ms")
    assert_is_the_stroke(taken(table("t,x,y,z", 1000 * T, *XYZ.T), time="ms"), rotation=False)


def test_a_tiny_stroke_is_read_where_its_unit_was_said():
    text = table("t,x,y,z", T, *METRES.T)
    assert taken(text, length="mm").stroke.position[0, 0] == pytest.approx(-0.55)
    said = taken(table("t,x [mm],y [mm],z [mm]", T, *METRES.T))
    assert said.stroke.position[0, 0] == pytest.approx(-0.55)
    assert len(said.doubts) == 1


def test_euler_angles_of_ros_and_kuka_are_read_by_word_and_assumed_aloud_without():
    text = table("t,x,y,z,rx,ry,rz", T, *XYZ.T, *R.as_euler("xyz").T)
    found = taken(text, rotation="rpy")
    assert_is_the_stroke(found)
    assert "x-y-z extrinsic (fixed-axis) Euler angles; the tool leans 0.0°" in found.told[0]
    assumed = taken(text)
    assert "X-Y-Z intrinsic Euler angles (assumed; --rotation says otherwise)" in assumed.told[0]
    assert "leans 0.0° from straight down at the start" in assumed.told[0]


def test_two_axis_euler_angles_are_the_first_second_and_third_turn():
    # The controller of a Doosan arm: intrinsic Z-Y-Z, degrees.
    leaning = Rotation.from_euler("x", 30, degrees=True) * R
    text = table("t,x,y,z,rx,ry,rz", T, *XYZ.T, *leaning.as_euler("ZYZ", degrees=True).T)
    found = taken(text, rotation="ZYZ", angle="deg")
    np.testing.assert_allclose(found.stroke.rotation, leaning.as_matrix(), atol=1e-6)
    with pytest.raises(InputError, match=r"check the unit of angle \(--angle-unit deg\)"):
        taken(text, rotation="ZYZ")


def test_nanoseconds_and_a_quaternion_scalar_first_are_read_without_header():
    text = table("", NS, *XYZ.T, *WXYZ.T)
    names = ("t", "x", "y", "z", "qw", "qx", "qy", "qz")
    assert_is_the_stroke(taken(text, header=names, time="ns"))
    with pytest.raises(InputError, match="check the unit of time"):
        taken(text, header=names)


def test_a_pendants_rotation_vectors_in_degrees_are_read():
    text = table("t,x,y,z,rx,ry,rz", T, *XYZ.T, *np.degrees(R.as_rotvec()).T)
    assert_is_the_stroke(taken(text, rotation="rotvec", angle="deg"))


def test_rotation_vectors_unsaid_are_doubted_where_euler_angles_would_leap():
    text = table("t,x,y,z,rx,ry,rz", T, *XYZ.T, *R.as_rotvec().T)
    found = taken(text)
    assert "(assumed" in found.told[0]
    assert any("--rotation rotvec" in doubt for doubt in found.doubts)
    assert_is_the_stroke(taken(text, rotation="rotvec"))


def test_unit_quaternions_by_their_names_are_read_and_others_named():
    text = table("t,x,y,z,qx,qy,qz,qw", T, *XYZ.T, *QUATERNION.T)
    found = taken(text)
    assert_is_the_stroke(found)
    assert "read as unit quaternions (assumed" in found.told[0]
    other = taken(table("t,x,y,z,qx,qy,qz,qw", T, *XYZ.T, *(2 * QUATERNION).T))
    assert other.stroke.rotation is None
    assert other.doubts == (
        "columns qx, qy, qz, qw are there but were not read; --rotation quaternion reads them",
    )


@pytest.mark.parametrize(("order", "names"), [("wxyz", "q1,q2,q3,q4"), ("xyzw", "q0,q1,q2,q3")])
def test_numbered_quaternions_need_their_order(order, names):
    values = WXYZ if order == "wxyz" else QUATERNION
    text = table(f"t,x,y,z,{names}", T, *XYZ.T, *values.T)
    assert_is_the_stroke(taken(text, rotation=order))
    with pytest.raises(InputError, match=r"--rotation wxyz .*or --rotation xyzw"):
        taken(text, rotation="quaternion")
    (doubt,) = taken(text).doubts
    assert doubt.startswith(f"columns {names.replace(',', ', ')} are there but were not read")


@pytest.mark.parametrize(
    ("names", "option"),
    [
        ("roll,pitch,yaw", "--rotation rpy --map rx=roll"),
        ("tool_rx,tool_ry,tool_rz", "--rotation with --map rx="),
        ("A,B,C", "KUKA"),
        ("actual_TCP_pose_3,actual_TCP_pose_4,actual_TCP_pose_5", "--layout ur"),
    ],
)
def test_columns_that_look_like_a_rotation_but_were_not_read_are_named(names, option):
    found = taken(table(f"t,x,y,z,{names}", T, *XYZ.T, *R.as_euler("xyz").T))
    assert found.stroke.rotation is None
    (doubt,) = found.doubts
    assert f"columns {names.replace(',', ', ')} are there but were not read" in doubt
    assert option in doubt


@pytest.mark.parametrize(
    ("names", "form"),
    [
        ("Qx,Qy,Qz,Qw", "quaternion"),
        ("QX,QY,QZ,QW", "quaternion"),
        ("quat_w,quat_x,quat_y,quat_z", "wxyz"),
        ("ox,oy,oz,ow", "quaternion"),
        ("orientation_x,orientation_y,orientation_z,orientation_w", "quaternion"),
        ("Rotation X,Rotation Y,Rotation Z,Rotation W", "quaternion"),
        ("quaternion_0,quaternion_1,quaternion_2,quaternion_3", "numbered"),
        ("Rx,Ry,Rz", "rotvec"),
        ("rot_x,rot_y,rot_z", "rotvec"),
        ("Rotation X,Rotation Y,Rotation Z", "rotvec"),
        ("theta_x_rad,theta_y_rad,theta_z_rad", "rpy"),
        ("Roll,Pitch,Yaw", "rpy"),
        ("tool_roll_rad,tool_pitch_rad,tool_yaw_rad", "rpy"),
    ],
)
def test_rotations_of_other_names_are_named_with_what_reads_them(names, form):
    values = {
        "quaternion": QUATERNION,
        "numbered": QUATERNION,
        "wxyz": WXYZ,
        "rotvec": R.as_rotvec(),
        "rpy": R.as_euler("xyz"),
    }[form]
    text = table(f"t,x,y,z,{names}", T, *XYZ.T, *values.T)
    found = taken(text)
    assert found.stroke.rotation is None
    (doubt,) = found.doubts
    assert "are there but were not read" in doubt
    said = re.search(r"--rotation (\w+)", doubt)[1]
    words = shlex.split(doubt)
    named = [words[i + 1] for i, word in enumerate(words) if word == "--map"]
    assert_is_the_stroke(taken(text, rotation=said, mapping=named))


@pytest.mark.parametrize(
    "names", ["R00,R01,R02,R10,R11,R12,R20,R21,R22", "r11,r12,r13,r21,r22,r23,r31,r32,r33"]
)
def test_a_rotation_matrix_that_was_not_read_is_named(names):
    found = taken(table(f"t,x,y,z,{names}", T, *XYZ.T, *R.as_matrix().reshape(-1, 9).T))
    assert found.stroke.rotation is None
    assert "--rotation matrix" in found.doubts[0]


def test_a_fourth_column_that_makes_a_quaternion_of_three_angles_is_named():
    found = taken(table("t,x,y,z,rx,ry,rz,rw", T, *XYZ.T, *QUATERNION.T))
    assert any(
        "column rw was not read, and makes a quaternion of rx, ry, rz" in doubt
        for doubt in found.doubts
    )


@pytest.mark.parametrize("names", ["vx,vy,vz", "q0,q1,q2,q3,q4,q5", "fx,fy,fz", "a,b,c", "u,v,w"])
def test_what_is_no_rotation_by_its_names_is_not_doubted(names):
    columns = names.split(",")
    text = table(f"t,x,y,z,{names}", T, *XYZ.T, *([0.1 * T] * len(columns)))
    assert not any("not read" in doubt for doubt in taken(text).doubts)


def test_a_rotation_that_was_asked_for_and_is_not_there_is_refused():
    with pytest.raises(
        InputError, match="--rotation rpy: columns rx, ry, rz are missing; map them"
    ):
        taken(table("t,x,y,z,roll,pitch,yaw", T, *XYZ.T, *R.as_euler("xyz").T), rotation="rpy")


def test_one_of_several_bodies_is_chosen_by_name():
    text = motive(("Pen", "Table"))
    with pytest.raises(InputError, match=r"several have Position.X: Pen, Table; .*--body NAME"):
        taken(text, "motive")
    assert_is_the_stroke(taken(text, "motive", body="Pen"))
    other = taken(text, "motive", body="Table")
    np.testing.assert_allclose(other.stroke.position, XYZ + 1000, atol=1e-5)


@pytest.mark.parametrize("unit", ["Millimeters", "Centimeters", "Meters"])
def test_motives_unit_of_length_is_taken_from_the_take(unit):
    found = taken(motive(unit=unit), "motive", rotation="quaternion")
    scale = {"Millimeters": 1e-3, "Centimeters": 1e-2, "Meters": 1.0}[unit]
    np.testing.assert_allclose(found.stroke.position, scale * XYZ, atol=1e-5)


def test_motives_euler_angles_are_not_read_and_that_is_told():
    found = taken(motive(kind="XYZ"), "motive")
    assert found.stroke.rotation is None
    assert any("export them as Quaternion" in remark for remark in found.told)


def test_rows_without_time_are_counted_at_a_rate():
    text = table("x,y,z", *XYZ.T)
    assert_is_the_stroke(taken(text, sample_rate=25.0), rotation=False)
    with pytest.raises(InputError, match=r"column 't' is missing; .*--sample-rate HZ"):
        taken(text)


def test_a_table_without_header_is_read_by_names_in_order():
    text = table("", T, *METRES.T)
    assert_is_the_stroke(taken(text, header=("t", "x", "y", "z"), length="m"), rotation=False)
    with pytest.raises(InputError, match=r"line 1 holds 4 numbers, .*--columns t,x,y,z"):
        taken(text)
    with pytest.raises(InputError, match="has 4 columns, --columns names 5"):
        taken(text, header=("t", "x", "y", "z", "q"))
    headed = taken(table("Zeit,a,b,c", T, *XYZ.T), header=("t", "x", "y", "z"))
    assert_is_the_stroke(headed, rotation=False)
    assert headed.told == ("line 1 is not read: --columns names the columns",)


@pytest.mark.parametrize(
    ("head", "scale", "time"),
    [
        ("t [s],x [mm],y [mm],z [mm]", 1.0, 1.0),
        ("t (ms),x (m),y (m),z (m)", 1e-3, 1e3),
        ("t_us,x_cm,y_cm,z_cm", 0.1, 1e6),
        ("t [sec],x [inches],y [inches],z [inches]", 1 / 25.4, 1.0),
    ],
)
def test_units_in_the_header_are_taken_and_told(head, scale, time):
    found = taken(table(head, time * T, *(scale * XYZ).T))
    assert_is_the_stroke(found, rotation=False)
    assert [remark.split()[0] for remark in found.told] == ["time", "length"]


def test_an_option_beats_the_headers_unit_and_an_unknown_unit_is_refused():
    text = table("t [s],x [px],y [px],z [px]", T, *METRES.T)
    with pytest.raises(InputError, match=r"column 'x \[px\]': unit 'px' .*--length-unit"):
        taken(text)
    assert_is_the_stroke(taken(text, length="m"), rotation=False)


def test_a_repeated_stamp_is_refused_or_made_one_row():
    twice = T.copy()
    twice[100] = twice[99]
    columns = "t,x,y,z,qx,qy,qz,qw"
    q = QUATERNION.copy()
    q[100] *= -1
    text = table(columns, twice, *XYZ.T, *q.T)
    with pytest.raises(
        InputError, match=r"line 102: time repeats .*--repeated-stamps first or mean"
    ):
        taken(text)
    kept = np.arange(T.size) != 100
    first = taken(text, repeated="first")
    np.testing.assert_allclose(first.stroke.position, XYZ[kept], atol=1e-6)
    np.testing.assert_allclose(first.stroke.rotation, R.as_matrix()[kept], atol=1e-6)
    mean = taken(text, repeated="mean")
    np.testing.assert_allclose(mean.stroke.position[99], XYZ[99:101].mean(axis=0), atol=1e-6)
    half = Rotation.concatenate([R[99], R[100]]).mean()
    np.testing.assert_allclose(mean.stroke.rotation[99], half.as_matrix(), atol=1e-6)
    assert "1 row repeated the stamp before" in mean.told[-1]


def test_stamps_with_too_few_digits_are_told_apart_from_a_repeated_row():
    text = table("t,x,y,z", [f"{EPOCH + t:.5e}" for t in T], *XYZ.T)
    with pytest.raises(InputError, match="too few digits; --sample-rate HZ"):
        taken(text)
    counted = taken(text, sample_rate=25.0)
    assert_is_the_stroke(counted, rotation=False)
    assert "'t' is not read, since --sample-rate counts" in counted.told[0]


def test_dates_are_read_as_time():
    stamps = [f"2024-01-05 10:22:{int(s):02d}.{round(s % 1 * 1000):03d}" for s in T]
    assert_is_the_stroke(taken(table("t,x,y,z", stamps, *XYZ.T)), rotation=False)
    zoned = [stamp.replace(" ", "T") + "Z" for stamp in stamps]
    assert_is_the_stroke(taken(table("t,x,y,z", zoned, *XYZ.T)), rotation=False)


def test_the_tools_lean_at_the_start_is_said():
    tilted = Rotation.from_euler("y", 30, degrees=True) * R
    text = table("t,x,y,z,qx,qy,qz,qw", T, *XYZ.T, *tilted.as_quat().T)
    assert "the tool leans 30.0° from straight down at the start" in taken(text).told[0]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"rotation": "ZYW"}, "--rotation ZYW: must be one of euler, rpy"),
        ({"rotation": "XyZ"}, "--rotation XyZ: must be"),
        ({"sample_rate": 0.0}, "--sample-rate 0: must be"),
        ({"sample_rate": float("nan")}, "--sample-rate nan: must be"),
        ({"repeated": "last"}, "--repeated-stamps last: must be one of error, first, mean"),
        ({"decimal": ";"}, "--decimal ;: must be one of"),
    ],
)
def test_options_that_are_not_there_are_refused(given, message):
    with pytest.raises(InputError, match=message):
        adapted(Layout(), [], given)

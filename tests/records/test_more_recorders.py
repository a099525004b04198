"""Recordings as further makers' programs and public loggers write them, by where that is published.

Each is built from one closed-form stroke, and read to it, or refused with the option that reads it.
"""

import numpy as np
import pytest

from dmpcli.errors import InputError
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import LAYOUTS, Layout, adapted
from dmpcli.records.recordings import read
from tests.records.foreign import EPOCH, NS, QUATERNION, XYZ, R, T, table

METRES = XYZ / 1000
POSES = (*METRES.T, *QUATERNION.T)
COUNT = np.arange(T.size)
ROTVEC = R.as_rotvec()
MATRIX = R.as_matrix()
RATE = 25.0  # of T


def taken(text, layout=None, mapping=(), **given):
    base = LAYOUTS[layout] if layout else Layout()
    form = adapted(base, mapping, given) if layout or mapping or given else None
    return read(Source("log.csv", text.encode()), form)


def is_the_stroke(found, rotation=True, atol=1e-5):
    np.testing.assert_allclose(found.stroke.t - found.stroke.t[0], T, atol=1e-6)
    np.testing.assert_allclose(found.stroke.position, XYZ, atol=atol)
    if rotation:
        np.testing.assert_allclose(found.stroke.rotation, MATRIX, atol=2e-5)
    else:
        assert found.stroke.rotation is None


# Qualisys Track Manager, TSV of 6D data: as in shiplab/dt_cv, data/basin/raw/M510A-..._6D.tsv.


def qualisys(bodies=("Pen",), times=True, kinds="6D"):
    head = [
        f"NO_OF_FRAMES\t{T.size}",
        "NO_OF_CAMERAS\t4",
        f"NO_OF_BODIES\t{len(bodies)}",
        f"FREQUENCY\t{RATE:g}",
        "NO_OF_ANALOG\t0",
        "ANALOG_FREQUENCY\t0",
        "DESCRIPTION\t--",
        "TIME_STAMP\t2020-01-22, 17:47:17\t22107.99179716",
        f"DATA_INCLUDED\t{kinds}",
    ]
    counted = ["Frame", "Time"] if times else []
    columns = [COUNT + 1, T] if times else []
    if kinds == "6D":
        head.append("BODY_NAMES\t" + "\t".join(bodies))
        rest = ["Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{i}]" for i in range(9))]
        head.append("\t".join([*counted, *(w for b in bodies for w in (f"{b} X", *rest))]))
        for number in range(len(bodies)):
            angles = R.as_euler("xyz", degrees=True)
            by_column = np.swapaxes(MATRIX, 1, 2).reshape(-1, 9)
            columns += [*(XYZ + 500 * number).T, *angles.T, 0.3 + 0 * T, *by_column.T]
    else:
        head.append("MARKER_NAMES\t" + "\t".join(bodies))
        head.append("TRAJECTORY_TYPES\t" + "\t".join("Measured" for _ in bodies))
        for number in range(len(bodies)):
            columns += [*(XYZ + 500 * number).T]
    return table("\n".join(head), *columns, sep="\t", digits=6)


def test_qualisys_bodies_are_recognised_and_read_with_their_matrices():
    found = taken(qualisys())
    is_the_stroke(found)
    assert found.told[0].startswith("recognised as --layout qualisys")


def test_qualisys_counts_time_at_its_frequency_where_none_is_exported():
    is_the_stroke(taken(qualisys(times=False), "qualisys"))


def test_of_several_qualisys_bodies_one_is_chosen():
    with pytest.raises(InputError, match=r"several have X: Pen, Table; .*--body NAME"):
        taken(qualisys(("Pen", "Table")))
    is_the_stroke(taken(qualisys(("Pen", "Table")), "qualisys", body="Pen"))


def test_qualisys_markers_without_a_line_of_names_are_read_without_orientation():
    found = taken(qualisys(("tip",), kinds="3D"))
    is_the_stroke(found, rotation=False)


def test_a_qualisys_body_that_was_out_of_sight_is_refused_by_its_line():
    lines = qualisys().splitlines()
    lines[50] = "\t".join([*lines[50].split("\t")[:2], *["0.000000"] * 16])
    with pytest.raises(InputError, match="line 51: is no rotation matrix"):
        taken("\n".join(lines))


# Vicon, CSV of Tracker and Nexus: a kind, a rate, subjects, columns, units.


def vicon(kind="Objects", quaternion=True, sep=","):
    if kind == "Trajectories":
        subjects, axes, units = ["", "", "Pen:tip", "", ""], ["X", "Y", "Z"], ["mm"] * 3
        columns = XYZ.T
    else:
        values = (*QUATERNION.T,) if quaternion else (*ROTVEC.T,)
        axes = ["RX", "RY", "RZ", *(["RW"] if quaternion else []), "TX", "TY", "TZ"]
        units = ["" if quaternion else "rad"] * (4 if quaternion else 3) + ["mm"] * 3
        subjects = ["", "", "Global Angle:Pen", *[""] * (len(axes) - 1)]
        columns = (*values, *XYZ.T)
    head = [
        kind,
        f"{RATE:g}",
        sep.join(subjects),
        sep.join(["Frame", "Sub Frame", *axes]),
        sep.join(["", "", *units]),
    ]
    return table("\n".join(head), COUNT + 1, 0 * COUNT, *columns, sep=sep)


def test_vicons_objects_with_quaternions_are_recognised_and_read():
    found = taken(vicon())
    is_the_stroke(found)
    assert found.told[0].startswith("recognised as --layout vicon")
    assert "time counted by the frames at 25 Hz" in found.told


def test_vicons_three_angles_are_not_guessed_and_the_option_that_reads_them_is_told():
    found = taken(vicon("Segments", quaternion=False))
    is_the_stroke(found, rotation=False)
    assert any("--rotation rotvec" in remark for remark in found.told)
    is_the_stroke(taken(vicon("Segments", quaternion=False), "vicon", rotation="rotvec"))


def test_vicons_trajectories_with_semicolons_end_at_a_blank_line():
    """As a wiki of the University of Konstanz shows an export of Nexus."""
    text = vicon("Trajectories", sep=";")
    is_the_stroke(taken(text), rotation=False)
    is_the_stroke(taken(f"{text}\nModel Outputs\n100\n"), rotation=False)


def test_a_gap_of_vicons_marker_is_refused_by_its_line():
    lines = vicon("Trajectories").splitlines()
    lines[30] = "26,0,,,"
    with pytest.raises(InputError, match="line 31: an empty cell is not a finite number"):
        taken("\n".join(lines))


# OpenSim and Cortex: TRC.


def trc(unit="mm", scale=1.0, markers=("tip",)):
    words = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame"
    head = [
        "PathFileType\t4\t(X/Y/Z)\twave.trc",
        "\t".join([*words.split(), "OrigNumFrames"]),
        f"25.00\t25.00\t{T.size}\t{len(markers)}\t{unit}\t25.00\t1\t{T.size}",
        "Frame#\tTime\t" + "\t\t\t".join(markers) + "\t\t",
        "\t\t" + "\t".join(f"{a}{i + 1}" for i in range(len(markers)) for a in "XYZ"),
        "",
    ]
    columns = [c for i in range(len(markers)) for c in (scale * (XYZ + 100 * i)).T]
    return table("\n".join(head), COUNT + 1, T, *columns, sep="\t")


@pytest.mark.parametrize(("unit", "scale"), [("mm", 1.0), ("m", 1e-3)])
def test_trc_files_are_read_in_the_unit_that_they_tell(unit, scale):
    is_the_stroke(taken(trc(unit, scale)), rotation=False)


def test_of_several_markers_one_is_chosen():
    with pytest.raises(InputError, match="several have X: tip, top"):
        taken(trc(markers=("tip", "top")))
    is_the_stroke(taken(trc(markers=("tip", "top")), "trc", body="tip"), rotation=False)


# KITTI's odometry: the first three rows of the matrix, a pose a line, no time.

KITTI = np.concatenate([MATRIX, METRES[:, :, None]], axis=2).reshape(-1, 12)


def test_kittis_poses_need_a_rate_and_say_so():
    text = table("", *KITTI.T, sep=" ")
    is_the_stroke(taken(text, "kitti", sample_rate=RATE))
    with pytest.raises(InputError, match=r"12 numbers, .*--layout kitti --sample-rate HZ"):
        taken(text)
    with pytest.raises(InputError, match="--sample-rate HZ"):
        taken(text, "kitti")


def test_kittis_poses_with_a_number_before_are_read_by_names():
    """As huangying-zhan/kitti-odom-eval has them."""
    text = table("", COUNT, *KITTI.T, sep=" ")
    with pytest.raises(InputError, match=r"13 numbers, .*--columns t,r11,r12,r13,x"):
        taken(text)
    names = ("number", *LAYOUTS["kitti"].header)
    is_the_stroke(
        taken(text, header=names, length="m", rotation="matrix", sample_rate=RATE),
    )


# NDI Polaris, Vega and Aurora: the sample program of the maker's combined API.

NDI = (
    "ToolCount,ToolInfo,Frame#,PortHandle,Face#,timespec_s,timespec_ns,TransformStatus,"
    "Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,#Markers"
)


def test_ndis_trackers_are_recognised_and_read():
    words = [np.array([word] * T.size) for word in ("1", "", "OK")]
    quaternion = QUATERNION[:, [3, 0, 1, 2]]
    text = table(
        NDI,
        *(words[0], words[1], COUNT, words[0], words[0], NS // 10**9, NS % 10**9, words[2]),
        *(*quaternion.T, *XYZ.T, 0.1 + 0 * T, 0 * COUNT),
    )
    found = taken(text)
    is_the_stroke(found)
    assert found.told[0].startswith("recognised as --layout ndi")


# robosuite, robomimic and UMI: observations of an arm, as tables of one column per number.


def test_robomimics_observations_are_recognised_and_read():
    names = [f"robot0_eef_pos_{i}" for i in range(3)] + [f"robot0_eef_quat_{i}" for i in range(4)]
    found = taken(table("timestamp," + ",".join(names), T, *POSES))
    is_the_stroke(found)
    assert found.told[0].startswith("recognised as --layout robomimic")


def test_umis_observations_are_recognised_and_read():
    names = [f"robot0_eef_pos_{i}" for i in range(3)]
    names += [f"robot0_eef_rot_axis_angle_{i}" for i in range(3)]
    text = table("timestamp," + ",".join(names) + ",action_0", T, *METRES.T, *ROTVEC.T, 0 * T)
    found = taken(text)
    is_the_stroke(found)
    assert found.told[0].startswith("recognised as --layout umi")


# ROS: ros2 topic echo --csv has no names; rostopic echo -p of TF has those of its transforms.

ECHOED = (
    "header.stamp.sec,header.stamp.nanosec,header.frame_id,pose.position.x,pose.position.y,"
    "pose.position.z,pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w"
)


def test_ros2_topic_echo_is_refused_with_the_names_of_its_columns_and_read_by_them():
    frame = np.array(["base_link"] * T.size)
    text = table("", NS // 10**9, NS % 10**9, frame, *POSES)
    with pytest.raises(InputError, match=r"10 numbers.*--layout ros --columns header.stamp.sec,"):
        taken(text)
    found = taken(text, "ros", header=tuple(ECHOED.split(",")))
    is_the_stroke(found)
    assert len(found.stroke.t) == T.size  # the first row is no header


def test_transforms_of_rostopic_echo_are_read():
    parts = [f"translation.{a}" for a in "xyz"] + [f"rotation.{a}" for a in "xyzw"]
    names = [f"field.transforms0.transform.{part}" for part in parts]
    text = table("%time," + ",".join(names), NS, *POSES)
    is_the_stroke(taken(text, "ros"))


# ur-rtde's recordings are RTDE's with commas.


def test_recordings_of_ur_rtde_are_recognised_and_read():
    names = [f"actual_q_{i}" for i in range(6)] + [f"actual_TCP_pose_{i}" for i in range(6)]
    text = table("timestamp," + ",".join(names), T, *[0 * T] * 6, *METRES.T, *ROTVEC.T)
    found = taken(text)
    is_the_stroke(found)
    assert found.told[0].startswith("recognised as --layout ur")


# Tables of public data sets and loggers whose names are near to ours.


def test_scanbots_poses_are_refused_for_their_time_and_read_by_options():
    """ed1son/ScanBot, robot_tcp_poses.csv: seconds since 1970, m, rotation vectors."""
    text = table("timestamp,x,y,z,rx,ry,rz", EPOCH + T, *METRES.T, *ROTVEC.T)
    with pytest.raises(InputError, match=r"column 't' is missing.*--map t=COLUMN"):
        taken(text)
    is_the_stroke(taken(text, None, ["t=timestamp"], length="m", rotation="rotvec"))


def test_a_commented_head_near_to_ours_is_named_as_columns():
    """wengflow/deblur-e-nerf: ``# timestamp, x, y, z, rx, ry, rz``, whole microseconds or so."""
    text = table("# timestamp, x, y, z, rx, ry, rz", (1e6 * T).astype(int), *XYZ.T, *ROTVEC.T)
    with pytest.raises(InputError, match="--columns timestamp,x,y,z,rx,ry,rz reads them"):
        taken(text)
    header = ("t", "x", "y", "z", "rx", "ry", "rz")
    is_the_stroke(taken(text, header=header, time="us", rotation="rotvec"))


def test_a_pose_recorder_of_an_xarm_is_read_by_its_options():
    """timestamp, six joints, x, y, z in mm, roll, pitch, yaw in degrees."""
    angles = R.as_euler("xyz", degrees=True)
    head = "timestamp,j1,j2,j3,j4,j5,j6,x,y,z,roll,pitch,yaw"
    text = table(head, EPOCH + T, *[0 * T] * 6, *XYZ.T, *angles.T)
    with pytest.raises(InputError, match="--map t=COLUMN"):
        taken(text)
    half = taken(text, None, ["t=timestamp"])
    assert any("--rotation rpy --map rx=roll" in doubt for doubt in half.doubts)
    mapping = ["t=timestamp", "rx=roll", "ry=pitch", "rz=yaw"]
    is_the_stroke(taken(text, None, mapping, rotation="rpy", angle="deg"))


def test_a_trajectory_without_height_and_time_is_refused():
    """norlab-ulaval/norlab_icp_mapper_ros#17: x, y and an orientation."""
    names = [f"orientation{a}{i}" for a in "XYZ" for i in range(3)]
    text = table("x,y," + ",".join(names), *XYZ.T[:2], *MATRIX.reshape(-1, 9).T)
    with pytest.raises(InputError, match="column 't' is missing"):
        taken(text)


def test_text_with_more_than_one_space_and_blanks_at_the_ends_is_read():
    """MichaelGrupp/evo#175, #70 and #544: what its reader refuses."""
    rows = table("", T, *POSES, sep="  ").splitlines()
    is_the_stroke(taken("".join(f" {row} \r\n" for row in rows), "tum"))


def test_a_row_of_nan_is_refused_by_its_line():
    """MichaelGrupp/evo#175: ground truth with lines of NaN."""
    rows = table("", T, *POSES, sep=" ").splitlines()
    rows[40] = " ".join([rows[40].split()[0], *["NaN"] * 7])
    with pytest.raises(InputError, match="line 41: 'NaN' is not a finite number"):
        taken("\n".join(rows), "tum")

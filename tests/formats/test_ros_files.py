"""MCAP and ROS 2 bags: what other readers find in ours, and ours in theirs."""

import functools
import io
import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError
from dmpcli.extras import ROS
from dmpcli.formats import mcap_file, ros_bag
from dmpcli.formats.motion import MotionStroke
from tests.extras_here import needs
from tests.formats.motions import angle_between, motion, wave

pytestmark = needs(ROS)


def felt():
    one = wave(samples=60)
    return MotionStroke(
        one.t, one.position, one.rotation, wrench=np.outer(np.sin(one.t), np.arange(1.0, 7.0))
    )


def read(content, body=None):
    blocks, told = mcap_file.decode(io.BytesIO(content), "a.mcap", body)
    return blocks.whole(), told


def same(read, one):
    np.testing.assert_allclose(read.t, one.t, atol=1e-9)
    np.testing.assert_allclose(read.position, one.position, atol=1e-9)
    assert angle_between(read.rotation, one.rotation).max() < 1e-9


@pytest.mark.slow
def test_mcap_comes_back_to_1e_9_with_its_wrench():
    one = felt()
    back, told = read(mcap_file.encode(motion(one)))
    same(back, one)
    np.testing.assert_allclose(back.wrench, one.wrench, atol=1e-12)
    assert told == ["poses of '/pose' in frame 'base', m", "wrench of '/wrench'"]


@pytest.mark.slow
def test_a_bag_comes_back_to_1e_9_with_its_wrench(tmp_path):
    one = felt()
    ros_bag.write(motion(one), tmp_path / "bag")
    back = ros_bag.read(tmp_path / "bag")[0].whole()
    same(back, one)
    np.testing.assert_allclose(back.wrench, one.wrench, atol=1e-12)
    ros_bag.write(motion(wave(samples=9)), tmp_path / "bag")  # replaced
    assert len(ros_bag.read(tmp_path / "bag")[0]) == 9
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bag"]


def test_mcap_is_the_same_bytes_twice():
    assert mcap_file.encode(motion()) == mcap_file.encode(motion())


def test_the_bytes_of_a_message_are_cdr_as_its_schema_says():
    from mcap.reader import make_reader

    one = felt()
    content = mcap_file.encode(motion(one))
    rows = list(make_reader(io.BytesIO(content)).iter_messages(topics=["/pose"]))
    assert len(rows) == len(one)
    schema, channel, message = rows[7]
    assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
    assert schema.data.decode().startswith("std_msgs/Header header\ngeometry_msgs/Pose pose\n")
    # 4 bytes of encapsulation; stamp; "base" with its length and end; 3 bytes to align; doubles.
    data = bytes(message.data)
    sec, nanosec, size = struct.unpack_from("<iII", data, 4)
    assert data[16 : 16 + size] == b"base\0"
    assert sec + nanosec * 1e-9 == pytest.approx(one.t[7], abs=1e-9)
    assert message.log_time == sec * 10**9 + nanosec
    values = struct.unpack_from("<7d", data, 28)
    np.testing.assert_allclose(values[:3], one.position[7] / 1000)
    np.testing.assert_allclose(
        Rotation.from_quat(values[3:]).as_matrix(), one.rotation[7], atol=1e-12
    )


def test_the_path_holds_all_poses_in_one_message():
    from mcap.reader import make_reader
    from rosbags.typesys import Stores, get_typestore

    one = felt()
    reader = make_reader(io.BytesIO(mcap_file.encode(motion(one))))
    [(_, _, message)] = reader.iter_messages(topics=["/path"])
    path = get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr(message.data, "nav_msgs/msg/Path")
    x = [pose.pose.position.x for pose in path.poses]
    np.testing.assert_allclose(x, one.position[:, 0] / 1000)


def test_several_strokes_are_topics_of_their_own_and_are_chosen():
    one, two = wave(name="a b"), wave(name="2", offset=200.0)
    content = mcap_file.encode(motion(one, two))
    with pytest.raises(InputError, match="/stroke_2/pose, /stroke_a_b/pose; choose one with"):
        read(content)
    same(read(content, "/stroke_2/pose")[0], two)
    with pytest.raises(InputError, match=r"--body nothing: a\.mcap has no such"):
        read(content, "nothing")


def test_times_before_zero_are_moved_to_it():
    one = wave()
    early = MotionStroke(one.t - 0.004, one.position, one.rotation)
    np.testing.assert_allclose(read(mcap_file.encode(motion(early)))[0].t, one.t, atol=1e-9)


def bag_of_others(folder, rows, frame="map", plugin="SQLITE3"):
    """A bag that rosbags writes, of Odometry, TF and a wrench in another frame."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    t = store.types
    with Writer(folder, version=9, storage_plugin=getattr(StoragePlugin, plugin)) as writer:
        kinds = {
            "/odom": "nav_msgs/msg/Odometry",
            "/tf": "tf2_msgs/msg/TFMessage",
            "/wrench": "geometry_msgs/msg/WrenchStamped",
        }
        known = {k: writer.add_connection(k, v, typestore=store) for k, v in kinds.items()}
        for i, row in enumerate(rows):
            stamp = 1_700_000_000 * 10**9 + i * 20_000_000
            time = t["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
            head = t["std_msgs/msg/Header"](time, frame)
            vector, quaternion = t["geometry_msgs/msg/Vector3"], t["geometry_msgs/msg/Quaternion"]
            pose = t["geometry_msgs/msg/Pose"](
                t["geometry_msgs/msg/Point"](*row[:3]), quaternion(*row[3:])
            )
            zero = np.zeros(36)
            twist = t["geometry_msgs/msg/Twist"](vector(0, 0, 0), vector(0, 0, 0))
            odom = t["nav_msgs/msg/Odometry"](
                head,
                "tool",
                t["geometry_msgs/msg/PoseWithCovariance"](pose, zero),
                t["geometry_msgs/msg/TwistWithCovariance"](twist, zero),
            )
            moved = t["geometry_msgs/msg/TransformStamped"](
                head,
                "tool0",
                t["geometry_msgs/msg/Transform"](
                    vector(row[0] + 1, *row[1:3]), quaternion(*row[3:])
                ),
            )
            wrench = t["geometry_msgs/msg/WrenchStamped"](
                t["std_msgs/msg/Header"](time, "sensor"),
                t["geometry_msgs/msg/Wrench"](vector(1, 2, 3), vector(4, 5, 6)),
            )
            for topic, message in (
                ("/odom", odom),
                ("/tf", t["tf2_msgs/msg/TFMessage"]([moved])),
                ("/wrench", wrench),
            ):
                content = store.serialize_cdr(message, kinds[topic])
                writer.write(known[topic], stamp, content)


@pytest.mark.slow
@pytest.mark.parametrize("plugin", ["SQLITE3", "MCAP"])
def test_odometry_and_tf_of_others_are_read(tmp_path, plugin):
    one = wave(samples=50)
    rows = np.hstack([one.position / 1000, Rotation.from_matrix(one.rotation).as_quat()])
    bag_of_others(tmp_path / "bag", rows.tolist(), plugin=plugin)
    with pytest.raises(InputError, match="several have poses: /odom, tool0"):
        ros_bag.read(tmp_path / "bag")
    blocks, told = ros_bag.read(tmp_path / "bag", "odom")
    back = blocks.whole()
    np.testing.assert_allclose(back.t, np.arange(50) * 0.02, atol=1e-12)
    np.testing.assert_allclose(back.position, one.position, atol=1e-9)
    assert angle_between(back.rotation, one.rotation).max() < 1e-9
    assert back.wrench is None
    assert "its frame is 'sensor', not 'map'" in told[1]
    back = ros_bag.read(tmp_path / "bag", "tool0")[0].whole()
    np.testing.assert_allclose(back.position, one.position + [1000, 0, 0], atol=1e-9)
    if plugin == "MCAP":
        [file] = (tmp_path / "bag").glob("*.mcap")
        back = mcap_file.read(file, "a.mcap", "tool0")[0].whole()
        np.testing.assert_allclose(back.position, one.position + [1000, 0, 0], atol=1e-9)


def test_rosbags_reads_our_bag_by_its_own_reader(tmp_path):
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    one = felt()
    ros_bag.write(motion(one), tmp_path / "bag")
    store = get_typestore(Stores.ROS2_HUMBLE)
    with AnyReader([tmp_path / "bag"], default_typestore=store) as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
        assert counts == {"/path": 1, "/pose": len(one), "/wrench": len(one)}
        [found] = [c for c in reader.connections if c.topic == "/pose"]
        x = [
            reader.deserialize(data, found.msgtype).pose.position.x
            for _, _, data in reader.messages([found])
        ]
    np.testing.assert_allclose(x, one.position[:, 0] / 1000)


def test_a_bag_never_replaces_what_is_no_bag(tmp_path):
    (tmp_path / "keep.txt").write_text("mine")
    with pytest.raises(InputError, match="something else"):
        ros_bag.write(motion(), tmp_path)
    assert (tmp_path / "keep.txt").read_text() == "mine"


@pytest.mark.parametrize("cut", [20, 200, -40])
def test_a_cut_file_is_exit_code_2(cut):
    content = mcap_file.encode(motion())[:cut]
    with pytest.raises(InputError, match=r"a\.mcap"):
        read(content)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e200])
def test_a_pose_that_is_no_quantity_is_refused_before_anything_overflows(value):
    one = wave()
    one.position[7, 1] = value
    with pytest.raises(InputError, match=r"'/pose', message 8: .* beyond 1e\+30"):
        read(mcap_file.encode(motion(one)))


def test_metadata_nested_without_end_are_refused_before_they_are_parsed(tmp_path):
    ros_bag.write(motion(), tmp_path / "bag")
    path = tmp_path / "bag" / "metadata.yaml"
    path.write_text(path.read_text().replace("custom_data:", f"custom_data: {'[' * 50_000}"))
    with pytest.raises(InputError, match="nested too deep"):
        ros_bag.read(tmp_path / "bag")


def test_messages_come_chunk_by_chunk_and_not_all_at_once(monkeypatch):
    from mcap import stream_reader, writer

    from dmpcli.formats.ros_messages import MessageReader

    small = functools.partial(writer.Writer, chunk_size=400)
    monkeypatch.setattr(writer, "Writer", lambda sink, chunk_size: small(sink))
    content = mcap_file.encode(motion(wave(samples=60)))
    opened, seen = [], []
    broken, take = stream_reader.breakup_chunk, MessageReader.take
    monkeypatch.setattr(
        stream_reader, "breakup_chunk", lambda chunk: opened.append(1) or broken(chunk)
    )
    monkeypatch.setattr(
        MessageReader, "take", lambda *given: seen.append(len(opened)) or take(*given)
    )
    back, _ = read(content)
    same(back, wave(samples=60))
    assert len(opened) > 10
    assert seen[0] <= 2
    assert max(np.diff(seen)) <= 2

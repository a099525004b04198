"""Strokes as ROS 2 messages, and poses and wrenches out of messages: m, s, N and N·m.

PoseStamped, WrenchStamped and a Path leave; PoseStamped, PoseWithCovarianceStamped, Odometry,
TransformStamped, TFMessage and WrenchStamped come in. Quaternions are x, y, z, w.
"""

import functools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmpcli import extras
from dmpcli.errors import InputError
from dmpcli.extras import ROS
from dmpcli.formats import pose_series
from dmpcli.formats.motion import Motion, MotionStroke
from dmpcli.formats.pose_series import PoseBlocks, Series
from dmpcli.spatial.rotations import to_quaternion

FRAME = "base"
POSE = "geometry_msgs/msg/PoseStamped"
WRENCH = "geometry_msgs/msg/WrenchStamped"
PATH = "nav_msgs/msg/Path"

_ODOMETRY = ("nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseWithCovarianceStamped")
_TRANSFORM, _TF = "geometry_msgs/msg/TransformStamped", "tf2_msgs/msg/TFMessage"
POSES = (POSE, *_ODOMETRY, _TRANSFORM, _TF)
READ = (*POSES, WRENCH)

MOST = 20_000_000
"""Messages of one topic."""


@dataclass(frozen=True)
class RosMessage:
    """One message as it is stored: when it was logged, ns, and its bytes in CDR."""

    topic: str
    type: str
    stamp: int
    content: bytes


def typestore(option: str, ros1: bool = False) -> Any:
    """Return the message definitions of ROS 2 Humble, or of ROS 1 Noetic.

    Raises
    ------
    InputError
        The extra is not installed.
    """
    (typesys,) = extras.load(ROS, option, "rosbags.typesys")
    return _typestore(typesys, ros1)


@functools.cache  # to make one, its types are compiled
def _typestore(typesys: Any, ros1: bool) -> Any:
    stores = typesys.Stores
    return typesys.get_typestore(stores.ROS1_NOETIC if ros1 else stores.ROS2_HUMBLE)


def topics(motion: Motion) -> list[tuple[str, str]]:
    """Return the topics of a motion and their types, in order."""
    found = []
    for one in motion.strokes:
        before = _before(motion, one)
        found += [(f"{before}/path", PATH), (f"{before}/pose", POSE)]
        found += [(f"{before}/wrench", WRENCH)] if one.wrench is not None else []
    return found


def _before(motion: Motion, one: MotionStroke) -> str:
    if len(motion.strokes) == 1:
        return ""
    return "/stroke_" + re.sub(r"\W+", "_", one.id)


def messages(motion: Motion, store: Any) -> Iterator[RosMessage]:
    """Yield the messages of a motion: of each stroke its path, then pose and wrench by time.

    Stamps count from 0: a stroke has times of its own, not a date.

    Raises
    ------
    InputError
        A stroke says no orientation.
    """
    motion.rotation_needed("ROS")
    types = store.types
    for one in motion.strokes:
        before = _before(motion, one)
        assert one.rotation is not None
        # Stamps have no sign.
        stamps = np.rint((one.t - min(0.0, float(one.t[0]))) * 1e9).astype(np.int64).tolist()
        values = np.hstack([one.position / 1000.0, to_quaternion(one.rotation)]).tolist()
        poses = [_pose(types, row) for row in values]
        heads = [_header(types, stamp) for stamp in stamps]
        stamped = [types[POSE](h, p) for h, p in zip(heads, poses, strict=True)]
        whole = types[PATH](heads[0], stamped)
        yield RosMessage(f"{before}/path", PATH, stamps[0], bytes(store.serialize_cdr(whole, PATH)))
        for i, (stamp, message) in enumerate(zip(stamps, stamped, strict=True)):
            yield RosMessage(
                f"{before}/pose", POSE, stamp, bytes(store.serialize_cdr(message, POSE))
            )
            if one.wrench is not None:
                felt = _wrench(types, heads[i], one.wrench[i].tolist())
                yield RosMessage(
                    f"{before}/wrench", WRENCH, stamp, bytes(store.serialize_cdr(felt, WRENCH))
                )


def _header(types: Any, stamp: int) -> Any:
    sec, nanosec = divmod(stamp, 1_000_000_000)
    time = types["builtin_interfaces/msg/Time"](sec, nanosec)
    return types["std_msgs/msg/Header"](time, FRAME)


def _pose(types: Any, row: list[float]) -> Any:
    return types["geometry_msgs/msg/Pose"](
        types["geometry_msgs/msg/Point"](*row[:3]),
        types["geometry_msgs/msg/Quaternion"](*row[3:]),
    )


def _wrench(types: Any, header: Any, row: list[float]) -> Any:
    vector = types["geometry_msgs/msg/Vector3"]
    both = types["geometry_msgs/msg/Wrench"](vector(*row[:3]), vector(*row[3:]))
    return types[WRENCH](header, both)


class MessageReader:
    """Takes messages one by one, and says what stroke they are.

    Parameters
    ----------
    name : str
        Of the file.
    body : str, optional
        Which topic, or which child frame of TF.
    """

    def __init__(self, name: str, body: str | None = None) -> None:
        self._name, self._body = name, body
        self._poses: dict[str, Series] = {}
        self._wrenches: dict[str, Series] = {}

    def take(self, topic: str, type_: str, message: Any) -> None:
        """Take one message.

        Parameters
        ----------
        topic : str
            Names the series; of TF messages the child frames do.
        type_ : str
            In full, as ``geometry_msgs/msg/PoseStamped``; those that are not of `READ` are passed
            over.
        message : object
            Deserialized, with its type's fields; lengths in m, forces in N.

        Raises
        ------
        InputError
            The topic holds more than `MOST` messages.
        """
        if type_ == _TF:
            for one in message.transforms:
                self._transform(one.child_frame_id, one)
        elif type_ == _TRANSFORM:
            self._transform(topic, message)
        elif type_ == POSE:
            self._add(topic, message.header, message.pose.position, message.pose.orientation)
        elif type_ in _ODOMETRY:
            inner = message.pose.pose
            self._add(topic, message.header, inner.position, inner.orientation)
        elif type_ == WRENCH:
            force, torque = message.wrench.force, message.wrench.torque
            row = (force.x, force.y, force.z, torque.x, torque.y, torque.z)
            self._take_row(self._wrenches, topic, message.header, row)

    def _transform(self, name: str, one: Any) -> None:
        self._add(name, one.header, one.transform.translation, one.transform.rotation)

    def _add(self, name: str, header: Any, p: Any, q: Any) -> None:
        if self._body is not None and name.strip("/") != self._body.strip("/"):
            self._poses.setdefault(name, Series(pose_series.POSE))  # only that it is there
            return
        self._take_row(self._poses, name, header, (p.x, p.y, p.z, q.x, q.y, q.z, q.w))

    def _take_row(
        self, known: dict[str, Series], name: str, header: Any, row: tuple[float, ...]
    ) -> None:
        series = known.get(name)
        if series is None or not series.stamps:
            series = known[name] = Series(len(row), header.frame_id)
        if len(series.stamps) >= MOST:
            raise InputError(f"{self._name}: topic {name!r} holds more than {MOST} messages")
        stamp = header.stamp
        series.add(int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec), row)

    def stroke(self) -> tuple[PoseBlocks, list[str]]:
        """Return the stroke, and how it was read.

        Raises
        ------
        InputError
            There are no poses, several series of them, or a row that is none; names it.
        """
        name, series = self._chosen()
        self._check(name, series)
        told = [f"poses of {name!r} in frame {series.frame!r}, m"]
        felt: list[str] = []
        found = PoseBlocks(series, self._felt(series, felt))
        if found.repeated:
            told.append(f"{found.repeated} messages repeated a stamp: the first is kept")
        return found, told + felt

    def _chosen(self) -> tuple[str, Series]:
        full = {name: series for name, series in self._poses.items() if series.stamps}
        if len(full) == 1:
            [only] = full.items()
            return only
        names = ", ".join(sorted(self._poses)[:10])
        if self._body is not None:
            raise InputError(
                f"--body {self._body}: {self._name} has no such topic or frame of poses; it has "
                f"{names or 'none'}"
            )
        if not full:
            raise InputError(
                f"{self._name}: holds no poses ({', '.join(kind.split('/')[-1] for kind in POSES)})"
            )
        raise InputError(f"{self._name}: several have poses: {names}; choose one with --body NAME")

    def _check(self, name: str, series: Series) -> None:
        if len(series.stamps) < 2:
            raise InputError(
                f"{self._name}: topic {name!r} holds {len(series.stamps)} pose, no stroke"
            )
        fault = series.judged()
        if fault is not None:
            raise InputError(f"{self._name}: topic {name!r}, message {fault[0] + 1}: {fault[1]}")

    def _felt(self, poses: Series, told: list[str]) -> Series | None:
        """Wrenches in the poses' axes over all of their time; None where there are none."""
        stamps = np.frombuffer(poses.stamps, dtype=np.int64)
        first, last = int(stamps.min()), int(stamps.max())
        for name, series in self._wrenches.items():
            own = np.frombuffer(series.stamps, dtype=np.int64)
            if series.frame != poses.frame:
                told.append(
                    f"wrench of {name!r} is not read: its frame is {series.frame!r}, not "
                    f"{poses.frame!r}"
                )
                continue
            if len(own) < 2 or series.judged() is not None or (np.diff(own) < 0).any():
                continue
            if own[0] > first or own[-1] < last:
                told.append(
                    f"wrench of {name!r} is not read: it does not last as long as the poses"
                )
                continue
            told.append(f"wrench of {name!r}")
            return series
        return None

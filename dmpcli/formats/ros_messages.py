"""Strokes as ROS 2 messages, and poses and wrenches out of messages: m, s, N and N·m.

PoseStamped, WrenchStamped and a Path leave; PoseStamped, PoseWithCovarianceStamped, Odometry,
TransformStamped, TFMessage and WrenchStamped come in. Quaternions are x, y, z, w.
"""

import functools
import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dmpcli import extras
from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.extras import ROS
from dmpcli.formats.motion import Motion, MotionStroke
from dmpcli.records.columns import LARGEST
from dmpcli.records.rotation_forms import wrong
from dmpcli.spatial.rotations import from_quaternion, to_quaternion

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


@dataclass
class _Series:
    """What one topic or frame holds: stamps in ns, and so many numbers a row."""

    width: int
    frame: str = ""
    stamps: "array[int]" = field(default_factory=lambda: array("q"))
    values: "array[float]" = field(default_factory=lambda: array("d"))

    def table(self) -> Floats:
        return np.frombuffer(self.values, dtype=float).reshape(-1, self.width)


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
        self._poses: dict[str, _Series] = {}
        self._wrenches: dict[str, _Series] = {}

    def take(self, topic: str, type_: str, message: Any) -> None:
        """Take one message."""
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
            series = self._series(self._wrenches, topic, 6, message.header)
            for vector in (message.wrench.force, message.wrench.torque):
                series.values.extend((vector.x, vector.y, vector.z))

    def _transform(self, name: str, one: Any) -> None:
        self._add(name, one.header, one.transform.translation, one.transform.rotation)

    def _add(self, name: str, header: Any, p: Any, q: Any) -> None:
        if self._body is not None and name.strip("/") != self._body.strip("/"):
            self._poses.setdefault(name, _Series(7))  # only to know that it is there
            return
        series = self._series(self._poses, name, 7, header)
        series.values.extend((p.x, p.y, p.z, q.x, q.y, q.z, q.w))

    def _series(self, known: dict[str, _Series], name: str, width: int, header: Any) -> _Series:
        series = known.get(name)
        if series is None or not series.stamps:
            series = known[name] = _Series(width, header.frame_id)
        if len(series.stamps) >= MOST:
            raise InputError(f"{self._name}: topic {name!r} holds more than {MOST} messages")
        stamp = header.stamp
        series.stamps.append(int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec))
        return series

    def stroke(self) -> tuple[MotionStroke, list[str]]:
        """Return the stroke, and how it was read.

        Raises
        ------
        InputError
            There are no poses, several series of them, or a row that is none; names it.
        """
        name, series = self._chosen()
        stamps = np.frombuffer(series.stamps, dtype=np.int64)
        values = series.table()
        self._check(name, stamps, values)
        order = np.argsort(stamps, kind="stable")
        keep = order[np.concatenate([[True], np.diff(stamps[order]) > 0])]
        told = [f"poses of {name!r} in frame {series.frame!r}, m"]
        if len(keep) < len(stamps):
            told.append(f"{len(stamps) - len(keep)} messages repeated a stamp: the first is kept")
        # From 0 where stamps count from an epoch; ours count from the stroke's beginning.
        first = int(stamps[keep[0]])
        t = (stamps[keep] - (first if first > 1_000_000 * 1_000_000_000 else 0)) * 1e-9
        q = values[keep, 3:]
        R = from_quaternion(q / np.linalg.norm(q, axis=1, keepdims=True))
        felt = self._felt(series.frame, stamps[keep], told)
        return MotionStroke(t, values[keep, :3] * 1000.0, R, wrench=felt), told

    def _chosen(self) -> tuple[str, _Series]:
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

    def _check(self, name: str, stamps: Any, values: Floats) -> None:
        if len(stamps) < 2:
            raise InputError(f"{self._name}: topic {name!r} holds {len(stamps)} pose, no stroke")
        bad = ~(np.abs(values) <= LARGEST).all(axis=1)
        if bad.any():
            row = int(np.argmax(bad)) + 1
            raise InputError(
                f"{self._name}: topic {name!r}, message {row}: holds a value that is not a number, "
                f"or beyond {LARGEST:g}"
            )
        fault = wrong("quaternion", values[:, 3:])
        if fault is not None:
            raise InputError(f"{self._name}: topic {name!r}, message {fault[0] + 1}: {fault[1]}")

    def _felt(self, frame: str, stamps: Any, told: list[str]) -> Floats | None:
        """Wrench at the poses' stamps; None where there is none in their axes over their time."""
        for name, series in self._wrenches.items():
            values, own = series.table(), np.frombuffer(series.stamps, dtype=np.int64)
            if series.frame != frame:
                told.append(
                    f"wrench of {name!r} is not read: its frame is {series.frame!r}, not {frame!r}"
                )
                continue
            if len(own) < 2 or not (np.abs(values) <= LARGEST).all() or (np.diff(own) < 0).any():
                continue
            if own[0] > stamps[0] or own[-1] < stamps[-1]:
                told.append(
                    f"wrench of {name!r} is not read: it does not last as long as the poses"
                )
                continue
            at, since = (stamps - own[0]) * 1e-9, (own - own[0]) * 1e-9
            told.append(f"wrench of {name!r}")
            return np.column_stack([np.interp(at, since, column) for column in values.T])
        return None

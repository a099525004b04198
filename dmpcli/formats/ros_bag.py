"""ROS 2 bags through rosbags: a folder with ``metadata.yaml`` and its storage."""

import os
import shutil
from pathlib import Path

import numpy as np

from dmpcli import extras
from dmpcli.errors import InputError
from dmpcli.extras import ROS
from dmpcli.formats import ros_messages
from dmpcli.formats.motion import Motion
from dmpcli.formats.pose_series import PoseBlocks
from dmpcli.formats.ros_messages import MessageReader
from dmpcli.records import untrusted

METADATA = "metadata.yaml"

LARGEST, DEEPEST = 1 << 20, 100
"""Bytes of the metadata, and brackets within brackets: the time of their reader grows faster."""
_OPENING, _CLOSING = (np.frombuffer(signs, dtype=np.uint8) for signs in (b"[{", b"]}"))


def write(motion: Motion, folder: Path) -> None:
    """Write a bag (SQLite storage) whole, or not at all; an older bag of that name is replaced.

    Raises
    ------
    InputError
        A stroke says no orientation, the folder holds something else or cannot be written, or the
        extra is not installed.
    """
    (rosbag2,) = extras.load(ROS, "ROS 2 bag", "rosbags.rosbag2")
    store = ros_messages.typestore("ROS 2 bag")
    motion.rotation_needed("ROS")
    foreign = folder.is_dir() and any(folder.iterdir()) and not (folder / METADATA).is_file()
    if foreign:
        raise InputError(f"{folder}: holds something else than a bag; choose another folder")
    # The storage is named after the folder that it is written into.
    place = folder.absolute().with_name(f".{folder.name}.{os.getpid()}.tmp")
    temporary = place / folder.name
    try:
        place.mkdir()
        with rosbag2.Writer(
            temporary, version=8, storage_plugin=rosbag2.StoragePlugin.SQLITE3
        ) as writer:
            known = {
                topic: writer.add_connection(topic, type_, typestore=store)
                for topic, type_ in ros_messages.topics(motion)
            }
            for one in ros_messages.messages(motion, store):
                writer.write(known[one.topic], one.stamp, one.content)
        if folder.is_dir():
            shutil.rmtree(folder)
        temporary.rename(folder)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from None
    finally:
        shutil.rmtree(place, ignore_errors=True)


def read(folder: Path, body: str | None = None) -> tuple[PoseBlocks, list[str]]:
    """Read the poses of a bag.

    Parameters
    ----------
    folder : Path
    body : str, optional
        Which topic or frame.

    Raises
    ------
    InputError
        Damaged, without poses, or with several series of them.
    """
    name = str(folder)
    (rosbag2,) = extras.load(ROS, name, "rosbags.rosbag2")
    store = ros_messages.typestore(name)
    found = MessageReader(name, body)
    _judge(folder)
    with untrusted.decoding(name), rosbag2.Reader(folder) as reader:
        wanted = [one for one in reader.connections if one.msgtype in ros_messages.READ]
        for one, _, content in reader.messages(connections=wanted) if wanted else ():
            found.take(one.topic, one.msgtype, store.deserialize_cdr(content, one.msgtype))
    return found.stroke()


def _judge(folder: Path) -> None:
    """Refuse metadata that its reader would take minutes for.

    Raises
    ------
    InputError
    """
    metadata = folder / METADATA
    try:
        untrusted.judge_size(str(metadata), metadata.stat().st_size, LARGEST, "a bag's metadata")
        text = np.frombuffer(metadata.read_bytes(), dtype=np.uint8)
    except OSError as error:
        raise InputError(f"{metadata}: cannot be read: {error.strerror}") from None
    depth = np.cumsum(np.isin(text, _OPENING) * 1 - np.isin(text, _CLOSING) * 1)
    if depth.max(initial=0) > DEEPEST:
        raise InputError(f"{metadata}: is nested too deep; make the bag again")

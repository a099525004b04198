"""MCAP of ROS 2 messages: what Foxglove, PlotJuggler and rosbag2 read.

Format: mcap.dev/spec; schemas ``ros2msg``, messages ``cdr``.
"""

import io
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from dmpcli import extras
from dmpcli.errors import InputError
from dmpcli.extras import ROS
from dmpcli.formats import ros_messages
from dmpcli.formats.motion import Motion
from dmpcli.formats.pose_series import PoseBlocks
from dmpcli.formats.ros_messages import MessageReader
from dmpcli.records import untrusted
from dmpcli.version import __version__

MAGIC = b"\x89MCAP0\r\n"

LARGEST_RECORD = 512 << 20
"""Bytes of one record or chunk."""

_RECORD_HEAD = 9
"""Bytes of a record's kind and length."""


def encode(motion: Motion) -> bytes:
    """Return the file; the same motion gives the same bytes.

    Raises
    ------
    InputError
        A stroke says no orientation, or the extra is not installed.
    """
    (writing,) = extras.load(ROS, "MCAP", "mcap.writer")
    store = ros_messages.typestore("MCAP")
    sink = io.BytesIO()
    writer = writing.Writer(sink, chunk_size=1 << 20)
    writer.start(profile="ros2", library=f"dmpcli {__version__}")
    schemas: dict[str, int] = {}
    channels: dict[str, int] = {}
    for topic, type_ in ros_messages.topics(motion):
        if type_ not in schemas:
            text, _ = store.generate_msgdef(type_, ros_version=2)
            schemas[type_] = writer.register_schema(type_, "ros2msg", text.encode())
        channels[topic] = writer.register_channel(topic, "cdr", schemas[type_])
    for count, one in enumerate(ros_messages.messages(motion, store)):
        writer.add_message(channels[one.topic], one.stamp, one.content, one.stamp, count)
    writer.finish()
    return sink.getvalue()


def read(path: Path, name: str, body: str | None = None) -> tuple[PoseBlocks, list[str]]:
    """Read the poses of a file, one chunk at a time.

    Parameters
    ----------
    path : Path
    name : str
        What messages call it.
    body : str, optional
        Which topic or frame.

    Raises
    ------
    InputError
        Damaged, without poses, or with several series of them.
    """
    with path.open("rb") as stream:
        return decode(stream, name, body)


def decode(stream: IO[bytes], name: str, body: str | None) -> tuple[PoseBlocks, list[str]]:
    """Read the poses of an open file; see `read`."""
    (reading,) = extras.load(ROS, name, "mcap.reader")
    found = MessageReader(name, body)
    with untrusted.decoding(name):
        _take(reading, stream, name, found)
    return found.stroke()


def _take(reading: Any, stream: IO[bytes], name: str, found: MessageReader) -> None:
    stores: dict[str, Any] = {}
    reader = reading.SeekingReader(stream, record_size_limit=LARGEST_RECORD)
    for schema, channel, message in _messages(reader, stream, name):
        kind = _full(schema.name) if schema is not None else ""
        if kind not in ros_messages.READ:
            continue
        encoding = channel.message_encoding
        if encoding not in ("cdr", "ros1"):
            raise InputError(
                f"{name}: topic {channel.topic!r} holds {encoding or 'unknown'} messages; cdr and "
                "ros1 are read"
            )
        if encoding not in stores:
            stores[encoding] = ros_messages.typestore(name, ros1=encoding == "ros1")
        store = stores[encoding]
        decode_ = store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1
        found.take(channel.topic, kind, decode_(message.data, kind))


def _messages(reader: Any, stream: IO[bytes], name: str) -> Iterator[tuple[Any, Any, Any]]:
    """Yield schema, channel and message, in the file's order, one chunk at a time.

    The library's own way holds the messages of all chunks before it gives the first.
    """
    summary = reader.get_summary()
    wanted = _wanted(summary)
    if summary is None or not summary.chunk_indexes:
        yield from reader.iter_messages(topics=wanted, log_time_order=False)
        return
    (data_stream, records, stream_reader) = extras.load(
        ROS, name, "mcap.data_stream", "mcap.records", "mcap.stream_reader"
    )
    channels, schemas = summary.channels, summary.schemas
    for index in sorted(summary.chunk_indexes, key=lambda one: int(one.chunk_start_offset)):
        topics = [channels[number].topic for number in index.message_index_offsets]
        if wanted is not None and topics and not set(topics) & set(wanted):
            continue
        for size in (index.chunk_length, index.uncompressed_size):
            untrusted.judge_size(name, size, LARGEST_RECORD, "one chunk")
        stream.seek(index.chunk_start_offset + _RECORD_HEAD)
        chunk = records.Chunk.read(data_stream.ReadDataStream(stream))
        for one in stream_reader.breakup_chunk(chunk):
            if isinstance(one, records.Message):
                channel = channels[one.channel_id]
                if wanted is None or channel.topic in wanted:
                    yield schemas.get(channel.schema_id), channel, one


def _wanted(summary: Any) -> list[str] | None:
    """Topics that hold what is read: chunks without them are passed over. None: look at all."""
    if summary is None or not summary.channels:
        return None
    return [
        channel.topic
        for channel in summary.channels.values()
        if channel.schema_id in summary.schemas
        and _full(summary.schemas[channel.schema_id].name) in ros_messages.READ
    ]


def _full(name: str) -> str:
    """Name of a type as ROS 2 has it: geometry_msgs/PoseStamped is of ROS 1."""
    package, _, rest = name.partition("/")
    return name if "/" in rest else f"{package}/msg/{rest}"

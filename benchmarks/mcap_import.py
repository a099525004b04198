"""An MCAP file of 1 GB through `import`: time and largest size of the process.

Usage: python -m benchmarks.mcap_import [MB] [FOLDER]. The messages are nav_msgs/Odometry at 1 kHz:
0.75 kB each, poses with covariances.
"""

import itertools
import struct
import sys
import tempfile
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

from benchmarks.whole_process import taken
from dmpcli.formats import ros_messages

TYPE = "nav_msgs/msg/Odometry"


def _template(store: object) -> bytes:
    """One message in CDR; stamp and pose are put into copies of it."""
    types = store.types  # type: ignore[attr-defined]
    vector = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    pose = types["geometry_msgs/msg/Pose"](
        types["geometry_msgs/msg/Point"](0.0, 0.0, 0.0),
        types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
    )
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "base")
    twist = types["geometry_msgs/msg/Twist"](vector, vector)
    none = np.zeros(36)
    message = types[TYPE](
        header,
        "tool0",
        types["geometry_msgs/msg/PoseWithCovariance"](pose, none),
        types["geometry_msgs/msg/TwistWithCovariance"](twist, none),
    )
    return bytes(store.serialize_cdr(message, TYPE))  # type: ignore[attr-defined]


def write(path: Path, size: float) -> int:
    """Write so many bytes; return how many messages they are."""
    store = ros_messages.typestore("MCAP")
    template = _template(store)
    pose = template.index(struct.pack("<d", 1.0)) - 48
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=1 << 20, compression=CompressionType.NONE)
        writer.start(profile="ros2", library="benchmark")
        text, _ = store.generate_msgdef(TYPE, ros_version=2)
        schema = writer.register_schema(TYPE, "ros2msg", text.encode())
        channel = writer.register_channel("/odom", "cdr", schema)
        for count in itertools.count():
            s = count * 1e-3
            data = bytearray(template)
            struct.pack_into("<iI", data, 4, *divmod(count * 1_000_000, 1_000_000_000))
            place = (0.1 * np.sin(0.7 * s), 0.1 * np.cos(0.9 * s), 0.02 * np.sin(3.0 * s))
            half = 0.1 * np.sin(s)
            struct.pack_into("<7d", data, pose, *place, np.cos(half), np.sin(half), 0.0, 0.0)
            writer.add_message(channel, count * 1_000_000, bytes(data), count * 1_000_000, count)
            if count % 1000 == 0 and stream.tell() >= size:
                break
        writer.finish()
    return count + 1


def main(size: float, place: str | None) -> None:
    """Print a Markdown table."""
    with tempfile.TemporaryDirectory(dir=place) as name:
        folder = Path(name)
        count = write(folder / "long.mcap", size * 1e6)
        done = taken(["import", "long.mcap", "-o", "long.parquet"], folder)
        print("| MCAP, MB | messages | Parquet, MB | clock, s | processor, s | peak, MiB |")
        print("| ---: | ---: | ---: | ---: | ---: | ---: |")
        print(
            f"| {(folder / 'long.mcap').stat().st_size / 1e6:.0f} | {count:,} "
            f"| {(folder / 'long.parquet').stat().st_size / 1e6:.0f} | {done.cells} |"
        )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 1000.0, sys.argv[2] if sys.argv[2:] else None)

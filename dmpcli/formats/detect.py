"""What kind of file of another program this is: by its first bytes, else by its suffix."""

import re
from pathlib import Path

from dmpcli.errors import InputError
from dmpcli.formats import lerobot_dataset, mcap_file, ros_bag
from dmpcli.records.file_io import Source

_SUFFIXES = {
    ".svg": "svg",
    ".gcode": "gcode",
    ".ngc": "gcode",
    ".nc": "gcode",
    ".tap": "gcode",
    ".script": "urscript",
    ".urscript": "urscript",
    ".src": "krl",
    ".mod": "rapid",
    ".modx": "rapid",
}
_SVG = re.compile(rb"<(?:\w+:)?svg[\s>]")


def kind_of_path(path: Path) -> str | None:
    """Return the word of a kind that is not read whole: a folder or an MCAP file; else None.

    Raises
    ------
    InputError
        A folder of no kind that is read.
    """
    if path.is_dir():
        if (path / lerobot_dataset.INFO).is_file():
            return "lerobot"
        if (path / ros_bag.METADATA).is_file():
            return "ros2"
        raise InputError(
            f"{path}: is a folder without {ros_bag.METADATA} (ROS 2 bag) or "
            f"{lerobot_dataset.INFO} (LeRobot); name a file of it"
        )
    try:
        with path.open("rb") as stream:
            return "mcap" if stream.read(len(mcap_file.MAGIC)) == mcap_file.MAGIC else None
    except OSError:
        return None  # the reader of whole files says why


def kind_of(source: Source) -> str:
    """Return the word of a kind; ``table`` for what none of them is."""
    head = source.content[: 1 << 12]
    if head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<" and _SVG.search(head):
        return "svg"
    return _SUFFIXES.get(Path(source.name).suffix.lower(), "table")

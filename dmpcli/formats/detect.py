"""What kind of file of another program this is: by its first bytes, else by its suffix."""

import re
from pathlib import Path

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


def kind_of(source: Source) -> str:
    """Return the word of a kind; ``table`` for what none of them is."""
    head = source.content[: 1 << 12]
    if head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<" and _SVG.search(head):
        return "svg"
    return _SUFFIXES.get(Path(source.name).suffix.lower(), "table")

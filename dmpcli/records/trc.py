"""TRC files of marker trajectories (OpenSim, Cortex): X Y Z of each marker, in the unit they tell.

Two lines of words and values, a line of markers, a line of axes, the rows. Format: OpenSim's
documentation, Marker (.trc) Files.
"""

from dmpcli.errors import InputError
from dmpcli.records import tables, untrusted
from dmpcli.records.file_io import Source
from dmpcli.records.table import Table
from dmpcli.records.text_lines import TextLines, begins, every_line
from dmpcli.records.untrusted import decoder

LAYOUT = "trc"
MAGIC = b"PathFileType"


def matches(source: Source) -> bool:
    """Tell a file by its first word."""
    return begins(source, MAGIC)


@decoder
def read(source: Source) -> Table:
    """Read a file whole.

    Raises
    ------
    InputError
        A line of its head is missing.
    """
    every = every_line(source)
    at = next((i for i, line in enumerate(every[:8]) if line.startswith("Frame#")), None)
    if at is None or at < 2 or at + 2 >= len(every):
        raise InputError(f"{source.name}: begins as a TRC file, but has no line 'Frame#  Time ...'")
    said = dict(zip(every[at - 2].split("\t"), every[at - 1].split("\t"), strict=False))
    unit = said.get("Units", "").strip()
    markers = [name.strip() for name in every[at].split("\t")[2:] if name.strip()]
    names = ["Frame", "Time"] + [
        f"{marker}.{axis}{f' [{unit}]' if unit else ''}" for marker in markers for axis in "XYZ"
    ]
    untrusted.judge_columns(source.name, len(names), names)
    twice = next((name for i, name in enumerate(markers) if name in markers[:i]), None)
    if twice is not None:
        raise InputError(f"{source.name}: marker {twice!r} is there twice; rename one")
    kept = [i for i in range(at + 2, len(every)) if every[i].strip()]
    every = ["\t".join(line.split("\t")[: len(names)]) for line in every]
    body = TextLines.kept(every, kept)
    columns = tables.body_columns(body, names, b"\t", source.name)
    return Table(source.name, columns, body.numbers)

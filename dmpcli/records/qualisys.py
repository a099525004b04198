"""Qualisys Track Manager's TSV exports: lines of a word and its value, a line of names, the rows.

Of 6D data each body has X Y Z in mm, Roll Pitch Yaw, a residual, and its rotation matrix Rot[0] to
Rot[8] column by column, which is read; of 3D data each marker X Y Z. Where no time is exported it
is counted at FREQUENCY. Format: the user manual of QTM, TSV file formats.
"""

import numpy as np

from dmpcli.errors import InputError
from dmpcli.records import tables, untrusted
from dmpcli.records.file_io import Source
from dmpcli.records.table import Table
from dmpcli.records.text_lines import TextLines, begins, every_line
from dmpcli.records.untrusted import decoder

LAYOUT = "qualisys"
MAGIC = b"NO_OF_FRAMES"


def matches(source: Source) -> bool:
    """Tell an export by its first word."""
    return begins(source, MAGIC)


@decoder
def read(source: Source) -> Table:
    """Read an export whole.

    Raises
    ------
    InputError
        There are no rows, or no names for them.
    """
    every = [line.rstrip("\t ") for line in every_line(source)]
    at = next((i for i, line in enumerate(every[:40]) if i and _is_row(line)), None)
    if at is None:
        raise InputError(f"{source.name}: begins as an export of Qualisys, but holds no rows")
    said = {cells[0]: cells[1:] for cells in (line.split("\t") for line in every[:at])}
    width = len(every[at].split("\t"))
    names = _names(every[at - 1].split("\t"), said, width, source.name)
    untrusted.judge_columns(source.name, len(names), names)
    kept = [i for i in range(at, len(every)) if every[i]]
    body = TextLines.kept(every, kept)
    columns = tables.body_columns(body, names, b"\t", source.name)
    remarks = []
    if "Time" not in names:
        rate = float(said.get("FREQUENCY", ["0"])[0] or 0.0)
        if not rate > 0.0:
            raise InputError(f"{source.name}: has neither times nor a FREQUENCY; export it anew")
        columns["Time"] = np.arange(len(kept)) / rate
        remarks.append(f"time counted by the rows at {rate:g} Hz")
    return Table(source.name, columns, body.numbers, remarks=tuple(remarks))


def _is_row(line: str) -> bool:
    cells = line.split("\t")
    try:
        [float(cell) for cell in cells]
    except ValueError:
        return False
    return len(cells) > 2


def _names(head: list[str], said: dict[str, list[str]], width: int, file: str) -> list[str]:
    """Name the columns: the body or marker, a point, the axis."""
    if head[0].startswith(("MARKER_NAMES", "TRAJECTORY_TYPES", "DATA_INCLUDED")):
        bodies = [name for name in said.get("MARKER_NAMES", []) if name]
        head = [f"{body} {axis}" for body in bodies for axis in "XYZ"]
        head = [*("Frame", "Time")[: width - len(head)], *head] if width > len(head) else head
    if len(head) != width:
        raise InputError(
            f"{file}: its rows have {width} columns, and {len(head)} are named; export it with "
            "the headers of its columns"
        )
    names: list[str] = []
    body = ""
    for cell in (text.strip() for text in head):
        before, _, axis = cell.rpartition(" ")
        if before and axis in ("X", "Y", "Z"):
            body = before
        word = axis if before and axis in ("X", "Y", "Z") else cell
        if word.startswith("Rot[") and word[4:5].isdigit():
            entry = int(word[4])
            word = f"R{entry % 3 + 1}{entry // 3 + 1}"
        name = word if word in ("Frame", "Time") or not body else f"{body}.{word}"
        while name in names:
            name += "'"
        names.append(name)
    return names

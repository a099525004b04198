"""Vicon's CSV exports (Nexus, Tracker): what they hold, the rate, subjects, columns, units, rows.

``Objects`` and ``Segments`` hold RX RY RZ, or RX RY RZ RW, and TX TY TZ of each; ``Trajectories``
X Y Z of each marker. Rows are counted by frame: time is frame / rate. With RW the four are a
quaternion; three alone are not said to be Euler angles or a rotation vector, and are not read
unasked.
"""

import csv
import io

from dmpcli.errors import InputError
from dmpcli.records import tables, untrusted
from dmpcli.records.file_io import Source
from dmpcli.records.table import Table
from dmpcli.records.text_lines import MARK, TextLines, every_line
from dmpcli.records.untrusted import decoder

LAYOUT = "vicon"
_KINDS = ("Objects", "Segments", "Trajectories", "Joints")
_QUATERNION = {
    "RX": "Quaternion.X",
    "RY": "Quaternion.Y",
    "RZ": "Quaternion.Z",
    "RW": "Quaternion.W",
}


def matches(source: Source) -> bool:
    """Tell an export by its first two lines: what it holds, and a rate."""
    head = source.content[:256].removeprefix(MARK).replace(b"\r\n", b"\n").split(b"\n")
    first = [line.decode("utf-8", "replace").strip(' ,;\t"') for line in head[:2]]
    return len(first) == 2 and first[0] in _KINDS and first[1].replace(".", "", 1).isdigit()


@decoder
def read(source: Source) -> Table:
    """Read an export whole.

    Raises
    ------
    InputError
        There is no line ``Frame, Sub Frame``, or no rate above 0.
    """
    every = every_line(source)
    separator = ";" if every[0].count(";") > every[0].count(",") or ";" in every[2] else ","
    rate = float(every[1].strip(' ,;\t"'))
    at = next((i for i, line in enumerate(every[:12]) if line.startswith("Frame")), None)
    if at is None or at < 2 or not rate > 0.0 or at + 2 >= len(every):
        raise InputError(
            f"{source.name}: begins as an export of Vicon's, but has no rate or no line "
            "'Frame,Sub Frame,...'; export it anew as ASCII"
        )
    head = list(csv.reader(io.StringIO("\n".join(every[at - 1 : at + 2])), delimiter=separator))
    subjects, axes, units = (row + [""] * (len(head[1]) - len(row)) for row in head)
    untrusted.judge_columns(source.name, len(axes))
    names, remarks = _names(subjects, axes, units)
    untrusted.judge_columns(source.name, len(names), names)
    kept = _until_blank(every, at + 2)
    body = TextLines.kept(every, kept)
    columns = tables.body_columns(body, names, separator.encode(), source.name)
    frames = Table(source.name, columns, body.numbers).numbers(names[0])
    columns["Time"] = frames / rate
    remarks.append(f"time counted by the frames at {rate:g} Hz")
    return Table(source.name, columns, body.numbers, remarks=tuple(remarks))


def _until_blank(every: list[str], first: int) -> list[int]:
    """Numbers of the rows up to the first blank line: behind it another section may begin."""
    kept = []
    for number in range(first, len(every)):
        if not every[number].strip(" ,;\t"):
            break
        kept.append(number)
    return kept


def _names(subjects: list[str], axes: list[str], units: list[str]) -> tuple[list[str], list[str]]:
    names: list[str] = []
    remarks: list[str] = []
    subject, quaternions = "", "RW" in axes
    for column, axis in enumerate(axes):
        subject = subjects[column].strip() or subject
        word, unit = axis.strip(), units[column].strip()
        if column < 2 or not word:
            names.append(word or f"column {column + 1}")
            continue
        word = _QUATERNION.get(word, word) if quaternions else word
        name = f"{subject}.{word}" if subject else word
        names.append(f"{name} [{unit}]" if unit and "Quaternion" not in word else name)
    if "RX" in axes and not quaternions:
        remarks.append(
            "RX RY RZ are not read: the export does not say what they are; --rotation rotvec "
            "reads them as rotation vectors (helical, as Vicon's global angles are), --rotation "
            "XYZ as Euler angles"
        )
    while (twice := next((n for i, n in enumerate(names) if n in names[:i]), None)) is not None:
        names[len(names) - 1 - names[::-1].index(twice)] += "'"
    return names, remarks

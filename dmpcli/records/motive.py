"""OptiTrack Motive's CSV export: a line about the take, lines about the columns, then the rows.

Columns become ``BODY.Position.X`` and ``BODY.Rotation.W``; those of single markers keep their type
before the component, so that no body's end of name fits them. Positions carry the unit of length
that the take tells. Format: docs.optitrack.com, Data Export: CSV (format versions 1.1 to 1.25).
"""

import csv
import io

from dmpcli.errors import InputError
from dmpcli.records import tables, untrusted
from dmpcli.records.file_io import Source
from dmpcli.records.table import Table
from dmpcli.records.text_lines import MARK, TextLines, every_line
from dmpcli.records.untrusted import decoder

MAGIC = b"Format Version,"

_BODIES = ("rigid body", "bone")


def is_motive(source: Source) -> bool:
    """Tell an export by its first words."""
    return source.content.removeprefix(MARK).lstrip()[: len(MAGIC)] == MAGIC


@decoder
def read(source: Source) -> Table:
    """Read an export whole.

    Raises
    ------
    InputError
        The lines about the columns are not there (exported without a header).
    """
    every = every_line(source)
    at = next(
        (i for i, line in enumerate(every[:20]) if line.lstrip(",").startswith("Frame,")), None
    )
    if at is None:
        raise InputError(
            f"{source.name}: begins as an export of Motive, but has no line 'Frame,Time (Seconds)';"
            " export it with its header"
        )
    head = list(csv.reader(io.StringIO("\n".join(every[: at + 1]))))
    take = dict(zip(head[0][::2], head[0][1::2], strict=False))
    untrusted.judge_columns(source.name, len(head[-1]))
    names = _names(head[1:], take.get("Length Units", take.get("Units", "")))
    untrusted.judge_columns(source.name, len(names), names)
    kept = [i for i in range(at + 1, len(every)) if every[i].strip()]
    body = TextLines.kept(every, kept)
    columns = tables.body_columns(body, names, b",", source.name)
    remarks = ["Motive's axes are taken as they are: y is up unless it was exported otherwise"]
    kind = take.get("Rotation Type", "Quaternion")
    if kind.lower() != "quaternion":
        remarks.append(f"rotations of type {kind} are not read; export them as Quaternion")
        columns = {k: v for k, v in columns.items() if ".Rotation." not in k}
    return Table(source.name, columns, body.numbers, remarks=tuple(remarks))


def _names(head: list[list[str]], unit: str) -> list[str]:
    """Join what the lines about the columns say of each to one name."""
    axes = head[-1]
    width = len(axes)
    rows = [row + [""] * (width - len(row)) for row in head[:-1] if any(row)]
    kinds = next((row for row in rows if "Type" in row[:2]), rows[0] if rows else [""] * width)
    bodies = next((row for row in rows if "Name" in row[:2]), rows[1] if len(rows) > 1 else kinds)
    components = next((row for row in reversed(rows) if {"Position", "Rotation"} & set(row)), kinds)
    names: list[str] = []
    taken: set[str] = set()
    for column, axis in enumerate(axes):
        if column < 2 or not bodies[column]:
            name = axis or f"column {column + 1}"
        else:
            kind, what = kinds[column], components[column]
            if kind.lower() not in _BODIES:
                what = f"{kind} {what}"
            name = f"{bodies[column]}.{what}.{axis}" if axis else f"{bodies[column]}.{what}"
            if what == "Position" and unit:
                name += f" [{unit}]"
        while name in taken:
            name += "'"
        taken.add(name)
        names.append(name)
    return names

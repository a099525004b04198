"""CSV with units in its header: ``t [s], x [mm], ..., rx [rad], ...``; doubles to their last digit.

Euler angles are X-Y-Z intrinsic, continuous along each stroke, as in all files of the program.
"""

import io
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.formats.motion import Motion
from dmpcli.records.schemas import EULER_ANGLES, NORMAL, POSITION, WRENCH
from dmpcli.spatial.rotations import to_euler_continuous


def encode(motion: Motion) -> bytes:
    """Return the table; with a column ``id`` where there are several strokes."""
    columns: dict[str, Any] = {}
    strokes = motion.strokes
    if len(strokes) > 1:
        columns["id"] = [one.id for one in strokes for _ in range(len(one))]
    columns["t [s]"] = np.concatenate([one.t for one in strokes])
    nothing = [np.full((len(one), 6), np.nan) for one in strokes]
    groups: list[tuple[tuple[str, ...], str, list[Any]]] = [
        (POSITION, "mm", [one.position for one in strokes]),
        (
            EULER_ANGLES,
            "rad",
            [
                None if one.rotation is None else to_euler_continuous(one.rotation)
                for one in strokes
            ],
        ),
        (NORMAL, "", [one.normal for one in strokes]),
        (WRENCH[:3], "N", [None if one.wrench is None else one.wrench[:, :3] for one in strokes]),
        (WRENCH[3:], "N·m", [None if one.wrench is None else one.wrench[:, 3:] for one in strokes]),
    ]
    for names, unit, parts in groups:
        if any(part is not None for part in parts):
            values = np.concatenate(
                [
                    empty[:, : len(names)] if part is None else part
                    for part, empty in zip(parts, nothing, strict=True)
                ]
            )
            for i, name in enumerate(names):
                columns[f"{name} [{unit}]" if unit else name] = values[:, i]
    return table(columns)


def table(columns: dict[str, Any]) -> bytes:
    """Return columns of text and numbers as CSV; NaN becomes an empty cell."""
    from pyarrow import csv

    arrays = [
        pa.array(values, pa.string())
        if isinstance(values, list)
        else pa.array(values + 0.0, mask=np.isnan(values))
        for values in columns.values()
    ]
    sink = io.BytesIO()
    csv.write_csv(
        pa.Table.from_arrays(arrays, names=list(columns)),
        sink,
        csv.WriteOptions(include_header=False, quoting_style="needed"),
    )
    # Names without quotes, as every reader of plain CSV takes them.
    return (",".join(columns) + "\n").encode() + sink.getvalue()

"""Demonstrations from any recording: ours, or a table with ``t x y z`` under any names and units.

Lengths, angles and times of other makes are converted here, at the edge.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np

from dmpcli import rotations
from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.primitives.smoothing import Stroke
from dmpcli.records import record, schemas, tables
from dmpcli.records.pairs import FARTHEST
from dmpcli.records.schemas import EULER_ANGLES, POSE
from dmpcli.records.streams import Source
from dmpcli.records.tables import Table

RotationForm = Literal["euler", "rotvec", "quaternion"]

SHORTEST = 10
"""Fewer samples than this are no stroke."""

LONGEST = 1e6
"""A recording longer than this, s, is in another unit of time."""

SHORTEST_STEP = 1e-6
"""Rows nearer to each other than this, s, are in another unit of time."""

LARGEST_TURN = 4 * np.pi
"""Angles beyond this, rad, are in degrees."""

LONGEST_GAP = 25.0
"""A gap of more median steps than this cannot be filled in: nobody knows what the tool did."""

LENGTH = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGLE = {"rad": 1.0, "deg": np.pi / 180.0}

_QUATERNION = ("qx", "qy", "qz", "qw")
_MAPPABLE = ("t", *POSE, *_QUATERNION)


@dataclass(frozen=True)
class Layout:
    """How another program's table maps to ours.

    Attributes
    ----------
    columns : dict of str
        Its column name by ours (t, x, y, z, rx, ry, rz, or qx, qy, qz, qw).
    length, time, angle : str
        Its units.
    rotation : {'euler', 'rotvec', 'quaternion'}
        What its rotation columns hold; Euler angles are X-Y-Z intrinsic.
    """

    columns: dict[str, str] = field(default_factory=dict)
    length: str = "mm"
    time: str = "s"
    angle: str = "rad"
    rotation: RotationForm = "euler"

    def column(self, ours: str) -> str:
        """Return the table's name for one of our columns."""
        return self.columns.get(ours, ours)

    def as_options(self) -> dict[str, Any]:
        """Return the layout as JSON values, for the provenance of what was read with it."""
        return asdict(self)


LAYOUTS = {
    # Universal Robots RTDE recordings (the csv_writer of its RTDE Python client library).
    "ur": Layout(
        {"t": "timestamp"} | {ours: f"actual_TCP_pose_{i}" for i, ours in enumerate(POSE)},
        length="m",
        rotation="rotvec",
    ),
    # TUM trajectory text with a header line: t x y z qx qy qz qw.
    "tum": Layout(length="m", rotation="quaternion"),
}


def adapted(base: Layout, mapping: Sequence[str], given: Mapping[str, str]) -> Layout:
    """Return a layout with columns and units replaced.

    Parameters
    ----------
    base : Layout
    mapping : sequence of str
        ``OURS=THEIRS`` each.
    given : mapping
        ``length``, ``time``, ``angle`` (units) and ``rotation`` (form).

    Raises
    ------
    InputError
        An entry is not of that form, or names a column, unit or form that there is not.
    """
    columns = dict(base.columns)
    for entry in mapping:
        ours, equals, theirs = entry.partition("=")
        if not equals or not theirs or ours not in _MAPPABLE:
            raise InputError(
                f"--map {entry}: must be OURS=THEIRS, with OURS one of {', '.join(_MAPPABLE)}"
            )
        columns[ours] = theirs
    choices: dict[str, Iterable[str]] = {
        "length": LENGTH,
        "time": TIME,
        "angle": ANGLE,
        "rotation": get_args(RotationForm),
    }
    for key, value in given.items():
        if value not in choices[key]:
            option = "--rotation" if key == "rotation" else f"--{key}-unit"
            raise InputError(f"{option} {value}: must be one of {', '.join(choices[key])}")
    return replace(base, columns=columns, **dict(given))  # type: ignore[arg-type]


def stroke(source: Source, layout: Layout | None = None) -> Stroke:
    """Read a demonstration for learning.

    Parameters
    ----------
    source : Source
        One of our demonstration files, or any CSV or Parquet table.
    layout : Layout, optional
        For a table of another program's.

    Raises
    ------
    InputError
        A column is missing, holds text, NaN or infinity, time repeats or runs backward, or there
        are fewer than `SHORTEST` samples or a long gap; names column and row.
    """
    if layout is None and record.is_ours(source):
        ours = record.decode(source, schemas.DEMONSTRATION)
        _partly_null(ours)
        t, position, rotation = ours.t, ours.position(), ours.rotation()
        table = Table(source.name, ours.columns)
    else:
        if source.content.lstrip()[:1] == b"{":
            raise InputError(
                f"{source.name}: is JSON, not a recording; a recording is CSV or Parquet"
            )
        table = tables.read(source)
        t, position, rotation = _mapped(table, layout or Layout())
    _check_time(table, t, layout or Layout())
    _check_position(table, position)
    return Stroke(t, position, rotation)


def _partly_null(ours: record.Record) -> None:
    for name in EULER_ANGLES:
        if ours.has(name) and np.isnan(ours.columns[name]).any():
            row = int(np.argmax(np.isnan(ours.columns[name])))
            raise InputError(
                f"{ours.name}: column {name!r}, row {row + 1}: no value, but other rows have one; "
                "fill it in or leave the orientation out"
            )


def _mapped(table: Table, layout: Layout) -> tuple[Floats, Floats, Floats | None]:
    t = table.numbers(layout.column("t")) * TIME[layout.time]
    position = np.stack([table.numbers(layout.column(c)) for c in "xyz"], axis=1)
    position *= LENGTH[layout.length]
    names = _QUATERNION if layout.rotation == "quaternion" else EULER_ANGLES
    present = [layout.column(c) in table.columns for c in names]
    if not any(present):
        return t, position, None
    if not all(present):
        missing = layout.column(names[present.index(False)])
        raise InputError(
            f"{table.name}: column {missing!r} is missing, but other rotation columns are there; "
            "map all of them, or none"
        )
    values = np.stack([table.numbers(layout.column(c)) for c in names], axis=1)
    if layout.rotation == "quaternion":
        norm = np.linalg.norm(values, axis=1)
        if np.any(np.abs(norm - 1.0) > 1e-2):
            row = int(np.argmax(np.abs(norm - 1.0)))
            raise InputError(
                f"{table.name}: {table.at(row)}: the quaternion has norm {norm[row]:.3g}, not 1; "
                "check which columns are mapped"
            )
        return t, position, rotations.from_quaternion(values)
    values *= ANGLE[layout.angle]
    if np.abs(values).max() > LARGEST_TURN:
        row = int(np.argmax(np.abs(values).max(axis=1)))
        raise InputError(
            f"{table.name}: {table.at(row)}: an angle of {np.abs(values).max():g} rad; "
            "check the unit of angle (--angle-unit deg)"
        )
    return (
        t,
        position,
        (rotations.exp(values) if layout.rotation == "rotvec" else rotations.from_euler(values)),
    )


def _check_time(table: Table, t: Floats, layout: Layout) -> None:
    if len(t) < SHORTEST:
        raise InputError(f"{table.name}: {len(t)} samples; a stroke needs at least {SHORTEST}")
    steps = np.diff(t)
    if np.any(steps <= 0):
        row = int(np.argmax(steps <= 0)) + 1
        verb = "repeats" if steps[row - 1] == 0 else "runs backward"
        raise InputError(
            f"{table.name}: column {layout.column('t')!r}, {table.at(row)}: time {verb} "
            f"({t[row - 1]:.6g} s, then {t[row]:.6g} s); sort the rows or remove the repeated ones"
        )
    step = float(np.median(steps))
    if t[-1] - t[0] > LONGEST:
        raise InputError(
            f"{table.name}: column {layout.column('t')!r}: spans {t[-1] - t[0]:.3g} s; "
            "check the unit of time (--time-unit)"
        )
    if step < SHORTEST_STEP:
        raise InputError(
            f"{table.name}: column {layout.column('t')!r}: rows are {step:.3g} s apart; "
            "check the unit of time (--time-unit)"
        )
    if np.any(steps > LONGEST_GAP * step):
        row = int(np.argmax(steps)) + 1
        raise InputError(
            f"{table.name}: column {layout.column('t')!r}, {table.at(row)}: nothing was recorded "
            f"for {steps[row - 1]:.6g} s, {steps[row - 1] / step:.0f} samples; cut the file there, "
            "or record again"
        )


def _check_position(table: Table, position: Floats) -> None:
    beyond = np.abs(position).max(axis=1) > FARTHEST
    if beyond.any():
        row = int(np.argmax(beyond))
        raise InputError(
            f"{table.name}: {table.at(row)}: the position is beyond {FARTHEST:g} mm; check the "
            "unit of length (--length-unit)"
        )

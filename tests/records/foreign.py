"""One wave of 110 x 48 mm in 8 s, the tool down and turning, as other programs write it."""

import numpy as np
from scipy.spatial.transform import Rotation

from tests.minimum_jerk import minimum_jerk

T = np.linspace(0.0, 8.0, 201)
_U = T / 8.0
_S = minimum_jerk(_U)
XYZ = np.column_stack([-550 - 110 * _S, 130 + 24 * np.sin(2 * np.pi * _S), -17.5 + 0 * _S])
R = Rotation.from_euler(
    "XYZ", np.column_stack([np.full(T.size, np.pi), 0.4 * np.sin(0.7 * T), 0.9 * np.sin(0.4 * T)])
)
QUATERNION = R.as_quat()
EPOCH = 1_700_000_000
NS = EPOCH * 10**9 + np.round(T * 1e9).astype(np.int64)


def table(head, *columns, sep=",", digits=9):
    """Text of a table: numbers with so many digits, whole numbers and text as they are."""
    cells = [
        [f"{value:.{digits}f}" if np.asarray(column).dtype.kind == "f" else str(value)]
        for column in columns
        for value in column
    ]
    rows = np.array(cells, dtype=object).reshape(len(columns), -1).T
    lines = ([head] if head else []) + [sep.join(row) for row in rows]
    return "\n".join(lines) + "\n"


def motive(bodies=("Pen",), unit="Meters", kind="Quaternion", version="1.23"):
    """An export of Motive with rigid bodies and one marker."""
    rows = {"Type": [], "Name": [], "ID": [], "what": [], "axis": []}
    columns = []
    for number, body in enumerate(bodies):
        for what, axes in (("Rotation", "XYZW"), ("Position", "XYZ")):
            for axis in axes:
                for key, cell in zip(
                    rows, ("Rigid Body", body, f"ID{number}", what, axis), strict=True
                ):
                    rows[key].append(cell)
        columns += [*QUATERNION.T, *((XYZ + 1000 * number) / 1000).T]
    for axis in "XYZ":
        for key, cell in zip(
            rows,
            ("Rigid Body Marker", f"{bodies[0]}:1", "M", "Position", axis),
            strict=True,
        ):
            rows[key].append(cell)
    columns += [*(XYZ / 1000 + 0.01).T]
    head = [
        f"Format Version,{version},Take Name,Take 1,Export Frame Rate,25.000000,"
        f"Rotation Type,{kind},Length Units,{unit},Coordinate Space,Global",
        "",
        *(f",{key}," + ",".join(rows[key]) for key in ("Type", "Name", "ID")),
        ",," + ",".join(rows["what"]),
        "Frame,Time (Seconds)," + ",".join(rows["axis"]),
    ]
    return table("\n".join(head), np.arange(T.size), T, *columns)

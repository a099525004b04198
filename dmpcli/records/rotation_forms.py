"""The forms in which other programs write a rotation, as rotation matrices.

Euler orders are named as scipy names them: capitals turn about the tool's own axes (intrinsic),
small letters about the base's (extrinsic). The turns are scipy's too.
"""

from collections.abc import Mapping, Sequence
from itertools import permutations

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.spatial import rotations

EULER_NAMES = ("rx", "ry", "rz")
QUATERNION_NAMES = ("qx", "qy", "qz", "qw")
MATRIX_NAMES = tuple(f"r{i}{j}" for i in "123" for j in "123")

_TURNS = [
    *("".join(order) for order in permutations("xyz")),
    *(a + b + a for a in "xyz" for b in "xyz" if a != b),
]
ORDERS = (*(order.upper() for order in _TURNS), *_TURNS)
"""All orders of Euler angles: six of three axes, six of two, each intrinsic and extrinsic."""

WORDS = {"euler": "XYZ", "rpy": "xyz"}
"""What the field calls some orders: ours, and roll, pitch, yaw of ROS, URDF, KUKA and Fanuc."""

QUATERNIONS = {"quaternion": "xyzw", "xyzw": "xyzw", "wxyz": "wxyz"}

_UNIT = 1e-2
"""What a quaternion's norm, or a matrix's columns, may miss of 1."""

NUMBERED = (("q0", "q1", "q2", "q3"), ("q1", "q2", "q3", "q4"))

# A step between samples, rad, that no hand makes, and how much smaller another form's must be.
_LEAP, _CALMER = np.radians(20.0), 0.25


def check(form: str) -> None:
    """Refuse a word that names no form of rotation.

    Raises
    ------
    InputError
        Lists the words.
    """
    if form not in (*ORDERS, *WORDS, *QUATERNIONS, "rotvec", "matrix"):
        raise InputError(
            f"--rotation {form}: must be one of euler, rpy, rotvec, quaternion, xyzw, wxyz, matrix,"
            " or an order of Euler angles: XYZ, ZYX, ZYZ, ... intrinsic, xyz, zyx, ... extrinsic"
        )


def columns_of(form: str) -> tuple[str, ...]:
    """Return the names, as ours, of the columns that hold a form."""
    if form in QUATERNIONS:
        return QUATERNION_NAMES
    return MATRIX_NAMES if form == "matrix" else EULER_NAMES


def described(form: str) -> str:
    """Return what a form is, for a message."""
    if form in QUATERNIONS:
        return "unit quaternions"
    if form in ("rotvec", "matrix"):
        return {"rotvec": "rotation vectors", "matrix": "rotation matrices"}[form]
    order = WORDS.get(form, form)
    axes, turn = "-".join(order), "intrinsic" if order.isupper() else "extrinsic (fixed-axis)"
    return f"{axes} {turn} Euler angles"


def matrices(form: str, values: Floats) -> Floats:
    """Rotation matrices of a table's columns.

    Parameters
    ----------
    form : str
    values : array, shape (T, 3), (T, 4) or (T, 9)
        Angles in rad: of an order of three axes always about x, y and z, whatever the order of
        turning; of an order of two axes the first, second and third turn. Quaternions x, y, z, w.
        Matrices row by row.

    Returns
    -------
    array, shape (T, 3, 3)

    Raises
    ------
    InputError
        A quaternion or matrix is not one of a rotation; names the row as ``row N`` from 1.
    """
    if form in QUATERNIONS:
        return rotations.from_quaternion(values)
    if form == "rotvec":
        return rotations.exp(values)
    # Imported late: it takes longer than the rest of reading, and most files do not need it.
    from scipy.spatial.transform import Rotation

    if form == "matrix":
        return Rotation.from_matrix(values.reshape(-1, 3, 3)).as_matrix()
    order = WORDS.get(form, form)
    if order == "XYZ":
        return rotations.from_euler(values)
    if len(set(order)) == 3:
        values = values[:, ["xyz".index(axis) for axis in order.lower()]]
    return Rotation.from_euler(order, values).as_matrix()


def wrong(form: str, values: Floats) -> tuple[int, str] | None:
    """Find the first row that is no rotation of the form.

    Returns
    -------
    int, str
        The row from 0, and what is wrong with it; None where nothing is.
    """
    # What overflows is off, and told as that.
    with np.errstate(over="ignore", invalid="ignore"):
        if form in QUATERNIONS:
            norm = np.linalg.norm(values, axis=1)
            off = ~(np.abs(norm - 1.0) <= _UNIT)
            row = int(np.argmax(off))
            return (row, f"the quaternion has norm {norm[row]:.3g}, not 1") if off.any() else None
        if form == "matrix":
            R = values.reshape(-1, 3, 3)
            excess = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2))
            off = ~((excess <= _UNIT) & (np.linalg.det(R) > 0.0))
            return (int(np.argmax(off)), "is no rotation matrix") if off.any() else None
    return None


def numbered(form: str, names: Sequence[str]) -> Mapping[str, str]:
    """Return which of q0 ... q3 or q1 ... q4 are qx, qy, qz and qw.

    Raises
    ------
    InputError
        They are there, and the form does not tell their order.
    """
    for group in NUMBERED:
        if all(name in names for name in group):
            if form == "quaternion":
                raise InputError(
                    f"columns {', '.join(group)} hold a quaternion in an order that they do not "
                    "tell; say --rotation wxyz (ABB, Eigen's constructor) or --rotation xyzw"
                )
            return {f"q{axis}": name for axis, name in zip(form, group, strict=True)}
    return {}


def calmer(values: Floats, R: Floats) -> str | None:
    """Tell a form in which angles taken for X-Y-Z ones do not leap between samples.

    Parameters
    ----------
    values : array, shape (T, 3)
        rad.
    R : array, shape (T, 3, 3)
        What they are as X-Y-Z ones.

    Returns
    -------
    str or None
        None where they do not leap, or nothing else fits better.
    """

    def leap(R: Floats) -> float:
        trace = np.einsum("tij,tij->t", R[1:], R[:-1])
        return float(np.arccos(np.clip((trace.min() - 1.0) / 2.0, -1.0, 1.0)))

    if len(values) < 2:
        return None
    largest = leap(R)
    if largest < _LEAP:
        return None
    return next(
        (f for f in ("rotvec", "rpy") if leap(matrices(f, values)) < _CALMER * largest), None
    )


def lean(R: Floats) -> float:
    """Angle between the tool's axis R e_z and base -z, degrees, of one rotation (3, 3)."""
    sine = float(np.hypot(R[0, 2], R[1, 2]))
    return float(np.degrees(np.arctan2(sine, -R[2, 2])))

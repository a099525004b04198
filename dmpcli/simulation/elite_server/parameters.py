"""How the EC66's JSON-RPC puts numbers: degrees for joints, mm and Euler angles for poses."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import from_euler, to_euler, to_euler_one

Euler = Literal["xyz", "zyx"]
"""Which rx, ry, rz a controller means: R = Rx(rx) Ry(ry) Rz(rz), or R = Rz(rz) Ry(ry) Rx(rx)."""

PARSE, NO_METHOD, BAD_PARAMS, FAILED, NOT_REMOTE = -32700, -32601, -32602, -32603, -32693
"""Error codes; the last is the controller's own, the others are JSON-RPC 2.0's."""


class RpcError(Exception):
    """What is answered as an error.

    Attributes
    ----------
    code : int
    message : str
    """

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code, self.message = code, message


class Params:
    """The parameters of one request.

    Parameters
    ----------
    given : mapping
        By name.
    """

    def __init__(self, given: Mapping[str, Any]) -> None:
        self._given = given

    def has(self, name: str) -> bool:
        """Tell whether a parameter is given."""
        return name in self._given

    def number(self, name: str, low: float, high: float, otherwise: float | None = None) -> float:
        """Return a number within a range; without `otherwise` it must be given.

        Parameters
        ----------
        name : str
        low, high : float
            Both allowed, in the unit of the parameter.
        otherwise : float, optional
            What it means that it is absent; it must lie within the range too.

        Raises
        ------
        RpcError
            ``BAD_PARAMS``: absent, no number, or out of range.
        """
        value = self._given.get(name, otherwise)
        if not _is_number(value) or not low <= value <= high:
            raise RpcError(BAD_PARAMS, f"{name}: a number from {low:g} to {high:g} is needed")
        return float(value)

    def choice(self, name: str, choices: tuple[int, ...], otherwise: int | None = None) -> int:
        """Return a whole number out of some.

        Parameters
        ----------
        name : str
        choices : tuple of int
            A number with a fraction of 0 is taken for a whole one.
        otherwise : int, optional
            What it means that it is absent; without it it must be given.

        Raises
        ------
        RpcError
            ``BAD_PARAMS``: absent, no number, or none of them.
        """
        value = self._given.get(name, otherwise)
        if not _is_number(value) or value not in choices:
            raise RpcError(BAD_PARAMS, f"{name}: one of {', '.join(map(str, choices))} is needed")
        return int(value)

    def joints(self, name: str) -> Floats:
        """Return six joint angles, rad, from six or eight in degrees.

        Raises
        ------
        RpcError
        """
        return np.radians(self._row(name, (6, 8))[:6])

    def pose(self, name: str, degrees: bool, euler: Euler) -> Pose:
        """Return a pose of a position in mm and three angles.

        Parameters
        ----------
        name : str
        degrees : bool
            Whether the request's angles are in degrees; else in rad.
        euler : {'xyz', 'zyx'}
            What they mean, see `Euler`.

        Raises
        ------
        RpcError
            ``BAD_PARAMS``: it is not six numbers.
        """
        row = self._row(name, (6,))
        angles = np.radians(row[3:]) if degrees else row[3:]
        return Pose(row[:3], matrix(angles, euler))

    def _row(self, name: str, lengths: tuple[int, ...]) -> Floats:
        row = self._given.get(name)
        if not isinstance(row, list) or len(row) not in lengths or not all(map(_is_number, row)):
            raise RpcError(BAD_PARAMS, f"{name}: {lengths[0]} numbers are needed")
        return np.array(row, dtype=float)


def _is_number(value: object) -> bool:
    # Whole numbers of JSON have no bound; those beyond any sense are none.
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    return plain and -1e12 <= value <= 1e12  # type: ignore[operator]


def matrix(angles: Floats, euler: Euler) -> Floats:
    """Rotation matrix of three angles, rad."""
    # Rz(c) Ry(b) Rx(a) is the inverse of Rx(-a) Ry(-b) Rz(-c).
    return from_euler(angles) if euler == "xyz" else from_euler(-angles).T


def angles(rotation: Floats, euler: Euler) -> Floats:
    """Three angles of each rotation matrix, rad; shapes (..., 3, 3) and (..., 3)."""
    return to_euler(rotation) if euler == "xyz" else -to_euler(np.swapaxes(rotation, -1, -2))


def pose_row(position: Floats, rotation: Floats, euler: Euler, degrees: bool = False) -> Floats:
    """Each pose as six numbers: mm, and rad or degrees; shape (..., 6).

    Parameters
    ----------
    position, rotation : array, shape (..., 3) and (..., 3, 3)
        mm.
    euler : {'xyz', 'zyx'}
        Which angles, see `Euler`.
    degrees : bool
        Whether the angles are in degrees.
    """
    turned = angles(rotation, euler)
    return np.concatenate([position, np.degrees(turned) if degrees else turned], axis=-1)


def pose_numbers(position: Floats, rotation: Floats, euler: Euler) -> list[float]:
    """`pose_row` of one pose in mm and rad, in plain floats: for what is sent every 8 ms.

    Parameters
    ----------
    position, rotation : array, shape (3,) and (3, 3)
        mm.
    euler : {'xyz', 'zyx'}
        Which angles, see `Euler`.

    Returns
    -------
    list of float, length 6
    """
    if euler == "xyz":
        return [*position.tolist(), *to_euler_one(rotation)]
    return [*position.tolist(), *(-angle for angle in to_euler_one(rotation.T))]

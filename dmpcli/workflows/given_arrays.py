"""Arrays that a caller gives: read as real numbers of the shape that is meant, or refused."""

import numbers
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.records import rotation_forms

_REAL = "iuf"
_HINTS = {
    (4,): "matrices of quaternions are scipy's Rotation.from_quat(q).as_matrix()",
    (3,): "matrices of angles are scipy's Rotation.from_euler(order, angles).as_matrix()",
    (9,): "reshape(-1, 3, 3) makes matrices of rows of nine",
}


def real(name: str, given: Any) -> Floats:
    """Return an array of real numbers, whatever its shape.

    Parameters
    ----------
    name : str
        What messages call it.
    given : array_like
        Of integers or floats; what is masked counts as missing, NaN.

    Raises
    ------
    InputError
        It holds other things: text, times of day, complex numbers, rows of different lengths.
    """
    if isinstance(given, np.ma.MaskedArray) and given.dtype.kind in _REAL:
        return np.asarray(np.ma.filled(given.astype(float), np.nan))
    try:
        found = np.asarray(given)
        if found.dtype.kind == "O" and all(isinstance(one, numbers.Real) for one in found.flat):
            found = found.astype(float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: is no array of numbers; its rows differ in length") from None
    if found.dtype.kind not in _REAL:
        raise InputError(f"{name}: holds {found.dtype}, where real numbers are needed")
    return found.astype(float, copy=False)


def rotations(name: str, given: Any, lead: tuple[int, ...]) -> Floats:
    """Return rotation matrices, lead and then (3, 3); what is NaN stays.

    Parameters
    ----------
    name : str
    given : array_like
    lead : tuple of int
        Shape before the matrices' own.

    Raises
    ------
    InputError
        It has another shape, or one is no rotation: a column's length is not 1, two are not at
        right angles, or it mirrors.
    """
    R = real(name, given)
    if R.shape != (*lead, 3, 3):
        hint = _HINTS.get(R.shape[len(lead) :]) if R.shape[: len(lead)] == lead else None
        told = f"; {hint}" if hint else ""
        raise InputError(f"{name}: shape {R.shape} is not {(*lead, 3, 3)}{told}")
    rows = R.reshape(-1, 9)
    known = np.flatnonzero(~np.isnan(rows).any(axis=1))
    wrong = rotation_forms.wrong("matrix", rows[known])
    if wrong is not None:
        row, what = int(known[wrong[0]]), wrong[1]
        where = f"[{', '.join(map(str, np.unravel_index(row, lead)))}]" if lead else ""
        raise InputError(f"{name}{where}: {what}")
    return R

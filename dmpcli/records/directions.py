"""Points and directions that people write into files: checked, and named where they are wrong."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.records.columns import FARTHEST
from dmpcli.records.file_io import Source


def near(source: Source, field: str, numbers: list[float]) -> Floats:
    """Return a point, shape (3,), mm.

    Parameters
    ----------
    source : Source
    field : str
        What messages call the point: its name in the file.
    numbers : list of float, length 3
        Finite, in mm.

    Raises
    ------
    InputError
        It is beyond `FARTHEST` along some axis.
    """
    point = np.array(numbers, dtype=float)
    if np.abs(point).max() > FARTHEST:
        raise InputError(f"{source.name}: {field}: is beyond {FARTHEST:g} mm; check its unit")
    return point


def unit(source: Source, field: str, numbers: list[float], purpose: str) -> Floats:
    """Return a direction of any length as a unit vector, shape (3,).

    Parameters
    ----------
    source : Source
    field : str
        What messages call the direction: its name in the file.
    numbers : list of float, length 3
        Finite, in any unit.
    purpose : str
        What the direction must do, in the words of a message: ``point off the plane``.

    Raises
    ------
    InputError
        It is zero.
    """
    direction = np.array(numbers, dtype=float)
    largest = np.abs(direction).max()
    if largest == 0.0:
        raise InputError(f"{source.name}: {field}: is zero; it must {purpose}")
    direction = direction / largest  # so that squares neither overflow nor vanish
    return np.asarray(direction / np.linalg.norm(direction))

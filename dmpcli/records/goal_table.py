"""Goals over time, as ``execute --goal-from FILE`` reads them."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.records import tables
from dmpcli.records.file_io import Source
from dmpcli.records.schemas import EULER_ANGLES, POSITION
from dmpcli.records.untrusted import decoder


@decoder
def read(source: Source) -> tuple[Floats, Floats]:
    """Read a table with ``t`` in s since the stroke's first set-point, and ``x y z`` in mm.

    Returns
    -------
    t : array, shape (n,)
        Not decreasing.
    goals : array, shape (n, 3)

    Raises
    ------
    InputError
        It cannot be read, lacks a column or a row, holds what is no finite number, goes back in
        time, or states angles, which no goal has.
    """
    table = tables.read(source)
    turned = [name for name in EULER_ANGLES if name in table.columns]
    if turned:
        raise InputError(
            f"{source.name}: column {turned[0]!r}: a goal that moves turns no tool, which is held "
            "as planned; leave the angles out"
        )
    t = table.numbers("t")
    goals = np.stack([table.numbers(name) for name in POSITION], axis=1)
    if not len(t):
        raise InputError(f"{source.name}: has no row; a row says when the goal moves where")
    back = np.flatnonzero(np.diff(t) < 0.0)
    if len(back):
        raise InputError(
            f"{source.name}: {table.at(int(back[0]) + 1)}: t goes back; sort the rows by t"
        )
    return t, goals

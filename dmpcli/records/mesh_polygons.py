"""Faces as mesh files list them, of any number of corners, made into triangles and judged."""

from typing import NamedTuple

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.errors import InputError, counted
from dmpcli.records import columns

LARGEST = 4_000_000
"""Triangles. Mending so many takes 4 GiB of memory."""


class Triangles(NamedTuple):
    """Triangles as they stand in a file.

    Attributes
    ----------
    V : array, shape (n, 3)
        In the file's unit.
    F : array, shape (m, 3)
        Indices into V, not checked yet.
    remarks : list of str
        What the reader passed over, or is unsure of.
    """

    V: Floats
    F: Integers
    remarks: list[str]


def judge(name: str, faces: int) -> None:
    """Refuse more faces than memory serves, before any is taken for them.

    Raises
    ------
    InputError
        With the number, and what to do.
    """
    if faces > LARGEST:
        raise InputError(
            f"{name}: holds {faces:,} triangles, more than the {LARGEST:,} that memory is kept "
            "for; cut out the region to draw on, or simplify the mesh"
        )


def cut(name: str, V: Floats, corners: Integers, counts: Integers) -> Triangles:
    """Cut faces into triangles; see `polygons.cut`.

    Parameters
    ----------
    name : str
        Of the file.
    V : array, shape (n, 3)
    corners : array, shape (k,)
        Indices into V, of one face after the other.
    counts : array, shape (p,)
        Corners of each face.

    Raises
    ------
    InputError
        Too many of them, a corner out of range, or a face too large to be cut; by name.
    """
    judge(name, int(np.maximum(counts - 2, 0).sum()))
    if len(counts) and counts.min() == counts.max() == 3:
        return Triangles(V, corners.reshape(-1, 3), [])
    from dmpcli.surfaces import polygons

    remarks = []
    number = np.flatnonzero(counts >= 3)
    if len(number) < len(counts):
        few = len(counts) - len(number)
        remarks.append(f"{counted(few, 'face')} of fewer than three corners left out")
        corners, counts = corners[np.repeat(counts >= 3, counts)], counts[number]
    wrong = (corners < 0) | (corners >= len(V))
    if wrong.any():
        at = int(np.argmax(wrong))
        face = number[np.searchsorted(np.cumsum(counts), at, side="right")]
        raise InputError(
            f"{name}: face {face + 1} names vertex {corners[at] + 1}, but there are {len(V)}; "
            "export the part again"
        )
    # Corners that are no places are named where the mesh is mended.
    placed = np.where(np.abs(V) <= columns.LARGEST, V, 0.0)
    large = polygons.too_large(placed, corners, counts)
    if large is not None:
        raise InputError(
            f"{name}: face {number[large] + 1} has {counts[large]:,} corners and notches: more "
            f"than {polygons.LARGEST:,} are not cut into triangles; export the part as triangles"
        )
    found = polygons.cut(placed, corners, counts)
    if len(found.crossed):
        are = "polygon crosses its" if len(found.crossed) == 1 else "polygons cross their"
        remarks.append(
            f"{len(found.crossed)} {are} own outline, the first is face "
            f"{number[found.crossed[0]] + 1}: what lies in it is a guess"
        )
    return Triangles(V, found.F, remarks)

"""Sorting whole numbers with their places in them: several times as fast as argsort."""

import numpy as np

from dmpcli.arrays import Integers


def sorted_with_order(keys: Integers) -> tuple[Integers, Integers]:
    """Sort whole numbers, equal ones in the order in which they stand.

    Parameters
    ----------
    keys : array of int, shape (n,)
        None below zero.

    Returns
    -------
    keys, order : array of int, shape (n,)
        Sorted, and where each stood.
    """
    room = len(keys).bit_length()
    if len(keys) and int(keys.max()) >> (63 - room):
        order = np.argsort(keys, kind="stable")
        return keys[order], order
    # Each number with its place behind it is a number of its own: nothing is equal any more.
    packed = (keys << room) | np.arange(len(keys))
    packed.sort()
    return packed >> room, packed & ((1 << room) - 1)

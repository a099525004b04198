"""Points at exactly the same place, told apart by one number made of their coordinates."""

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces.integer_sort import sorted_with_order

# Odd numbers whose multiples, modulo 2^64, spread over all bits (S. Vigna: SplitMix64).
_SPREAD = (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB)
_SHIFT = 31


def distinct(V: Floats) -> tuple[Integers, Integers]:
    """Find the distinct ones of points.

    Parameters
    ----------
    V : array, shape (n, 3)
        Finite.

    Returns
    -------
    first : array of int, shape (k,)
        Where each place stands first, in the order of z, then y, then x.
    number : array of int, shape (n,)
        Which of these places each point has.
    """
    n = len(V)
    keys, order = sorted_with_order(_mixed(V, 63 - n.bit_length()))
    twin = _first_of_equals(keys[1:] != keys[:-1], order)
    # What is looked up follows the points, as neighbours stand near each other in most files.
    if (V[twin] != V).any():  # two places with one number: hardly ever
        order = np.lexsort(V.T)
        twin = _first_of_equals((V[order][1:] != V[order][:-1]).any(axis=1), order)
    first = np.flatnonzero(twin == np.arange(n))
    first = first[np.lexsort(V[first].T)]
    place = np.empty(n, dtype=np.int64)
    place[first] = np.arange(len(first))
    return first, place[twin]


def _first_of_equals(change: Booleans, order: Integers) -> Integers:
    """Where the first thing equal to each stands, shape (n,), by where an order (n,) changes."""
    starts = np.append(True, change)[: len(order)]
    first = np.empty_like(order)
    first[order] = order[starts][np.cumsum(starts) - 1]
    return first


def _mixed(V: Floats, bits: int) -> Integers:
    """Whole numbers of so many bits, one and the same for points at one place."""
    # Zero has two signs, but is one place.
    x, y, z = (V.T + 0.0).view(np.uint64)
    mixed = x * np.uint64(_SPREAD[0])
    for more, factor in ((y, _SPREAD[1]), (z, _SPREAD[2])):
        mixed ^= mixed >> np.uint64(_SHIFT)
        mixed += more
        mixed *= np.uint64(factor)
    return np.asarray(mixed >> np.uint64(64 - bits), dtype=np.int64)

"""Which facet lies where in the search tree of kernels.

The tree halves the facets at the median of their middles, along the longest side of their box, so
it needs no pointers: node i has the children 2i + 1 and 2i + 2.
"""

from typing import NamedTuple

import numpy as np

from dmpcli.arrays import Floats, Halves, Singles
from dmpcli.compiled import kernel

_LEAF = 4


@kernel
def _select(order: Halves, keys: Floats, low: int, high: int, middle: int) -> None:
    """Part order[low:high] so that no key before `middle` is larger than one from there on."""
    high -= 1
    while low < high:
        # The median of three, so that sorted facets are halved too.
        a, b, c = keys[order[low]], keys[order[(low + high) // 2]], keys[order[high]]
        pivot = max(min(a, b), min(max(a, b), c))
        i, j = low, high
        while i <= j:
            while keys[order[i]] < pivot:
                i += 1
            while keys[order[j]] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@kernel
def ordered(corners: Floats, depth: int) -> tuple[Halves, Halves]:
    """Order of the facets (m, 3, 3) in a tree of so many levels below its root, and its leaves."""
    m = len(corners)
    middles = np.empty((3, m))
    for k in range(3):
        for i in range(m):
            middles[k, i] = corners[i, 0, k] + corners[i, 1, k] + corners[i, 2, k]
    order = np.arange(m).astype(np.int32)
    bounds = np.empty(2, dtype=np.int32)
    bounds[0], bounds[1] = 0, m
    for _ in range(depth):
        finer = np.empty(2 * len(bounds) - 1, dtype=np.int32)
        for i in range(len(bounds) - 1):
            low, high = bounds[i], bounds[i + 1]
            half = (low + high) // 2
            axis, widest = 0, -1.0
            for k in range(3):
                least, most = np.inf, -np.inf
                for j in range(low, high):
                    least = min(least, middles[k, order[j]])
                    most = max(most, middles[k, order[j]])
                if most - least > widest:
                    axis, widest = k, most - least
            if high - low > 1:
                _select(order, middles[axis], low, high, half)
            finer[2 * i], finer[2 * i + 1] = low, half
        finer[-1] = m
        bounds = finer
    return order, bounds


def depth_of(count: int) -> int:
    """Levels below the root, so that leaves hold `_LEAF` facets or less."""
    depth = 0
    while count > _LEAF << depth:
        depth += 1
    return depth


class TreeOrder(NamedTuple):
    """Which facets lie where: `order` (m,), and where the leaves begin, `first` (leaves + 1,)."""

    order: Halves
    first: Halves

    @classmethod
    def of(cls, corners: Floats) -> "TreeOrder":
        """Sort facets (m, 3, 3) into a tree."""
        return cls(*ordered(corners, depth_of(len(corners))))


@kernel
def boxes_of(reals: Floats, first: Halves) -> Singles:
    """Boxes of all nodes, rounded outwards to single precision."""
    leaves = len(first) - 1
    boxes = np.empty((2 * leaves - 1, 6), dtype=np.float32)
    for leaf in range(leaves):
        box = boxes[leaves - 1 + leaf]
        for k in range(3):
            least, most = np.inf, -np.inf
            for i in range(first[leaf], first[leaf + 1]):
                a, b, c = reals[i, k], reals[i, 3 + k], reals[i, 6 + k]
                least, most = min(least, a, b, c), max(most, a, b, c)
            box[k] = np.nextafter(np.float32(least), np.float32(-np.inf))
            box[3 + k] = np.nextafter(np.float32(most), np.float32(np.inf))
    for node in range(leaves - 2, -1, -1):
        for k in range(3):
            boxes[node, k] = min(boxes[2 * node + 1, k], boxes[2 * node + 2, k])
            boxes[node, 3 + k] = max(boxes[2 * node + 1, 3 + k], boxes[2 * node + 2, 3 + k])
    return boxes

"""`dmpcli.spatial.vectors` of single vectors, as tuples, to be compiled."""

import math

from dmpcli.arrays import Floats
from dmpcli.compiled import kernel

Vector = tuple[float, float, float]


@kernel
def at(a: Floats, row: int) -> Vector:
    """Row of vectors (N, 3)."""
    return a[row, 0], a[row, 1], a[row, 2]


@kernel
def put(a: Floats, row: int, v: Vector) -> None:
    """Set a row of vectors (N, 3).

    Parameters
    ----------
    a : array, shape (N, 3)
        Overwritten there.
    row : int
    v : tuple of float
    """
    a[row, 0], a[row, 1], a[row, 2] = v


@kernel
def add(a: Vector, b: Vector) -> Vector:
    """Sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@kernel
def sub(a: Vector, b: Vector) -> Vector:
    """Difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@kernel
def times(k: float, a: Vector) -> Vector:
    """Multiple."""
    return k * a[0], k * a[1], k * a[2]


@kernel
def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@kernel
def length(a: Vector) -> float:
    """Length."""
    return math.sqrt(dot(a, a))


@kernel
def unit(a: Vector) -> Vector:
    """Scaled to length 1; the zero vector stays zero."""
    size = length(a)
    if size > 0.0:
        return a[0] / size, a[1] / size, a[2] / size
    return a


@kernel
def across(a: Vector, normal: Vector) -> Vector:
    """Part square to a unit vector, scaled to length 1."""
    return unit(sub(a, times(dot(a, normal), normal)))


@kernel
def turned(a: Vector, before: Vector, after: Vector) -> Vector:
    """Turn by the smallest rotation from `before` to `after`.

    Parameters
    ----------
    a : tuple of float
        In any unit.
    before, after : tuple of float
        Unit vectors; where they are opposite the result is finite but meaningless.
    """
    both = add(before, after)
    scale = 2.0 / max(dot(both, both), 1e-12)
    image = sub(a, times(scale * dot(a, both), both))
    return sub(image, times(2.0 * dot(image, after), after))

"""Products of stacks of 3-vectors, in plain arithmetic: faster than numpy's general routines."""

import numpy as np

from dmpcli.arrays import Floats


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar products of vectors (..., 3), shape (..., 1)."""
    product: Floats = np.einsum("...i,...i->...", a, b)[..., None]
    return product


def cross(a: Floats, b: Floats) -> Floats:
    """Vector products of vectors (..., 3)."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    x = ay * bz - az * by
    product = np.empty((*x.shape, 3))
    product[..., 0], product[..., 1], product[..., 2] = x, az * bx - ax * bz, ax * by - ay * bx
    return product


def length(a: Floats) -> Floats:
    """Lengths of vectors (..., 3), shape (..., 1)."""
    return np.sqrt(dot(a, a))


def unit(a: Floats) -> Floats:
    """Vectors (..., 3) scaled to length 1; the zero vector stays zero."""
    size = length(a)
    scaled: Floats = a / np.where(size > 0.0, size, 1.0)
    return scaled


def across(a: Floats, normal: Floats) -> Floats:
    """Part of vectors (..., 3) square to unit vectors, scaled to length 1."""
    return unit(a - dot(a, normal) * normal)


def turned(a: Floats, before: Floats, after: Floats) -> Floats:
    """Turn vectors (..., 3) by the smallest rotation from unit vectors `before` to `after`.

    For a tangent vector this is parallel transport along the great circle from one normal to the
    other. Undefined where the normals are opposite: the result is then finite but meaningless.

    Parameters
    ----------
    a : array, shape (..., 3)
        In any unit, which the result keeps.
    before, after : array, shape (..., 3)
        Of length 1, in the axes of `a`.
    """
    both = before + after
    scale = 2.0 / np.maximum(dot(both, both), 1e-12)
    # A product of two reflections: in the plane across before + after, then in that of `after`.
    image = a - scale * dot(a, both) * both
    result: Floats = image - 2.0 * dot(image, after) * after
    return result


def any_tangent(normal: Floats) -> Floats:
    """Unit vectors square to unit normals (..., 3): base x, or y where x is nearly normal."""
    x, y = np.eye(3)[0], np.eye(3)[1]
    return across(np.where(np.abs(normal[..., :1]) > 0.9, y, x), normal)

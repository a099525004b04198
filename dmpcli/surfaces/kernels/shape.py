"""What a mesh says of the surface behind it: kernels go over its faces once where numpy does often.

Each number comes of the same operations in the same order as numpy has them; see `CompiledShape`.
"""

import math

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.compiled import kernel
from dmpcli.surfaces.chordal_error import UNEVEN
from dmpcli.surfaces.kernels.vectors import Vector, at, cross, put, sub, times

_DEGREES, _RADIANS = 180.0 / math.pi, math.pi / 180.0


@kernel
def _dot(a: Vector, b: Vector) -> float:
    # As numpy sums three products.
    return (a[0] * b[0] + a[2] * b[2]) + a[1] * b[1]


@kernel
def _length(a: Vector) -> float:
    return math.sqrt(_dot(a, a))


@kernel
def _unit(a: Vector) -> Vector:
    size = _length(a)
    if size > 0.0:
        return a[0] / size, a[1] / size, a[2] / size
    return a


@kernel
def _angle(a: Vector, b: Vector) -> float:
    """Between unit vectors, rad."""
    return math.acos(min(max(_dot(a, b), -1.0), 1.0))


@kernel
def face_normals(corners: Floats) -> Floats:
    """Unit normals (m, 3) of facets (m, 3, 3)."""
    normals = np.empty((len(corners), 3))
    for i in range(len(corners)):
        a, b, c = at(corners[i], 0), at(corners[i], 1), at(corners[i], 2)
        put(normals, i, _unit(cross(sub(b, a), sub(c, a))))
    return normals


@kernel
def dihedrals(normals: Floats, neighbours: Integers) -> Floats:
    """Angles (m, 3) between facets with these normals (m, 3) and neighbours (m, 3), degrees."""
    angles = np.empty((len(normals), 3))
    for i in range(len(normals)):
        n = at(normals, i)
        for k in range(3):
            across = neighbours[i, k]
            if across >= 0:
                angles[i, k] = _angle(n, at(normals, across)) * _DEGREES
            else:
                angles[i, k] = 0.0 if across == -1 else 180.0
    return angles


@kernel
def tilted(
    flat: Floats, normals: Floats, faces: Integers, angles: Floats, least: float, limit: float
) -> bool:
    """Tell whether any facet is tilted enough to be of noise; see `mesh_noise.noise`."""
    for i in range(len(faces)):
        between = (angles[i, 0] + angles[i, 1] + angles[i, 2]) / 3.0 * _RADIANS
        if between <= least:
            continue
        x = y = z = 0.0
        for k in range(3):
            n = at(normals, faces[i, k])
            x, y, z = x + n[0], y + n[1], z + n[2]
        tilt = math.asin(min(_length(cross(at(flat, i), _unit((x, y, z)))), 1.0))
        if min(tilt / max(between, 1e-9), 1.0) >= limit:
            return True
    return False


@kernel
def leaning_back(
    normals: Floats,
    flat: Floats,
    angles: Floats,
    noise: Floats,
    leaning: float,
    times_bent: float,
    most: float,
) -> Floats:
    """Normals (m, 3, 3) at corners, none too far off its facet; see `MeshShape.corner_normals`."""
    found = np.empty_like(normals)
    cosine, sine = math.cos(most), math.sin(most)
    for i in range(len(normals)):
        n = at(flat, i)
        for k in range(3):
            own = _unit(at(normals[i], k))
            if noise[i] == 0.0:
                along = _dot(own, n)
                bent = max(angles[i, k], angles[i, k - 1])
                lean = math.acos(min(max(along, -1.0), 1.0)) * _DEGREES
                if lean > leaning + times_bent * bent:
                    own = n
                elif along < cosine:
                    side = _unit(sub(own, times(along, n)))
                    own = (
                        cosine * n[0] + sine * side[0],
                        cosine * n[1] + sine * side[1],
                        cosine * n[2] + sine * side[2],
                    )
            put(found[i], k, own)
    return found


@kernel
def leans(normals: Floats, faces: Integers, flat: Floats, least: float) -> bool:
    """Tell whether a facet leans off a mean normal at one of its vertices; cosine `least`."""
    for i in range(len(faces)):
        n = at(flat, i)
        for k in range(3):
            if _dot(at(normals, faces[i, k]), n) < least:
                return True
    return False


@kernel
def heights(
    corners: Floats,
    normals: Floats,
    faces: Integers,
    after: Integers,
    angles: Floats,
    crease: float,
) -> Floats:
    """Chordal errors (m,), mm, with normals at vertices (n, 3); see `chordal_error.heights`."""
    m = len(faces)
    area, worst = np.empty(m), np.empty(m)
    for i in range(m):
        a, b, c = at(corners[i], 0), at(corners[i], 1), at(corners[i], 2)
        area[i] = _length(cross(sub(b, a), sub(c, b)))
    for i in range(m):
        most = total = largest = 0.0
        for k in range(3):
            following = (k + 1) % 3
            edge = sub(at(corners[i], following), at(corners[i], k))
            turn = sub(at(normals, faces[i, following]), at(normals, faces[i, k]))
            sagitta = _dot(edge, turn) / 8.0
            most, total = max(most, abs(sagitta)), total + sagitta
            angle, across = angles[i, k] * _RADIANS, after[i, k]
            if across >= 0 and angle < crease:
                width = min(area[i], area[across]) / _length(edge)
                largest = max(largest, width * angle / 8.0)
        most = max(most, abs(total) * (4.0 / 9.0))
        worst[i] = min(most, UNEVEN * largest)
    return worst


@kernel
def reach(faces: Integers, heights: Floats, noise: Floats, vertices: int, least: float) -> Floats:
    """Largest distance of a smooth course (m,), mm; see `MeshShape.reach`."""
    highest = np.zeros(vertices)
    for i in range(len(faces)):
        for k in range(3):
            highest[faces[i, k]] = max(highest[faces[i, k]], heights[i])
    found = np.empty(len(faces))
    for i in range(len(faces)):
        a, b, c = highest[faces[i, 0]], highest[faces[i, 1]], highest[faces[i, 2]]
        found[i] = max(least, 5.0 * max(a, b, c), 6.0 * noise[i])
    return found

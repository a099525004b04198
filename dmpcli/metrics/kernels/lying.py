"""How strokes lie on a surface, compiled: heights, tilts, lengths, distances."""

import math

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.compiled import kernel


@kernel
def tilts(rx: Floats, ry: Floats, normal: Floats, most: Floats, mean: Floats) -> None:
    """Fill in the largest and the mean tilt (B,) of tools, rad, see `many_on_surface.tilts`.

    Parameters
    ----------
    rx, ry : array, shape (B, n)
        First two of the X-Y-Z Euler angles, rad: the third does not turn the tool's axis.
    normal : array, shape (B, n, 3) or (B, 1, 3)
        On the tool's side.
    """
    one = normal.shape[1] == 1
    for b in range(len(rx)):
        total, largest, angle = 0.0, 0.0, 0.0
        x, y, z = 0.0, 0.0, 0.0
        for i in range(rx.shape[1]):
            same = i > 0 and rx[b, i] == rx[b, i - 1] and ry[b, i] == ry[b, i - 1]
            if not same:
                cosine = math.cos(ry[b, i])
                x, y = -math.sin(ry[b, i]), math.sin(rx[b, i]) * cosine
                z = -math.cos(rx[b, i]) * cosine
            if not (same and one):
                k = 0 if one else i
                nx, ny, nz = normal[b, k, 0], normal[b, k, 1], normal[b, k, 2]
                cx, cy, cz = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
                across = math.sqrt(cx * cx + cy * cy + cz * cz)
                angle = math.atan2(across, x * nx + y * ny + z * nz)
            total += angle
            largest = max(largest, angle)
        most[b], mean[b] = largest, total / rx.shape[1]


@kernel
def over_plane(
    position: Floats, point: Floats, normal: Floats, sign: Floats, height: Floats, length: Floats
) -> None:
    """Fill in heights over a plane on the tool's side, and lengths of the feet, mm.

    Parameters
    ----------
    position : array, shape (3, B, n)
        mm.
    point, normal : array, shape (3,)
        Of the plane, mm; of length 1.
    sign : array, shape (B,)
        Turns the normal to each stroke's side.
    height, length : array, shape (B, n) and (B,)
        Filled in, mm.
    """
    nx, ny, nz = normal[0], normal[1], normal[2]
    for b in range(position.shape[1]):
        total, fx, fy, fz = 0.0, 0.0, 0.0, 0.0
        for i in range(position.shape[2]):
            x, y, z = position[0, b, i], position[1, b, i], position[2, b, i]
            up = (x - point[0]) * nx + (y - point[1]) * ny + (z - point[2]) * nz
            height[b, i] = sign[b] * up
            x, y, z = x - up * nx, y - up * ny, z - up * nz
            if i > 0:
                dx, dy, dz = x - fx, y - fy, z - fz
                total += math.sqrt(dx * dx + dy * dy + dz * dz)
            fx, fy, fz = x, y, z
        length[b] = total


@kernel
def spreads(height: Floats, off: Floats, most: Floats, rms: Floats) -> None:
    """Fill in the largest and the RMS of what heights differ by from those meant.

    Parameters
    ----------
    height, off : array, shape (B, n)
        As drawn, and as meant, mm.
    most, rms : array, shape (B,)
        Filled in, mm.
    """
    for b in range(len(height)):
        total, largest = 0.0, 0.0
        for i in range(height.shape[1]):
            away = abs(height[b, i] - off[b, i])
            total += away * away
            largest = max(largest, away)
        most[b], rms[b] = largest, math.sqrt(total / height.shape[1])


@kernel
def over_feet(
    position: Floats, foot: Floats, normal: Floats, height: Floats, length: Floats
) -> None:
    """Fill in signed heights of positions over their feet, and lengths of the feet's paths.

    As `many_on_surface.heights` and `path_lengths`.

    Parameters
    ----------
    position, foot, normal : array, shape (B, n, 3)
        mm; unit normals at the feet, which tell the sign.
    height, length : array, shape (B, n) and (B,)
        Filled in, mm; heights below 0 lie against the normal.
    """
    for b in range(len(position)):
        total = 0.0
        for i in range(position.shape[1]):
            x = position[b, i, 0] - foot[b, i, 0]
            y = position[b, i, 1] - foot[b, i, 1]
            z = position[b, i, 2] - foot[b, i, 2]
            up = x * normal[b, i, 0] + y * normal[b, i, 1] + z * normal[b, i, 2]
            size = math.sqrt(x * x + y * y + z * z)
            height[b, i] = -size if up < 0.0 else size
            if i > 0:
                x = foot[b, i, 0] - foot[b, i - 1, 0]
                y = foot[b, i, 1] - foot[b, i - 1, 1]
                z = foot[b, i, 2] - foot[b, i - 1, 2]
                total += math.sqrt(x * x + y * y + z * z)
        length[b] = total


@kernel
def stretched_lengths(place: Floats, stretch: Floats) -> Floats:
    """Lengths (B,) of one polyline whose u is stretched, mm; see `many_on_surface`.

    Parameters
    ----------
    place : array, shape (m, 2)
        u, v of its corners, mm.
    stretch : array, shape (B,)
        Factors of u.
    """
    found = np.zeros(len(stretch))
    for b in range(len(stretch)):
        for i in range(len(place) - 1):
            du = stretch[b] * (place[i + 1, 0] - place[i, 0])
            dv = place[i + 1, 1] - place[i, 1]
            found[b] += math.sqrt(du * du + dv * dv)
    return found

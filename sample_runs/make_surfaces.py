"""Write the sample surfaces: the paper's bench with its rounded side, a saddle and a scan.

    python sample_runs/make_surfaces.py sample_runs

bench.stl lies in the robot's base frame. Its top is at z = -17.54 mm, tangent at y = 5.106 mm to a
fillet of radius 86.774 mm along x, which runs into an upright side: the paper's flat pairs lie on
the top and its curved pair on the fillet. saddle.stl and scan.stl are in axes of their own. The
scan is a panel with a dent, unevenly sampled, with noise, a hole, a ragged border and an island.
"""

import sys
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import Delaunay

from dmpcli.arrays import Floats, Integers
from dmpcli.records import file_io

TOP, TANGENT, RADIUS = -17.54, 5.106, 86.774
"""Of the bench: z of its top, y where the fillet begins, radius of the fillet, mm."""

STRIP = np.radians(1.5)
"""Angle of one strip of the fillet: a chordal error of R (1 - cos(STRIP/2)) = 0.0074 mm."""

SADDLE = 240.0
"""mm; z = (x² - y²) / SADDLE."""

SEED = 7
NOISE = 0.02
"""Standard deviation of the scan's heights, mm."""

Triangles = tuple[Floats, Integers]


def bench() -> Triangles:
    """Bench along x, normals up and outwards."""
    y = np.arange(185.0, TANGENT, -7.5)
    top = np.stack([y, np.full_like(y, TOP)], axis=1)
    angle = STRIP * np.arange(round(np.pi / 2 / STRIP) + 1)
    fillet = np.stack(
        [TANGENT - RADIUS * np.sin(angle), TOP - RADIUS * (1.0 - np.cos(angle))], axis=1
    )
    depth = 8.0 * np.arange(1, 6)
    side = fillet[-1] - np.stack([np.zeros_like(depth), depth], axis=1)
    profile = np.concatenate([top, fillet, side])
    x = np.arange(-850.0, -509.0, 5.0)
    V = np.empty((len(profile), len(x), 3))
    V[..., 0] = x
    V[..., 1:] = profile[:, None]
    return V.reshape(-1, 3), _lattice(len(profile), len(x))


def saddle() -> Triangles:
    """Saddle z = (x² - y²) / SADDLE over 200 mm by 200 mm, normals up."""
    line = np.linspace(-100.0, 100.0, 51)
    x, y = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
    return np.stack([x, y, (x**2 - y**2) / SADDLE], axis=1), _lattice(51, 51)


def scan() -> Triangles:
    """Panel of 160 mm by 120 mm with a dent, as a scanner sees it; normals up."""
    rng = np.random.default_rng(SEED)
    place = np.stack(np.meshgrid(np.arange(-80.0, 80.1, 2.0), np.arange(-60.0, 60.1, 2.0)), axis=-1)
    place = place.reshape(-1, 2) + rng.uniform(-0.7, 0.7, (place.size // 2, 2))
    x, y = place.T
    height = x**2 / 800.0 - 6.0 * np.exp(-((x - 20.0) ** 2 + (y + 5.0) ** 2) / (2.0 * 30.0**2))
    V = np.stack([x, y, height + NOISE * rng.standard_normal(len(x))], axis=1)
    F = Delaunay(place).simplices.astype(np.int64)
    middle = place[F].mean(axis=1)
    hole = np.hypot((middle[:, 0] + 50.0) / 9.0, (middle[:, 1] - 30.0) / 6.0) < 1.0
    edge = np.minimum(80.0 - np.abs(middle[:, 0]), 60.0 - np.abs(middle[:, 1]))
    ragged = edge < 2.5 + 1.5 * np.sin(0.31 * middle[:, 0]) + np.sin(0.47 * middle[:, 1])
    long = np.ptp(place[F], axis=1).max(axis=1) > 6.0
    F = F[~(hole | ragged | long)]
    island = np.flatnonzero((np.abs(x - 60.0) < 4.0) & (np.abs(y - 45.0) < 4.0))
    above = V[island] + [0.0, 0.0, 15.0]
    patch = len(V) + Delaunay(place[island]).simplices.astype(np.int64)
    return np.concatenate([V, above]), np.concatenate([F, patch])


def _lattice(rows: int, columns: int) -> Integers:
    """Faces of rows by columns of vertices, each square cut in two."""
    i = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (s.ravel() for s in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def stl(V: Floats, F: Integers) -> bytes:
    """Return a mesh as a binary STL."""
    content = trimesh.Trimesh(V, F, process=False, validate=False).export(file_type="stl")
    assert isinstance(content, bytes)
    return content


SURFACES = {"bench": bench, "saddle": saddle, "scan": scan}


def main() -> None:
    """Write all of them into the folder that the command line names."""
    for name, make in SURFACES.items():
        file_io.write(Path(sys.argv[1]) / f"{name}.stl", stl(*make()))


if __name__ == "__main__":
    main()

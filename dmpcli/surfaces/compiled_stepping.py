"""`geodesic_stepping` by compiled kernels, for meshes that are `compiled`; see there."""

from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces import geodesic_stepping
from dmpcli.surfaces.geodesic_stepping import Front
from dmpcli.surfaces.triangle_mesh import ON_BORDER, TriangleMesh

if TYPE_CHECKING:
    from dmpcli.surfaces.kernels import stepping


def start(
    mesh: TriangleMesh,
    position: Floats,
    normal: Floats,
    direction: Floats,
    step: Floats,
    sign: Floats,
    part: Integers,
) -> tuple[Front, Front]:
    """Stand M walks at points of the mesh, and M that go the other way.

    Parameters
    ----------
    mesh : TriangleMesh
        One that is `compiled`.
    position, normal, direction : array, shape (M, 3)
        On the mesh, mm; unit vectors, the normal on the side that the walks keep to.
    step, sign : array, shape (M, 1)
        mm; +1 or -1, which turns the mesh's normals to the walks' side.
    part : array of int, shape (M,)
        Component of the mesh.

    Returns
    -------
    ahead, behind : Front
        With the curvature on either side; they may be walked in place.
    """
    from dmpcli.surfaces.kernels import stepping

    def front(way: float) -> Front:
        before, trend = np.empty_like(position), np.empty_like(position)
        on = np.zeros(len(position))
        return Front(
            position.copy(), way * direction, normal.copy(), before, step, sign, part, trend, on
        )

    ahead, behind = front(1.0), front(-1.0)
    doubt = np.zeros(len(position), dtype=bool)
    walks = mesh.for_kernels.facets, _limits(), _walks(ahead), _walks(behind), doubt
    stepping.start(*walks)
    while mesh.made_known(doubt):
        stepping.start(*walks)
    rows = np.flatnonzero(doubt)
    if len(rows):
        places = position[rows], normal[rows], direction[rows]
        fronts = geodesic_stepping.start(mesh, *places, step[rows], sign[rows], part[rows])
        for mine, theirs in zip((ahead, behind), fronts, strict=True):
            mine.before[rows], mine.trend[rows] = theirs.before, theirs.trend
    return ahead, behind


def walk(mesh: TriangleMesh, front: Front, steps: Integers) -> tuple[Booleans, Booleans, Integers]:
    """Walk so many steps in place.

    Parameters
    ----------
    mesh : TriangleMesh
        One that is `compiled`.
    front : Front
        M walks; their position, direction and normal are overwritten, nothing else.
    steps : array of int, shape (M,)

    Returns
    -------
    sharp, off : array of bool, shape (M,)
        Which walks met a crease, and which were ever off.
    doubtful : array of int
        Walks that stand where they began, for `geodesic_stepping` to walk.
    """
    from dmpcli.surfaces.kernels import stepping

    sharp, off, doubt = np.zeros((3, len(steps)), dtype=bool)
    stepping.ends(mesh.for_kernels.facets, _limits(), _walks(front), steps, sharp, off, doubt)
    if mesh.made_known(doubt):
        # These stand where they began; the others are not walked twice.
        rows = np.flatnonzero(doubt)
        again = front.rows(rows)
        sharp[rows], off[rows], still = walk(mesh, again, steps[rows])
        for name in ("position", "direction", "normal"):
            getattr(front, name)[rows] = getattr(again, name)
        return sharp, off, rows[still]
    return sharp, off, np.flatnonzero(doubt)


def walk_lines(
    mesh: TriangleMesh,
    front: Front,
    rows: tuple[Integers, Integers],
    nodes: tuple[int, int],
    out: tuple[Floats, Floats, Floats, Floats, Booleans, Booleans],
) -> Booleans:
    """Fill nodes of lines.

    Parameters
    ----------
    mesh, front
    rows : array of int (M,), array of int (lines,)
        Which line each walk is of, and how many nodes each line wants.
    nodes : int, int
        Where the walks stand, and 1 or -1 for the way along the line.
    out : position, direction, normal (lines, count, 3), away, sharp, back (lines, count)

    Returns
    -------
    array of bool, shape (M,)
        Walks that are for `geodesic_stepping` to walk; their nodes mean nothing.
    """
    from dmpcli.surfaces.kernels import stepping

    where, doubt = stepping.NodeArrays(*out), np.zeros(len(rows[0]), dtype=bool)
    walks = mesh.for_kernels.facets, _limits(), _walks(front), *rows, *nodes, where, doubt
    stepping.lines(*walks)
    while mesh.made_known(doubt):
        doubt[:] = False
        stepping.lines(*walks)
    return doubt


def _limits() -> "stepping.WalkLimits":
    from dmpcli.surfaces.kernels import stepping

    g = geodesic_stepping
    return stepping.WalkLimits(float(g.SHARP), g.BACK, g.JUMP, g.LANDING, ON_BORDER)


def _walks(front: Front) -> "stepping.Walks":
    from dmpcli.surfaces.kernels import stepping

    f = front
    arrays = f.position, f.direction, f.normal, f.before, f.step, f.sign, f.part, f.trend, f.away
    return stepping.Walks(*arrays)

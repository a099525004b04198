"""Workpieces of a file: exact surfaces and meshes, and how a mesh is collided."""

import math
from pathlib import Path

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.bench.workpiece import DistanceField, HeightField, Nothing, Traced
from dmpcli.errors import InputError
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane

COLLISIONS = ("closest", "hfield", "sdf")
"""By the closest point to the tip, as MuJoCo's height field, or by MuJoCo's signed distance."""

_MOST_CELLS = 1_000_000


def read(path: Path, frame: Pose, tip: Pose, collision: str, grid: float) -> Nothing:
    """Read a surface file in the base frame, and make a workpiece of it where the file has it.

    Parameters
    ----------
    path : Path
        What `dmpcli.records.surface.load` reads.
    frame : Pose
        Of the workpiece: where it is displaced and tilted about.
    tip : Pose
        Of the pen where it stands at first; the surface faces it.
    collision : str
    grid : float
        Of a height field, mm.

    Raises
    ------
    InputError
        The file is none; or it cannot be collided like that.
    """
    from dmpcli.records import file_io
    from dmpcli.records import surface as surface_file
    from dmpcli.records.mesh import MeshFile

    found = surface_file.load(file_io.read(path), pose=frame.inverse())
    pen, axis = frame.apply_inverse(tip.position[None]), frame.rotation.T @ tip.rotation[:, 2]
    if not isinstance(found, MeshFile):
        if collision != "closest":
            raise InputError(f"{path}: collide={collision}: is for meshes; leave it out")
        if isinstance(found, Plane) and found.normal @ axis > 0.0:
            found = Plane(found.point, -found.normal)
        return Traced(frame, found)
    V, F = found.V, _facing(found.V, found.F, pen, axis)
    if collision == "hfield":
        heights, half = heights_of(V, F, grid)
        return HeightField(frame, heights, half)
    if collision == "sdf":
        if Mesh(V, F).topology.border.any():
            raise InputError(f"{path}: collide=sdf: needs a closed mesh; collide=closest takes any")
        return DistanceField(frame, V, F)
    return Traced(frame, Mesh(V, F))


def _facing(V: Floats, F: Integers, pen: Floats, axis: Floats) -> Integers:
    """Return the faces with their normals against the pen's axis where it stands."""
    normal = Mesh(V, F).closest(pen).normal[0]
    return F if normal @ axis < 0.0 else F[:, ::-1]


def heights_of(V: Floats, F: Integers, grid: float) -> tuple[Floats, tuple[float, float]]:
    """Sample a mesh from above, along its frame's -z.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm, the workpiece's frame.
    F : array of int, shape (m, 3)
    grid : float
        Spacing, mm.

    Returns
    -------
    heights : array, shape (rows, columns)
        Rows along y, columns along x; where there is no mesh, as low as it gets.
    half : tuple of float
        Half of the extents along x and y, around the frame's origin, mm.
    """
    import igl

    most = np.abs(V[:, :2]).max(axis=0)
    counts = [2 * math.ceil(extent / grid) + 1 for extent in most.tolist()]
    if counts[0] * counts[1] > _MOST_CELLS:
        raise InputError(
            f"bench: a height field of {counts[0]} x {counts[1]} heights is too many; take a "
            f"larger grid than {grid:g} mm, or a frame (at_x, at_y, at_z) on the mesh"
        )
    half = (0.5 * (counts[0] - 1) * grid, 0.5 * (counts[1] - 1) * grid)
    x, y = (np.linspace(-h, h, n) for h, n in zip(half, counts, strict=True))
    X, Y = np.meshgrid(x, y)
    top = float(V[:, 2].max()) + 1.0
    above = np.column_stack([X.ravel(), Y.ravel(), np.full(X.size, top)])
    down = np.tile([0.0, 0.0, -1.0], (X.size, 1))
    tree = igl.AABB()
    faces = np.ascontiguousarray(F, dtype=np.int64)
    tree.init(np.ascontiguousarray(V), faces)
    hits = tree.intersect_ray(np.ascontiguousarray(V), faces, above, down)
    lowest = float(V[:, 2].min())
    heights = [top - min(hit[1] for hit in one) if one else lowest for one in hits]
    return np.array(heights).reshape(X.shape), half

"""The region of a surface that a closed line on it encloses."""

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.flat_regions import FlatRegion, flattened
from dmpcli.surfaces.keep_off import Region
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.mesh_regions import mesh_region
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere
from dmpcli.surfaces.surface import Surface


def enclosed(surface: Surface, line: Floats) -> Region:
    """Return the region within a closed line.

    Parameters
    ----------
    surface : Surface
    line : array, shape (M, 3)
        Points on the surface, mm, which geodesics join, on a mesh plane sections; the last is
        joined to the first.

    Raises
    ------
    InputError
        The line has no inside, or does not find along the mesh.
    """
    if isinstance(surface, Mesh):
        return mesh_region(surface, line)
    if isinstance(surface, (Plane, Cylinder, Sphere)):
        flat = flattened(surface, line)
        return FlatRegion(flat, flat(line))
    raise InputError("is on a surface of a kind that no line is known on")

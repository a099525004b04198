"""What ``--surface`` names: a plane file or a mesh file, told apart by content."""

from dmpcli.errors import InputError
from dmpcli.records import mesh, plane
from dmpcli.records.mesh import MeshFile
from dmpcli.records.pose import Pose
from dmpcli.records.streams import Source
from dmpcli.surfaces.plane import Plane


def load(source: Source, unit: str | None = None, pose: Pose | None = None) -> Plane | MeshFile:
    """Read a surface and place it in the robot's base frame.

    Parameters
    ----------
    source : Source
        A plane file (JSON), or a mesh (STL, OBJ, PLY).
    unit : {'mm', 'cm', 'm', 'in'}, optional
        Of the mesh file's coordinates; without it mm. Plane files are always in mm.
    pose : Pose, optional
        Where the file's own frame lies in the base frame; without it, they are the same.

    Returns
    -------
    Plane or MeshFile
        In the base frame, mm. The side of the normals is the file's own.

    Raises
    ------
    InputError
        Neither a plane nor a mesh, or one that is damaged or cannot be mended; by name.
    """
    if source.content.lstrip()[:1] == b"{":
        if unit not in (None, "mm"):
            raise InputError(f"{source.name}: plane files are in mm; leave --surface-unit out")
        flat = plane.decode(source)
        if pose is None:
            return flat
        return Plane(pose.to_base(flat.point), pose.rotation @ flat.normal)
    found = mesh.decode(source, unit or "mm", "--surface-unit")
    return found if pose is None else found._replace(V=pose.to_base(found.V))

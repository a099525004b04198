"""What ``--surface`` names: a plane, cylinder or sphere file or a mesh, told apart by content."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from dmpcli.errors import InputError
from dmpcli.records import exact_surface, json_files, mesh, mesh_formats
from dmpcli.records.exact_surface import FILES, FORMS, Exact
from dmpcli.records.file_io import Source
from dmpcli.records.mesh import MeshFile
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.plane import Plane

MESH = "mesh"
"""Kind of surfaces that are no JSON file."""

DECODERS: dict[str, Callable[[Source], Exact]] = {
    kind: partial(exact_surface.decode, kind=kind) for kind in FILES
}
"""Readers of the files by their schema."""

_KEYS = {"normal": "plane", "axis": "cylinder", "centre": "sphere"}
"""Keys that only one of the kinds has."""


def kind_of(document: Mapping[str, Any]) -> str | None:
    """Tell which kind of surface a JSON object is: by its schema, without one by its keys.

    Returns
    -------
    str or None
        A key of `DECODERS`; None where it is none of them, or could be several.
    """
    if "schema" in document:
        said = document["schema"]
        return said if isinstance(said, str) and said in DECODERS else None
    kinds = {kind for key, kind in _KEYS.items() if key in document}
    return kinds.pop() if len(kinds) == 1 else None


def kind(exact: Exact) -> str:
    """Return the kind of an exact surface, a key of `DECODERS`."""
    return type(exact).__name__.lower()


def load(source: Source, unit: str | None = None, pose: Pose | None = None) -> Exact | MeshFile:
    """Read a surface and place it in the robot's base frame.

    Parameters
    ----------
    source : Source
        A plane, cylinder or sphere file (JSON), or a mesh (STL, OBJ, PLY, OFF).
    unit : {'mm', 'cm', 'm', 'in'}, optional
        Of the mesh file's coordinates; without it mm. The other files are always in mm.
    pose : Pose, optional
        Where the file's own frame lies in the base frame; without it, they are the same.

    Returns
    -------
    Plane, Cylinder, Sphere or MeshFile
        In the base frame, mm. The side of the normals is the file's own; outwards on cylinders
        and spheres.

    Raises
    ------
    InputError
        None of them, or one that is damaged or cannot be mended; by name.
    """
    if source.content.lstrip()[:1] != b"{" or mesh_formats.is_gltf(source):
        found = mesh.decode(source, unit or "mm", "--surface-unit")
        return found if pose is None else found._replace(V=pose.apply(found.V))
    document = json_files.json_document(source)
    name = kind_of(document)
    if name is None:
        said = document.get("schema")
        is_not = "tells no surface" if said is None else f"has schema {said!r}, not a surface's"
        raise InputError(
            f"{source.name}: {is_not}: a plane is {FORMS['plane']}, a cylinder "
            f"{FORMS['cylinder']}, a sphere {FORMS['sphere']}, in mm"
        )
    if unit not in (None, "mm"):
        raise InputError(f"{source.name}: {name} files are in mm; leave --surface-unit out")
    exact = DECODERS[name](source)
    return exact if pose is None else placed(exact, pose)


def placed(exact: Exact, pose: Pose) -> Exact:
    """Return an exact surface moved from its own frame into that of the pose."""
    if isinstance(exact, Plane):
        return Plane(pose.apply(exact.point), pose.rotation @ exact.normal)
    if isinstance(exact, Cylinder):
        return replace(exact, point=pose.apply(exact.point), axis=pose.rotation @ exact.axis)
    return replace(exact, centre=pose.apply(exact.centre))

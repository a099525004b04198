"""Which format a mesh file has: the content decides, not the name's ending."""

from collections.abc import Callable

from dmpcli.errors import InputError
from dmpcli.records import mesh_obj, mesh_off, mesh_ply, mesh_stl
from dmpcli.records.file_io import Source
from dmpcli.records.mesh_polygons import Triangles
from dmpcli.records.text_lines import MARK
from dmpcli.records.untrusted import decoder


class ForeignMeshError(InputError):
    """A part in a format that is not read, but is known by name."""


@decoder
def triangles(source: Source) -> Triangles:
    """Read the triangles of an STL (binary or text), OBJ, PLY or OFF file as they stand.

    Polygons of more than three corners are cut into triangles. The facets of an STL share no
    vertices yet.

    Raises
    ------
    InputError
        Not one of these formats, truncated, too large, or a number that is none; names the line
        in text.
    """
    source = _unmarked(source)
    return _reader(source)(source)


def format_of(source: Source) -> str | None:
    """Name the format of a mesh file by its content; None for what is no mesh.

    Raises
    ------
    ForeignMeshError
        A part in a format that is not read; by the format's name.
    """
    try:
        return _NAMES[_reader(_unmarked(source))]
    except ForeignMeshError:
        raise
    except InputError:
        return None


def looks_like_mesh(source: Source) -> bool:
    """Tell whether a file is a mesh that is read, by its first bytes and its name."""
    start = _unmarked(Source(source.name, source.content[:4096]))
    if start.name.lower().endswith(".stl") or mesh_stl.is_text(start):
        return True
    suits = mesh_ply.suits, mesh_off.suits, mesh_obj.suits
    return any(suit(start) for suit in suits) or mesh_stl.is_binary(source)


def _unmarked(source: Source) -> Source:
    if not source.content.startswith(MARK):
        return source
    return Source(source.name, source.content[len(MARK) :])


def _reader(source: Source) -> Callable[[Source], Triangles]:
    for suits, reader in (
        (mesh_ply.suits, mesh_ply.read),
        (mesh_off.suits, mesh_off.read),
        (mesh_stl.is_binary, mesh_stl.binary),
        (mesh_stl.is_text, mesh_stl.text),
    ):
        if suits(source):
            return reader
    foreign = _foreign(source)
    if foreign is not None:
        name, program = foreign
        raise ForeignMeshError(
            f"{source.name}: is {name}, which is not read; open it in {program} and export the "
            "part as STL, OBJ, PLY or OFF"
        )
    if source.name.lower().endswith(".stl"):
        return mesh_stl.binary
    if mesh_obj.suits(source):
        return mesh_obj.read
    raise InputError(
        f"{source.name}: is neither a mesh (STL, OBJ, PLY or OFF) nor a plane, cylinder or sphere "
        "file (JSON); export the part as one of these"
    )


_CAD, _MESHES = "a CAD program such as FreeCAD", "a mesh program such as MeshLab or Blender"

_STARTS = (
    (b"ISO-10303-21", "a STEP file", _CAD),
    (b"glTF", "a GLB file (binary glTF)", _MESHES),
    (b"Kaydara FBX", "an FBX file", _MESHES),
    (b"BLENDER", "a Blender file", "Blender"),
    (b"#VRML", "a VRML file", _MESHES),
    (b"DBRep_DrawableShape", "a BREP file", _CAD),
    (b"CASCADE Topology", "a BREP file", _CAD),
)

_ROOTS = (
    (b"<COLLADA", "a DAE file (COLLADA)", _MESHES),
    (b"<amf", "an AMF file", "a slicer such as PrusaSlicer"),
    (b"<X3D", "an X3D file", _MESHES),
)

_PARTS = (
    (b"3D/3dmodel.model", "a 3MF file", "the program that made it, or in a slicer,"),
    (b"Document.xml", "a FreeCAD file", "FreeCAD"),
)
"""Formats that are zip files, by the name of a file in them."""


def is_gltf(source: Source) -> bool:
    """Tell text glTF, which is JSON but none of ours: it must name its asset's version."""
    content = source.content
    return content.lstrip()[:1] == b"{" and b'"asset"' in content and b'"version"' in content


def _foreign(source: Source) -> tuple[str, str] | None:
    """Name of a format that is not read, and a program that reads it."""
    content = source.content
    if is_gltf(source):
        return "a glTF file", _MESHES
    start = content[:4096].lstrip()
    for mark, name, program in _STARTS:
        if start.startswith(mark):
            return name, program
    for mark, name, program in _ROOTS:
        if start.startswith(b"<") and mark in start:
            return name, program
    if start.startswith(b"PK\x03\x04"):
        for mark, name, program in _PARTS:
            if mark.lower() in content.lower():
                return name, program
        if source.name.lower().endswith(".3mf"):
            return _PARTS[0][1:]
    # IGES numbers its cards after the letter of their section.
    if start[72:73] == b"S" and start[73:80].strip() == b"1":
        return "an IGES file", _CAD
    return None


_NAMES: dict[Callable[[Source], Triangles], str] = {
    mesh_stl.binary: "binary STL",
    mesh_stl.text: "text STL",
    mesh_obj.read: "OBJ",
    mesh_ply.read: "PLY",
    mesh_off.read: "OFF",
}

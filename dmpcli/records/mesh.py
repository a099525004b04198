"""Mesh files: STL, OBJ, PLY or OFF in, a checked and mended mesh in mm out."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.errors import InputError
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import LENGTH
from dmpcli.records.mesh_formats import looks_like_mesh, triangles
from dmpcli.records.mesh_polygons import Triangles

if TYPE_CHECKING:
    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.open_patches import Patch
    from dmpcli.surfaces.topology import Adjacency

UNITS = LENGTH
"""mm in each unit of length that a mesh file may be in."""

SMALL, LARGE = 1.0, 20_000.0
"""mm. A part outside of these is more likely in another unit than meant so."""


LONG = 20_000_000
"""Bytes. Reading a mesh of more takes some seconds."""


class MeshFile(NamedTuple):
    """A mesh as read.

    Attributes
    ----------
    V : array, shape (n, 3)
        mm.
    F : array, shape (m, 3)
        Faces with area, none twice, edge and vertex manifold, wound consistently within each
        component.
    remarks : list of str
        What was mended, and what looks odd.
    adjacency : Adjacency, optional
        Of the faces.
    """

    V: Floats
    F: Integers
    remarks: list[str]
    adjacency: "Adjacency | None" = None


def decode(source: Source, unit: str = "mm", option: str = "--unit") -> MeshFile:
    """Read a mesh file.

    Parameters
    ----------
    source : Source
    unit : {'mm', 'cm', 'm', 'in'}
        Of the file's coordinates; the formats do not say.
    option : str
        Where the user names the unit.

    Raises
    ------
    InputError
        An unknown unit, not a mesh, a damaged file, or a mesh that is not safe to mend; by name.
    """
    if unit not in UNITS:
        raise InputError(f"{option} {unit}: must be one of {', '.join(UNITS)}")
    return _decoded(source.name, triangles(source), unit)


def _decoded(name: str, found: Triangles, unit: str) -> MeshFile:
    from dmpcli.surfaces.mesh_repair import mended

    try:
        mesh = mended(found.V * UNITS[unit], found.F)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    remarks = found.remarks + mesh.remarks
    size = float(np.linalg.norm(np.ptp(mesh.V, axis=0)))
    if not SMALL < size < LARGE:
        remarks.append(f"it measures {size:.3g} mm across as {unit}: check its unit of length")
    return MeshFile(mesh.V, mesh.F, remarks, mesh.adjacency)


def waiting(source: Source) -> str | None:
    """Say that a file which looks like a mesh takes a while to read; None where it does not."""
    if len(source.content) <= LONG or not looks_like_mesh(source):
        return None
    return f"{source.name}: reading a mesh of {len(source.content) / 1e6:.0f} MB takes a while"


def summary(mesh: MeshFile, shape: "Mesh | None" = None) -> str:
    """Say in one line how large, fine and noisy a mesh is: its facets bound every accuracy.

    Parameters
    ----------
    mesh : MeshFile
    shape : Mesh, optional
        The same, where it is made already.
    """
    from dmpcli.surfaces.chordal_error import chordal_error
    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.mesh_repair import components

    error = chordal_error(mesh.V, mesh.F)
    pieces, noisy = components(mesh.F), (shape or Mesh(mesh.V, mesh.F)).shape.noisy_share
    rough = f"; {_percent(noisy)} of its area is noisy, normals are averaged there"
    return (
        f"{len(mesh.F)} faces, {pieces} {'piece' if pieces == 1 else 'pieces'}, chordal error "
        f"estimated at {error.median:.2g} mm, at most {error.largest:.2g} mm"
        f"{rough if noisy > 0.0 else ''}"
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"


def description(source: Source) -> dict[str, Any]:
    """Say what a mesh file holds, as `decode` would read it in mm; errors are chordal ones.

    Raises
    ------
    InputError
        A damaged file, or a mesh that is not safe to mend; by name.
    """
    from dmpcli.surfaces.chordal_error import chordal_error
    from dmpcli.surfaces.extent import area, volume
    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.mesh_repair import borders, components
    from dmpcli.surfaces.open_patches import open_patches

    found = triangles(source)
    mesh = _decoded(source.name, found, "mm")
    error, (edges, rims) = chordal_error(mesh.V, mesh.F), borders(mesh.F)
    low, high = mesh.V.min(axis=0), mesh.V.max(axis=0)
    return {
        "vertices": len(mesh.V),
        "faces": len(mesh.F),
        "faces_in_file": len(found.F),
        "pieces": components(mesh.F),
        "border_edges": edges,
        "borders": rims,
        "area": area(mesh.V, mesh.F),
        "volume": volume(mesh.V, mesh.F),
        "least": low.tolist(),
        "largest": high.tolist(),
        "size": (high - low).tolist(),
        "likely_unit": _likely_unit(float(np.linalg.norm(high - low))),
        "error_median": error.median,
        "error_largest": error.largest,
        "noisy_share": Mesh(mesh.V, mesh.F, mesh.adjacency).shape.noisy_share,
        "room": [as_options(one) for one in open_patches(mesh.V, mesh.F)],
        "remarks": mesh.remarks,
    }


def as_options(patch: "Patch") -> str:
    """Return where there is room for a stroke, as options of ``generalize`` say it."""
    return f"{ends_as_options(patch)}  {what(patch)}"


def ends_as_options(patch: "Patch") -> str:
    """Return start and goal as options of ``generalize`` say them."""
    return f"--start {_said(patch.start)} --goal {_said(patch.goal)}"


def what(patch: "Patch") -> str:
    """Return size and normal of a patch in words."""
    return f"({patch.area:.4g} mm², normal {_said(patch.normal, 2)})"


def _said(point: Floats, digits: int = 1) -> str:
    return " ".join(f"{value:.10g}" for value in np.round(point, digits) + 0.0)


def _likely_unit(size: float) -> str | None:
    """Unit in which a part that is so large across is neither tiny nor huge; None if in none."""
    return next((u for u in ("mm", "m", "cm", "in") if 20.0 <= size * UNITS[u] <= 5_000.0), None)

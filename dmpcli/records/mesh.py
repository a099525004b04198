"""Mesh files: STL, OBJ or PLY in, a checked and mended mesh in mm out."""

from typing import Any, NamedTuple

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.errors import InputError
from dmpcli.records.mesh_formats import triangles
from dmpcli.records.recordings import LENGTH
from dmpcli.records.streams import Source

UNITS = LENGTH
"""mm in each unit of length that a mesh file may be in."""

SMALL, LARGE = 1.0, 20_000.0
"""mm. A part outside of these is more likely in another unit than meant so."""


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
    """

    V: Floats
    F: Integers
    remarks: list[str]


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
    from dmpcli.surfaces.mending import mended

    if unit not in UNITS:
        raise InputError(f"{option} {unit}: must be one of {', '.join(UNITS)}")
    V, F = triangles(source)
    try:
        mesh = mended(V * UNITS[unit], F)
    except InputError as error:
        raise InputError(f"{source.name}: {error}") from None
    remarks = list(mesh.remarks)
    size = float(np.linalg.norm(np.ptp(mesh.V, axis=0)))
    if not SMALL < size < LARGE:
        remarks.append(f"it measures {size:.3g} mm across as {unit}: check its unit of length")
    return MeshFile(mesh.V, mesh.F, remarks)


def summary(mesh: MeshFile) -> str:
    """Say in one line how large and how fine a mesh is: its facets bound every accuracy."""
    from dmpcli.surfaces.chordal import chordal_error
    from dmpcli.surfaces.mending import components

    error = chordal_error(mesh.V, mesh.F)
    pieces = components(mesh.F)
    return (
        f"{len(mesh.F)} faces, {pieces} {'piece' if pieces == 1 else 'pieces'}, chordal error "
        f"estimated at {error.median:.2g} mm, at most {error.largest:.2g} mm"
    )


def description(source: Source) -> dict[str, Any]:
    """Say what a mesh file holds, as `decode` would read it in mm; errors are chordal ones.

    Raises
    ------
    InputError
        A damaged file, or a mesh that is not safe to mend; by name.
    """
    from dmpcli.surfaces.chordal import chordal_error
    from dmpcli.surfaces.mending import borders, components

    facets = len(triangles(source)[1])
    mesh = decode(source)
    error, (edges, rims) = chordal_error(mesh.V, mesh.F), borders(mesh.F)
    low, high = mesh.V.min(axis=0), mesh.V.max(axis=0)
    return {
        "vertices": len(mesh.V),
        "faces": len(mesh.F),
        "faces_in_file": facets,
        "pieces": components(mesh.F),
        "border_edges": edges,
        "borders": rims,
        "least": low.tolist(),
        "largest": high.tolist(),
        "size": (high - low).tolist(),
        "likely_unit": _likely_unit(float(np.linalg.norm(high - low))),
        "error_median": error.median,
        "error_largest": error.largest,
        "remarks": mesh.remarks,
    }


def _likely_unit(size: float) -> str | None:
    """Unit in which a part that is so large across is neither tiny nor huge; None if in none."""
    return next((u for u in ("mm", "m", "cm", "in") if 20.0 <= size * UNITS[u] <= 5_000.0), None)

"""The surface that ``--surface`` names, with ``--surface-pose`` and ``--surface-unit``."""

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.records.file_io import Source
    from dmpcli.records.mesh_store import MeshStore
    from dmpcli.records.pose import PoseFile
    from dmpcli.records.storage import Location
    from dmpcli.spatial.pose import Pose
    from dmpcli.surfaces.surface import Surface

_READ = "_read_from"


@dataclass(frozen=True)
class SurfaceInput:
    """A surface and where it came from.

    Attributes
    ----------
    path : Path or ObjectPath
    surface : Surface
        In the base frame, mm.
    kind : {'plane', 'cylinder', 'sphere', 'mesh'}
    sha256 : str
        Of the file.
    unit : str
        Of its lengths.
    pose : Pose or None
        Where the file's own frame lies in the base frame; None where they are the same.
    options : dict
        For provenance: ``surface_pose`` where it was given as numbers.
    inputs : list of dict
        For provenance: role and sha256 of the files that were read.
    said_pose : list of float
        X Y Z RX RY RZ as given or as in the pose file, not yet brought to one turn; or empty.
    """

    path: "Location"
    surface: "Surface"
    kind: str
    sha256: str
    unit: str
    pose: "Pose | None"
    options: dict[str, Any] = field(default_factory=dict)
    inputs: list[dict[str, str]] = field(default_factory=list)
    said_pose: list[float] = field(default_factory=list)

    @property
    def facts(self) -> dict[str, Any]:
        """Kind, sha256, unit and pose (X Y Z RX RY RZ, mm and rad, or None), as a skill keeps."""
        from dmpcli.spatial import rotations

        six = None
        if self.pose is not None:
            six = [*self.pose.position.tolist(), *rotations.to_euler(self.pose.rotation).tolist()]
        return {"kind": self.kind, "sha256": self.sha256, "unit": self.unit, "pose": six}

    @property
    def said(self) -> dict[str, Any]:
        """File, sha256, kind, unit and pose as given, as a report names them."""
        pose = self.options.get("surface_pose")
        if pose is None and self.pose is not None:
            pose = {"sha256": self.inputs[-1]["sha256"]}
        return {"file": self.path.name, "sha256": self.sha256, "unit": self.unit, "pose": pose}


def check_options(surface: "Location | None", pose: str | None, unit: str | None) -> None:
    """Refuse a pose or a unit of no surface.

    Parameters
    ----------
    surface : str, Path or None
        Whether one was named at all.
    pose, unit : str or None
        As they were given.

    Raises
    ------
    InputError
        Names both options.
    """
    if surface is None and (pose is not None or unit is not None):
        raise InputError("--surface-pose and --surface-unit say where a --surface lies; name one")


def read(
    path: "Location",
    pose: str | None,
    unit: str | None,
    summary: bool = False,
    store: "MeshStore | None" = None,
) -> SurfaceInput:
    """Read a surface, place it in the base frame, and say what is odd about it.

    Parameters
    ----------
    path : Path or ObjectPath
        A plane, cylinder or sphere file, or a mesh.
    pose : str, optional
        ``X Y Z RX RY RZ`` in mm and rad, or a pose file.
    unit : str, optional
        Of a mesh file's lengths; without it mm.
    summary : bool
        Also say how fine a mesh is: its facets bound every accuracy.
    store : MeshStore, optional
        Where prepared meshes are kept.

    Raises
    ------
    InputError
        A file that cannot be read or is none of them, a wrong pose or unit; by name.
    """
    from dmpcli.messages import tell
    from dmpcli.records import file_io
    from dmpcli.records import mesh as mesh_file
    from dmpcli.records import pose as pose_file

    source = file_io.read(path)
    placed = None if pose is None else pose_file.parse(pose, "--surface-pose")
    waiting = mesh_file.waiting(source)
    if waiting is not None:
        tell(waiting)
    return placed_input(source, pose, placed, unit, store=store, summary=summary)


def store_in(folder: str | None, kernels: bool = False) -> "MeshStore":
    """Return what reads surfaces, and keeps prepared meshes, for kernels or not, in a folder.

    Raises
    ------
    InputError
        There is something else of the folder's name.
    """
    from dmpcli.records.mesh_store import MeshStore
    from dmpcli.records.storage import located

    if folder is None:
        return MeshStore(None, kernels=kernels)
    place = located(folder)
    if not isinstance(place, Path):
        raise InputError(
            f"--surface-cache: {place} is a store's; name a folder of this machine, or leave it out"
        )
    if place.exists() and not place.is_dir():
        raise InputError(f"--surface-cache: {place} is no folder; name one, or leave it out")
    return MeshStore(str(place.absolute()), kernels=kernels)


def placed_input(
    source: "Source",
    pose: str | None,
    placed: "tuple[Pose, Source | None] | None",
    unit: str | None,
    option: str = "--surface-pose",
    store: "MeshStore | None" = None,
    summary: bool = False,
) -> SurfaceInput:
    """Return a surface that was read, placed in the base frame; say what is odd about it.

    Parameters
    ----------
    source : Source
    pose : str, optional
        As it was given.
    placed : tuple of Pose and Source, optional
        The pose, and its file if it came from one; see `pose.parse`.
    unit : str, optional
        Of a mesh file's lengths; without it mm.
    option : str
        What messages call a pose of six numbers.
    store : MeshStore, optional
        Where prepared meshes are kept.
    summary : bool
        As in `read`.

    Raises
    ------
    InputError
        As in `read`.
    """
    from dmpcli.messages import tell
    from dmpcli.records import mesh as mesh_file
    from dmpcli.records import pose as pose_file
    from dmpcli.records import surface as surface_file
    from dmpcli.records.mesh_store import MeshStore
    from dmpcli.records.storage import located
    from dmpcli.workflows.pose_hints import warn_of_angles

    inputs = [{"role": "surface", "sha256": source.sha256}]
    options: dict[str, Any] = {}
    at, said = None, []
    if placed is not None:
        at, pose_source = placed
        if pose_source is None:
            assert pose is not None
            said = options["surface_pose"] = [float(word) for word in pose.split()]
        else:
            inputs.append({"role": "surface-pose", "sha256": pose_source.sha256})
            _, file = pose_file.decode(pose_source)
            said = [*file.position, *file.rotation]
            unit = _agreed(pose_source.name, file, source, unit)
        warn_of_angles(option if pose_source is None else pose_source.name, said[3:])
    found = (store or MeshStore()).load(source, unit, at)
    shape: Surface
    if isinstance(found, tuple):
        mesh, shape = found
        for remark in mesh.remarks:
            tell(f"{source.name}: {remark}")
        kind = surface_file.MESH
        if summary:
            tell(f"{source.name}: {mesh_file.summary(mesh, shape)}")
    else:
        kind, shape = surface_file.kind(found), found
    return SurfaceInput(
        located(source.name),
        shape,
        kind,
        inputs[0]["sha256"],
        unit or "mm",
        at,
        options,
        inputs,
        said,
    )


def _agreed(name: str, file: "PoseFile", part: "Source", unit: str | None) -> str | None:
    """Return the part's unit, of which the pose file and the option must agree.

    Raises
    ------
    InputError
        They contradict one another: the part would be drawn on in another size than it has there.
    """
    from dmpcli.messages import warn

    if part.content.lstrip()[:1] == b"{":  # no mesh: always in mm
        return unit
    touched = [entry["sha256"] for entry in file.inputs if entry.get("role") == "part"]
    if touched and part.sha256 not in touched:
        warn(
            f"{name}: was found for another file than {part.name}; if the part or its axes "
            "are others, register it anew"
        )
    if file.unit is None:
        return unit
    if unit is not None and unit != file.unit:
        raise InputError(
            f"--surface-unit {unit}: {name} was found with the part in {file.unit}; leave "
            "--surface-unit out, or register the part anew with --unit"
        )
    return file.unit


def remember(found: SurfaceInput) -> None:
    """Let a surface tell which file it was read from, for the provenance of what is drawn on it."""
    object.__setattr__(found.surface, _READ, found)


def remembered(surface: "Surface") -> SurfaceInput:
    """Return a surface with where it came from; one that was made of arrays has their hash."""
    from dmpcli.records import surface as surface_file
    from dmpcli.surfaces.mesh import Mesh

    found: SurfaceInput | None = getattr(surface, _READ, None)
    if found is not None:
        return found
    mesh = isinstance(surface, Mesh)
    own = (surface.V, surface.F) if isinstance(surface, Mesh) else vars(surface).values()
    digest = hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in own))
    kind = surface_file.MESH if mesh else surface_file.kind(surface)  # type: ignore[arg-type]
    sha256 = digest.hexdigest()
    inputs = [{"role": "surface", "sha256": sha256}]
    return SurfaceInput(Path(kind), surface, kind, sha256, "mm", None, {}, inputs)

"""Prepared meshes kept in a folder: what a mesh file becomes is found once, by whoever comes first.

A mesh is known by the content of its file, its unit, its pose, and the versions of the programs
that prepare it; what comes back is bit by bit what would be found anew. Writers need not know of
one another: each entry is written beside its name and renamed when whole, and one that cannot be
read is as good as none.
"""

import contextlib
import hashlib
import io
import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from dmpcli.arrays import AnyArray, Floats, Integers
from dmpcli.records import file_io, surface
from dmpcli.records.exact_surface import Exact
from dmpcli.records.file_io import Source
from dmpcli.records.mesh import MeshFile
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.topology import Adjacency
from dmpcli.version import __version__

FORMAT = 2

LARGEST = 8 * 2**30
"""Bytes that a folder holds; beyond them what was used longest ago goes."""

_SUFFIX = ".mesh"
_OFTEN = 16
"""The folder is looked through once in so many entries."""

_HELD = 2
"""Meshes as read, before they are placed, that are held for their next pose."""


@dataclass
class MeshStore:
    """Reads surfaces, and keeps what meshes become.

    Attributes
    ----------
    folder : str or None
        Without one only the last meshes are held, for their next pose.
    largest : int
        Bytes.
    kernels : bool
        Whether meshes are for kernels: the order of their search trees is kept too.
    """

    folder: str | None = None
    largest: int = LARGEST
    kernels: bool = False
    _held: dict[tuple[str, str | None], MeshFile] = field(default_factory=dict, repr=False)
    _written: int = field(default=0, repr=False)

    def __getstate__(self) -> dict[str, Any]:
        # What is held stays; another process begins with nothing.
        return vars(self) | {"_held": {}, "_written": 0}

    def load(
        self, source: Source, unit: str | None = None, pose: Pose | None = None
    ) -> Exact | tuple[MeshFile, Mesh]:
        """Read a surface and place it, as `surface.load`.

        Parameters
        ----------
        source : Source
        unit : {'mm', 'cm', 'm', 'in'}, optional
            Of a mesh file's coordinates; without it mm.
        pose : Pose, optional
            Of the file's own frame in the base frame; without it, they are the same.

        Returns
        -------
        Plane, Cylinder, Sphere, or tuple of MeshFile and Mesh
            In the base frame, mm.

        Raises
        ------
        InputError
            As `surface.load`.
        """
        entry = None if self.folder is None else self._entry(source, unit, pose)
        if entry is not None:
            kept = _kept(entry)
            if kept is not None:
                if self.kernels and not kept[1].knows_order:
                    self._keep(entry, *kept)
                with contextlib.suppress(OSError):
                    os.utime(entry)
                return kept
        found = self._read(source, unit)
        if not isinstance(found, MeshFile):
            return found if pose is None else surface.placed(found, pose)
        if pose is not None:
            found = found._replace(V=pose.apply(found.V))
        mesh = Mesh(found.V, found.F, found.adjacency)
        if entry is not None:
            self._keep(entry, found, mesh)
        return found, mesh

    def _read(self, source: Source, unit: str | None) -> Exact | MeshFile:
        key = (source.sha256, unit)
        found = self._held.pop(key, None) or surface.load(source, unit)
        if isinstance(found, MeshFile):
            self._held[key] = found
            while len(self._held) > _HELD:
                del self._held[next(iter(self._held))]
        return found

    def _entry(self, source: Source, unit: str | None, pose: Pose | None) -> Path:
        assert self.folder is not None
        placed = (
            None if pose is None else [*pose.position.tolist(), *pose.rotation.ravel().tolist()]
        )
        told = json.dumps([source.sha256, unit or "mm", placed, _made_by()])
        return Path(self.folder) / (hashlib.sha256(told.encode()).hexdigest() + _SUFFIX)

    def _keep(self, entry: Path, found: MeshFile, mesh: Mesh) -> None:
        """Write an entry; one that cannot be written is done without."""
        with contextlib.suppress(OSError):
            entry.parent.mkdir(parents=True, exist_ok=True)
            temporary, stream = file_io.temporary_of(entry)
            try:
                with stream:
                    np.savez(stream, **_packed(found, mesh, self.kernels))  # type: ignore[arg-type]
                temporary.replace(entry)
            finally:
                temporary.unlink(missing_ok=True)
            self._written += 1
            if self._written % _OFTEN == 1:
                self._bound(entry.parent)

    def _bound(self, folder: Path) -> None:
        """Remove what was used longest ago, until the folder holds no more than it may."""
        entries = []
        with os.scandir(folder) as found:
            for one in found:
                if one.name.endswith(_SUFFIX):
                    with contextlib.suppress(OSError):  # another one removes them too
                        known = one.stat()
                        entries.append((known.st_mtime_ns, known.st_size, one.path))
        size = sum(one[1] for one in entries)
        for _, bytes_of, path in sorted(entries):
            if size <= self.largest:
                break
            with contextlib.suppress(OSError):
                os.unlink(path)
            size -= bytes_of


@cache
def _made_by() -> list[int | str]:
    """Versions of what prepares a mesh."""
    from importlib.metadata import version  # looks through folders

    return [FORMAT, __version__, np.__version__, scipy.__version__, version("libigl")]


def _packed(found: MeshFile, mesh: Mesh, kernels: bool) -> dict[str, AnyArray]:
    """Return the arrays of an entry: numbers of vertices and faces in four bytes each."""
    adjacency = mesh.topology.adjacency
    packed: dict[str, AnyArray] = {
        "V": found.V,
        "F": found.F.astype(np.int32),
        "neighbours": adjacency.neighbours.astype(np.int32),
        "remarks": np.frombuffer(json.dumps(found.remarks).encode(), dtype=np.uint8),
    }
    if adjacency.components.any():
        packed["components"] = adjacency.components.astype(np.int32)
    if kernels:
        packed |= mesh.tree_order._asdict()
    return packed


def _unpacked(entry: Path) -> dict[str, AnyArray]:
    """Return the arrays of an entry, which may not be written to: np.load copies each twice.

    Raises
    ------
    OSError, ValueError, zipfile.BadZipFile
        There is none, or a damaged one.
    """
    held = {}
    with zipfile.ZipFile(entry) as packed:
        for name in packed.namelist():
            content = packed.read(name)
            stream = io.BytesIO(content)
            np.lib.format.read_magic(stream)
            shape, by_columns, kind = np.lib.format.read_array_header_1_0(stream)
            values = np.frombuffer(content, dtype=kind, offset=stream.tell())
            held[name.removesuffix(".npy")] = values.reshape(
                shape, order="F" if by_columns else "C"
            )
    return held


def _kept(entry: Path) -> tuple[MeshFile, Mesh] | None:
    """Return the mesh of an entry; None where there is none, or a damaged one."""
    try:
        held = _unpacked(entry)
        V, F = held["V"].astype(float), _whole(held["F"])
        pieces = held.get("components")
        components = np.zeros(len(F), dtype=np.int64) if pieces is None else _whole(pieces)
        adjacency = Adjacency(_whole(held["neighbours"]), components)
        if not _sound(V, F, adjacency, held):
            return None
        remarks = json.loads(held["remarks"].tobytes())
        mesh = Mesh(V, F, adjacency)
        if "order" in held:
            mesh.know_order(held["order"].copy(), held["first"].copy())
    except (OSError, ValueError, KeyError, IndexError, EOFError, zipfile.BadZipFile):
        return None
    return MeshFile(V, F, remarks, adjacency), mesh


def _sound(V: Floats, F: Integers, adjacency: Adjacency, held: Mapping[str, AnyArray]) -> bool:
    """Whether all numbers of an entry are of something: kernels look nothing up twice."""
    count, shape = len(F), (len(F), 3)
    near = adjacency.neighbours
    sound = (
        V.shape == (len(V), 3)
        and F.shape == near.shape == shape
        and adjacency.components.shape == (count,)
        and count > 0
        and bool(np.isfinite(V).all())
        and F.min() >= 0
        and F.max() < len(V)
        and near.min() >= -1
        and near.max() < count
    )
    if not sound or "order" not in held:
        return sound
    order, first = held["order"], held["first"]
    leaves, there = len(first) - 1, np.zeros(count, dtype=bool)
    if order.shape != (count,) or order.min() < 0 or order.max() >= count:
        return False
    there[order] = True
    return (
        bool(there.all())
        and 0 < leaves <= 2 * count
        and leaves & (leaves - 1) == 0
        and bool((np.diff(first) >= 0).all())
        and (first[0], first[-1]) == (0, count)
    )


def _whole(values: AnyArray) -> Integers:
    return values.astype(np.int64)

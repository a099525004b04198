"""What the strokes of a batch lie on, when its table names the surface of each pair."""

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dmpcli.arrays import Integers
from dmpcli.batch.site import Site
from dmpcli.errors import InputError
from dmpcli.messages import heard
from dmpcli.records import dataset, file_io, pairs
from dmpcli.records.learning_record import surface_key
from dmpcli.records.storage import Location
from dmpcli.reporting.report_surface import ReportSurface
from dmpcli.reporting.stroke_measures import Row
from dmpcli.surfaces.mesh import Mesh
from dmpcli.workflows.generalize_sites import SurfaceReader
from dmpcli.workflows.surface_input import store_in
from dmpcli.workflows.table_sites import Otherwise, TableSites


class SiteGrounds:
    """Surfaces by the ids of strokes, read as they are asked for.

    Parameters
    ----------
    path : Path or ObjectPath
        Of the table that a batch was drawn from.
    otherwise : Otherwise
        What the command line says where the table says nothing.
    cache : str, optional
        Folder of prepared meshes.

    Raises
    ------
    InputError
        The table cannot be read, or names no surfaces.
    """

    def __init__(self, path: Location, otherwise: Otherwise, cache: str | None = None) -> None:
        source = file_io.read(path)
        table = pairs.read(source)
        if table.places is None:
            raise InputError(
                f"{path}: names no surfaces: it needs a column 'surface'; for one surface of all "
                "strokes give --surface alone"
            )
        folder = Path() if str(path) == file_io.DASH else path.parent
        found = TableSites(folder, otherwise).of(table)
        self.name, self.sha256 = source.name, source.sha256
        self._sites = found.sites
        self._of: dict[str, int] = dict(zip(table.ids, found.of.tolist(), strict=True))
        self._status = dict(zip(table.ids, table.status, strict=True))
        self._reader = SurfaceReader(store_in(cache))
        self._hashes: dict[str, str] = {}
        self._lock = threading.Lock()

    def __getstate__(self) -> dict[str, Any]:
        # A lock stays where it is; another process has its own.
        return {name: value for name, value in vars(self).items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._lock = threading.Lock()

    @property
    def said(self) -> Row:
        """What the report's document says of them."""
        number = len({site.surface.path for site in self._sites})
        return {"file": Path(self.name).name, "sha256": self.sha256, "surfaces": number}

    def belongs(self, batch: dataset.BatchFolder) -> None:
        """Refuse a batch that was not drawn from this table.

        Raises
        ------
        InputError
        """
        drawn_from = [e["sha256"] for e in batch.provenance.inputs if e.get("role") == "pairs"]
        if drawn_from != [self.sha256]:
            raise InputError(
                f"{batch.folder}: was drawn from another table than {self.name}; give that one"
            )
        self._hashes |= dataset.surfaces_of(batch)

    def of(self, ids: Sequence[str]) -> Integers:
        """Return which surface each stroke lies on, shape (k,); copies and pieces as their pair.

        Raises
        ------
        InputError
            The table does not say it of one of them.
        """
        return np.array([self._one(name) for name in ids], dtype=np.int64)

    def _one(self, name: str) -> int:
        piece, copy = name.rpartition(".")[0], name.rpartition("_")[0]
        for said in (name, piece, copy, piece.rpartition("_")[0]):
            if said in self._of:
                if self._of[said] < 0:
                    raise InputError(f"{self.name}: {self._status[said]}")
                return self._of[said]
        raise InputError(f"{self.name}: has no pair {name!r}, which the batch holds")

    def ground(self, number: int) -> ReportSurface:
        """Return a surface; several threads may ask at once.

        Raises
        ------
        InputError
            It cannot be read, or is another one than the strokes were drawn on.
        """
        site: Site = self._sites[number]
        with self._lock, heard():
            read, _ = self._reader.read(site)
        drawn_on = self._hashes.get(site.surface.name, read.sha256)
        if drawn_on != read.sha256:
            raise InputError(
                f"{site.surface.name}: has changed since the batch was drawn on it; draw it again"
            )
        surface = read.surface
        V, F = (surface.V, surface.F) if isinstance(surface, Mesh) else (None, None)
        return ReportSurface(site.surface.name, surface, V, F, surface_key(read.facts))

"""Files of the words with which a table says where its pairs lie.

They are looked for, not read: a table of thousands is checked before any of its surfaces is.
"""

import contextlib
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dmpcli.batch.site import PairSites, Site, SiteFile
from dmpcli.errors import InputError
from dmpcli.records import pose
from dmpcli.records.pair_places import PairPlaces, Place
from dmpcli.records.pairs import PairTable
from dmpcli.records.schemas import OK
from dmpcli.records.storage import Location, beside, located

POSE_COLUMN = "column 'pose'"
"""What messages call a pose that a table names."""


@dataclass(frozen=True)
class Otherwise:
    """What the command line says where a table says nothing.

    Attributes
    ----------
    surface : str or None
    pose, unit : str or None
    axes : {'base', 'part'}
    offset : float
        mm.
    """

    surface: str | None = None
    pose: str | None = None
    unit: str | None = None
    axes: str = "base"
    offset: float = 0.0


@dataclass(frozen=True)
class TableSites:
    """Finds the files of the places of one table, whole or piece by piece; each place once.

    Attributes
    ----------
    folder : Path or ObjectPath
        That relative names start from.
    otherwise : Otherwise
    """

    folder: Location
    otherwise: Otherwise
    _found: dict[Place, Site | str] = field(default_factory=dict, repr=False)

    def of(self, table: PairTable) -> PairSites:
        """Make files of a table's words; what is wrong with them goes into the status of its rows.

        Parameters
        ----------
        table : PairTable
            With places.
        """
        assert table.places is not None
        sites, of = self.at(table.places), table.places.of
        for row in np.flatnonzero(sites.of < 0).tolist():
            if table.status[row] == OK:
                why = self._found[table.places.places[of[row]]]
                table.status[row] = f"{table.place(row)}, pair {table.ids[row]}: {why}"
        return sites

    def at(self, places: PairPlaces) -> PairSites:
        """Make files of the words of places; those that cannot be have no site."""
        sites: list[Site] = []
        number = np.full(len(places.places), -1)
        for i, place in enumerate(places.places):
            if place not in self._found:
                try:
                    self._found[place] = _site(place, self.folder, self.otherwise)
                except InputError as error:
                    self._found[place] = str(error)
            site = self._found[place]
            if isinstance(site, Site):
                number[i] = len(sites)
                sites.append(site)
        return PairSites(sites, number[places.of])


def _site(place: Place, folder: Location, otherwise: Otherwise) -> Site:
    if place.surface:
        surface = _file(place.surface, folder)
    elif otherwise.surface is not None:
        given = located(otherwise.surface).absolute()
        surface = SiteFile(str(given), given.name)
    else:
        raise InputError(
            "says where a surface lies, but not which: name it in column 'surface', or for all "
            "such rows with --surface"
        )
    at: SiteFile | str | None = None
    if place.pose or otherwise.pose:
        words = place.pose or otherwise.pose or ""
        at = words if _begins_with_number(words) else _file(words, folder if place.pose else Path())
        if isinstance(at, str):
            pose.parse(at, POSE_COLUMN if place.pose else "--surface-pose")
    lift = otherwise.offset if place.offset is None else place.offset
    return Site(surface, place.unit or otherwise.unit, at, place.axes or otherwise.axes, lift)


def _begins_with_number(words: str) -> bool:
    try:
        float(words.split()[0])
    except (ValueError, IndexError):
        return False
    return True


def _file(name: str, folder: Location) -> SiteFile:
    """Return a file that must be there.

    Raises
    ------
    InputError
        It is not, or cannot be read.
    """
    path = beside(folder, name).absolute()
    if not path.exists():
        meant = _meant(name, folder)
        raise InputError(
            f"{name}: no such file; "
            + (f"did you mean {meant}?" if meant else "names are relative to the table's folder")
        )
    if not path.is_file() or (isinstance(path, Path) and not os.access(path, os.R_OK)):
        raise InputError(f"{name}: is no file that can be read")
    return SiteFile(str(path), name)


def _meant(name: str, folder: Location) -> str | None:
    """Return a file of this machine that has the name but for slashes and capitals."""
    if not isinstance(folder, Path):
        return None
    plain = Path(name.replace("\\", "/"))
    with contextlib.suppress(OSError):
        for one in sorted((folder / plain).parent.iterdir()):
            if one.name.casefold() == plain.name.casefold():
                return str(plain.with_name(one.name))
    return None

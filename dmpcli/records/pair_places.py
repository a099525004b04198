"""Where each pair of a table lies: its surface with unit and pose, whose axes, how high.

The words of the table are kept as they stand; `workflows` makes files of them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import Booleans, Floats, Integers, first_seen
from dmpcli.records.layouts import LENGTH
from dmpcli.records.schemas import OK
from dmpcli.records.table import Table, is_text

COLUMNS = ("surface", "surface_unit", "pose", "in", "offset")

POSE_CELLS = tuple(f"pose[{i}]" for i in range(6))
"""What a column of lists becomes that holds a pose in each row, see `list_columns`."""

_BRACKETS = "[]()"

AXES = ("base", "part")
"""In whose axes a pair is given: the robot's base, or the surface's own."""

FARTHEST_OFFSET = 1e3
"""Stand-offs beyond this, mm, are a mistake."""


@dataclass(frozen=True)
class Place:
    """Where pairs lie, in the words of a table; an empty one where it says nothing.

    Attributes
    ----------
    surface : str
        File, relative to the table.
    unit : str
        Of its lengths.
    pose : str
        A file, relative to the table, or ``X Y Z RX RY RZ``.
    axes : str
        Of `AXES`.
    offset : float or None
        Off the surface, mm.
    """

    surface: str = ""
    unit: str = ""
    pose: str = ""
    axes: str = ""
    offset: float | None = None


@dataclass(frozen=True)
class PairPlaces:
    """The places of a table of B pairs.

    Attributes
    ----------
    columns : list of str
        Which of `COLUMNS` the table has.
    places : list of Place
        All different, in the order in which the table first names them.
    of : array of int, shape (B,)
        The place of each pair.
    """

    columns: list[str]
    places: list[Place]
    of: Integers


def read(table: Table, status: list[str]) -> PairPlaces | None:
    """Return the places of a table; None where it names none.

    Parameters
    ----------
    table : Table
    status : list of str
        Of each row; what is wrong with a place is written into it.
    """
    present = [name for name in COLUMNS if name in table.columns]
    if "pose" not in present and all(name in table.columns for name in POSE_CELLS):
        present = [name for name in COLUMNS if name in (*present, "pose")]
    if not present:
        return None
    codes, words = [], []
    for name in COLUMNS:
        code, known = _coded(table, name) if name in present else (None, [""])
        codes.append(np.zeros(len(table), dtype=np.int64) if code is None else code)
        words.append(known)
    stacked = np.stack(codes, axis=1)
    joined = np.ravel_multi_index(tuple(stacked.T), tuple(len(known) for known in words))
    of, first = first_seen(joined)
    places = []
    for i, row in enumerate(first.tolist()):
        said = dict(
            zip(COLUMNS, (w[c] for w, c in zip(words, stacked[row], strict=True)), strict=True)
        )
        place, odd = _place(said, table.decimal)
        places.append(place)
        if odd is not None:
            column, what = odd
            _mark(table, status, of == i, column, what)
    return PairPlaces(present, places, of)


def _coded(table: Table, name: str) -> tuple[Integers, list[str]]:
    """Number of each row's word, shape (rows,), and the words, without blanks about them."""
    import pyarrow.compute as pc

    if name not in table.columns:
        values = pa.array([_words(row) for row in np.stack(_pose_cells(table), axis=1).tolist()])
    else:
        values = table.columns[name]
        if isinstance(values, np.ndarray) or not is_text(values.type):
            values = pa.array([_word(value) for value in values.tolist()])
    words = pc.utf8_trim_whitespace(values.fill_null("")).dictionary_encode()
    return np.asarray(words.indices).astype(np.int64), words.dictionary.to_pylist()


def _pose_cells(table: Table) -> list[Floats]:
    return [table.floats(name) for name in POSE_CELLS]


def _word(value: Any) -> str:
    """Return the cell of a column that is not of text as text; NaN is an empty one, as null is."""
    if value is None or value != value:
        return ""
    return _words(value) if isinstance(value, list) else str(value)


def _words(values: list[Any]) -> str:
    return " ".join(map(str, values))


def _pose(said: str) -> str:
    """Return six numbers as a command line has them, however a table parts them.

    Lists written as text come with brackets and commas; where blanks part the numbers, a comma in
    one of them is a decimal sign. What is not six numbers stays as it is: the name of a file.
    """
    bare = said.strip(_BRACKETS)
    for words in (bare.split(), bare.split(","), bare.replace(",", ".").split()):
        if len(words) == 6 and all(_number(word) is not None for word in words):
            return " ".join(word.strip() for word in words)
    return said


def _place(said: dict[str, str], decimal: str) -> tuple[Place, tuple[str, str] | None]:
    """Return a place, and which of its words is none and why."""
    odd: tuple[str, str] | None = None
    if said["surface_unit"] not in ("", *LENGTH):
        odd = "surface_unit", f"is none of {', '.join(LENGTH)}"
    if said["in"] not in ("", *AXES):
        odd = odd or ("in", f"is neither {' nor '.join(AXES)}")
    offset = None
    if said["offset"]:
        offset = _number(said["offset"].replace(decimal, "."))
        if offset is None or not abs(offset) <= FARTHEST_OFFSET:
            odd = odd or ("offset", f"is no number of mm up to {FARTHEST_OFFSET:g}")
            offset = None
    place = Place(said["surface"], said["surface_unit"], _pose(said["pose"]), said["in"], offset)
    return place, odd


def _number(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def _mark(table: Table, status: list[str], bad: Booleans, column: str, what: str) -> None:
    for row in np.flatnonzero(bad).tolist():
        if status[row] == OK:
            status[row] = f"{table.at(row)}, column {column!r}: {table.shown(column, row)} {what}"

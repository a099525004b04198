"""Triangles of PLY files, text and binary: faces of any number of corners, triangle strips.

Read here: trimesh leaves rows of text that are too short out, knows no strips, and takes no faces
of five corners and more.
"""

import re
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dmpcli.arrays import AnyArray, Floats, Integers
from dmpcli.errors import InputError
from dmpcli.records import mesh_polygons, mesh_rows
from dmpcli.records.file_io import Source
from dmpcli.records.mesh_polygons import Triangles

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_INDICES = ("vertex_indices", "vertex_index")


@dataclass
class _Element:
    """An element of the header: its number of rows, and its properties (name, type, length's type).

    The length's type is empty for what is no list.
    """

    name: str
    rows: int
    properties: list[tuple[str, str, str]] = field(default_factory=list)

    @property
    def lists(self) -> list[str]:
        return [name for name, _, size in self.properties if size]

    @property
    def least(self) -> int:
        """Fewest bytes that a row can have."""
        return sum(np.dtype(size or kind).itemsize for _, kind, size in self.properties)

    def indices(self, name: str) -> str:
        """Name of the list that holds vertices."""
        for known in _INDICES:
            if known in self.lists:
                return known
        if len(self.lists) == 1:
            return self.lists[0]
        raise InputError(
            f"{name}: its element {self.name} holds no list of vertices; export the part again"
        )


def suits(source: Source) -> bool:
    """Tell whether it begins as a PLY file does."""
    return source.content[:512].lstrip()[:3].lower() == b"ply"


def read(source: Source) -> Triangles:
    """Read a PLY file: vertices, faces and triangle strips, whatever else it holds.

    Raises
    ------
    InputError
        A damaged header, truncated, or too large; by the element, and in text by the line.
    """
    order, elements, start, lines = _header(source)
    V, corners, counts = np.empty((0, 3)), [np.empty(0, dtype=np.int64)], [np.empty(0, np.int64)]
    reader = _Text(source, start, lines) if order == "" else _Binary(source, start, order)
    for element in elements:
        if element.name == "vertex":
            V = reader.places(element)
        elif element.name in ("face", "tristrips") and element.rows:
            found = reader.lists(element, element.indices(source.name))
            if element.name == "tristrips":
                found = _strips(found[0], found[1])
            corners.append(found[0])
            counts.append(found[1])
        else:
            reader.skip(element)
    return mesh_polygons.cut(source.name, V, np.concatenate(corners), np.concatenate(counts))


def _header(source: Source) -> tuple[str, list[_Element], int, int]:
    """Byte order ('' for text), elements, and where the rows begin: in bytes and in lines."""
    end = re.search(rb"^[ \t]*end_header[ \t]*(\r\n|\n|\r|$)", source.content, re.MULTILINE)
    if end is None or end.start() > 2**20:
        raise _damaged(source.name, "its header has no end")
    order, elements = None, list[_Element]()
    head = source.content[: end.start()].decode("latin-1").splitlines()
    for number, line in enumerate(head, start=1):
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _FORMATS[words[1]]
            elif words[:1] == ["element"]:
                rows = int(words[2])
                if rows < 0:
                    raise ValueError
                elements.append(_Element(words[1], rows))
            elif words[:2] == ["property", "list"]:
                size, kind = _TYPES[words[2]], _TYPES[words[3]]
                elements[-1].properties.append((words[4], kind, size))
            elif words[:1] == ["property"]:
                elements[-1].properties.append((words[2], _TYPES[words[1]], ""))
        except (KeyError, IndexError, ValueError):
            raise _damaged(source.name, f"line {number} of its header is wrong") from None
    if order is None:
        raise _damaged(source.name, "its header names no format")
    return order, elements, end.end(), len(head) + 1


def _damaged(name: str, reason: str) -> InputError:
    return InputError(f"{name}: cannot be read as PLY: {reason}; export the part again")


def _strips(indices: Integers, counts: Integers) -> tuple[Integers, Integers]:
    """Triangles of strips: every three in a row, wound alike; -1 begins a new strip."""
    begins = indices == -1
    strip = (np.repeat(np.arange(len(counts)), counts) + np.cumsum(begins))[~begins]
    indices = indices[~begins]
    odd = (np.arange(len(strip)) - np.searchsorted(strip, strip)) % 2 == 1
    F = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
    F[odd[:-2]] = F[odd[:-2]][:, [1, 0, 2]]
    F = F[strip[2:] == strip[:-2]]
    # A strip turns a corner by naming a vertex twice: such triangles are not meant to be any.
    meant = (F[:, 0] != F[:, 1]) & (F[:, 1] != F[:, 2]) & (F[:, 2] != F[:, 0])
    return F[meant].reshape(-1), np.full(int(meant.sum()), 3)


class _Text:
    """Reader of the rows of a text PLY, element after element."""

    def __init__(self, source: Source, start: int, lines: int) -> None:
        self._name = source.name
        self._rows = mesh_rows.rows(source.name, source.content[start:], lines)
        self._first = 0

    def skip(self, element: _Element) -> None:
        """Pass an element over."""
        self._first += element.rows if element.properties else 0

    def places(self, element: _Element) -> Floats:
        """Positions (n, 3)."""
        at = _at(self._name, element)
        width = len(element.properties)
        found = self._rows.table(self._first, element.rows, width, element.name)
        self.skip(element)
        return found[:, at]

    def lists(self, element: _Element, wanted: str) -> tuple[Integers, Integers]:
        """Numbers of a list property, and how many in each row."""
        names = [name for name, _, _ in element.properties]
        before = names.index(wanted)
        if any(size for _, _, size in element.properties[:before]):
            raise _damaged(self._name, f"in {element.name} a list stands before {wanted}")
        found = self._rows.lists(self._first, element.rows, before, element.name)
        self.skip(element)
        return found


def _at(name: str, element: _Element) -> list[int]:
    """Places of x, y and z among the properties of the vertices."""
    names = [key for key, _, size in element.properties if not size]
    if element.lists or not {"x", "y", "z"} <= set(names):
        raise _damaged(name, "its vertices are not x, y and z")
    return [names.index(axis) for axis in "xyz"]


class _Binary:
    """Reader of the rows of a binary PLY, element after element."""

    def __init__(self, source: Source, start: int, order: str) -> None:
        self._name, self._content, self._at, self._order = source.name, source.content, start, order

    def skip(self, element: _Element) -> None:
        """Pass an element over."""
        if element.lists:
            self.lists(element, element.lists[0])
        else:
            self._fixed(element)

    def places(self, element: _Element) -> Floats:
        """Positions (n, 3)."""
        at = _at(self._name, element)
        found = self._fixed(element)
        with np.errstate(invalid="ignore"):  # what is no number is named where the mesh is mended
            return np.stack([found[str(i)].astype(float) for i in at], axis=1)

    def _fixed(self, element: _Element) -> AnyArray:
        self._room(element)
        kinds = [(str(i), self._order + kind) for i, (_, kind, _) in enumerate(element.properties)]
        if not kinds:
            return np.empty(0)
        found = np.frombuffer(self._content, np.dtype(kinds), element.rows, self._at)
        self._at += found.nbytes
        return found

    def _room(self, element: _Element) -> None:
        """Refuse more rows than there are bytes for, before memory is taken for them."""
        left = len(self._content) - self._at
        if element.rows * element.least > left:
            raise InputError(
                f"{self._name}: its header announces {element.rows} rows of {element.name}, but "
                f"{left // max(element.least, 1)} at most follow: truncated or damaged; export the "
                "part again"
            )

    def lists(self, element: _Element, wanted: str) -> tuple[Integers, Integers]:
        """Numbers of a list property, and how many in each row."""
        self._room(element)
        if element.rows == 0:
            return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
        alike = self._alike(element, wanted)
        return self._walked(element, wanted) if alike is None else alike

    def _alike(self, element: _Element, wanted: str) -> tuple[Integers, Integers] | None:
        """As `lists`, where all rows have lists as long as the first row's; else None."""
        kinds, at = list[Any](), self._at
        for i, (_, kind, size) in enumerate(element.properties):
            if not size:
                kinds.append((f"{i}", self._order + kind))
                at += np.dtype(kind).itemsize
                continue
            count = self._number(at, size)
            kinds += [(f"n{i}", self._order + size), (f"{i}", self._order + kind, (count,))]
            at += np.dtype(size).itemsize + count * np.dtype(kind).itemsize
        row = np.dtype(kinds)
        if element.rows * row.itemsize > len(self._content) - self._at:
            return None
        found = np.frombuffer(self._content, row, element.rows, self._at)
        sizes = [f"n{i}" for i, (_, _, size) in enumerate(element.properties) if size]
        if any((found[size] != found[size][0]).any() for size in sizes):
            return None
        self._at += found.nbytes
        key = [name for name, _, _ in element.properties].index(wanted)
        with np.errstate(invalid="ignore"):  # as no vertex is called, which is told
            indices = found[f"{key}"].astype(np.int64)
        return indices.reshape(-1), np.full(element.rows, indices.shape[1])

    def _walked(self, element: _Element, wanted: str) -> tuple[Integers, Integers]:
        """As `lists`, row by row."""
        starts, counts, at = [], [], self._at
        steps = [
            (np.dtype(kind).itemsize, size, np.dtype(size or "u1").itemsize, name == wanted)
            for name, kind, size in element.properties
        ]
        for _ in range(element.rows):
            for width, size, own, this in steps:
                if not size:
                    at += width
                    continue
                count = self._number(at, size)
                at += own
                if this:
                    starts.append(at)
                    counts.append(count)
                at += count * width
        if at > len(self._content):
            raise _damaged(self._name, f"its rows of {element.name} are truncated")
        self._at = at
        kind = np.dtype(
            self._order + next(k for name, k, _ in element.properties if name == wanted)
        )
        number = np.array(counts, dtype=np.int64)
        ends = np.cumsum(number)
        within = np.arange(ends[-1]) - np.repeat(ends - number, number)
        place = np.repeat(np.array(starts, dtype=np.int64), number) + kind.itemsize * within
        letters = np.frombuffer(self._content, dtype=np.uint8)
        found = letters[place[:, None] + np.arange(kind.itemsize)].copy().view(kind)[:, 0]
        return found.astype(np.int64), number

    def _number(self, at: int, size: str) -> int:
        """Length of a list, which stands at a byte of the content."""
        if size == "u1" and at < len(self._content):
            return self._content[at]
        try:
            count = struct.unpack_from(self._order + _CODES[size], self._content, at)[0]
        except struct.error:
            count = -1
        if count != int(count) or not 0 <= count <= len(self._content):
            raise _damaged(self._name, "a list is truncated, or has no length")
        return int(count)


_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}

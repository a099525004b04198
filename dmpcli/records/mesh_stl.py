"""Triangles of STL files, binary and text.

Read here: numpy maps a binary STL in a twentieth of the time that importing trimesh takes.
"""

import re
from collections.abc import Callable
from itertools import islice

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError, counted
from dmpcli.records.file_io import Source
from dmpcli.records.mesh_polygons import Triangles, judge

_HEADER = 84
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_FACET_END = re.compile(rb"\bendfacet\b", re.IGNORECASE)
_AT_ONCE = 300_000


def is_binary(source: Source) -> bool:
    """Tell whether it is as long as its number of facets says, or has facets and then some."""
    content = source.content
    if len(content) < _HEADER:
        return False
    size = _size(content)
    return len(content) == size or (len(content) < 2 * size and _are_facets(content))


def is_text(source: Source) -> bool:
    """Tell whether it begins as a text STL does; binary ones may begin with the same word."""
    # Some programs fill the last block of the file up.
    content = source.content
    return (
        content[:512].lstrip()[:5].lower() == b"solid"
        and content.find(b"\0", 0, len(content.rstrip(b"\0\x1a"))) < 0
    )


def _count(content: bytes) -> int:
    """Return how many facets a binary STL says it holds."""
    return int.from_bytes(content[80:_HEADER], "little") if len(content) >= _HEADER else 0


def _size(content: bytes) -> int:
    return _HEADER + _count(content) * _FACET.itemsize


def _are_facets(content: bytes) -> bool:
    """Tell whether what would be facets has normals of length 1 or 0, as no other file has."""
    if not 0 < _count(content) <= (len(content) - _HEADER) // _FACET.itemsize:
        return False
    facets = np.frombuffer(content, _FACET, count=min(_count(content), 1000), offset=_HEADER)
    with np.errstate(all="ignore"):
        size = np.sqrt(np.sum(facets["normal"].astype(float) ** 2, axis=1))
    return bool(((size == 0.0) | (np.abs(size - 1.0) < 1e-2)).all())


def binary(source: Source) -> Triangles:
    """Read a binary STL. What follows its facets is passed over with a remark.

    Raises
    ------
    InputError
        Truncated, or too large.
    """
    content = source.content
    count, size = _count(content), _size(content)
    if len(content) < size or (count == 0 and len(content) > size):
        raise InputError(
            f"{source.name}: as a binary STL of {count} facets it would have {size} bytes, but "
            f"has {len(content)}: truncated or damaged; export the part again"
        )
    judge(source.name, count)
    corners = np.frombuffer(content, _FACET, count=count, offset=_HEADER)["corners"]
    extra = len(content) - size
    remarks = []
    if extra:
        whole, rest = divmod(extra, _FACET.itemsize)
        looks = f", enough for {counted(whole, 'more facet')}" if whole and not rest else ""
        remarks.append(
            f"{counted(extra, 'byte')} after the {counted(count, 'facet')} of its header passed "
            f"over{looks}"
        )
    with np.errstate(invalid="ignore"):  # places that are no numbers are named where it is mended
        return _soup(corners.reshape(-1, 3).astype(float), remarks)


def text(source: Source) -> Triangles:
    """Read a text STL of one solid or several.

    Raises
    ------
    InputError
        Truncated, too large, or a number that is none, with its line.
    """
    content = source.content
    # After its name: a solid may be called anything.
    first = content.find(b"\n") + 1
    facets = sum(1 for _ in _FACET_END.finditer(content, first))
    judge(source.name, facets)
    ended = re.search(rb"\bendsolid\b", content[first:], re.IGNORECASE) is not None
    V, corners = np.empty((3 * facets, 3)), 0
    found = _VERTEX.finditer(content, first)
    # A few at a time: as words they take ten times the memory.
    while batch := [match.groups() for match in islice(found, _AT_ONCE)]:
        try:
            V[corners : corners + len(batch)] = np.array(batch).astype(float)[
                : 3 * facets - corners
            ]
        except ValueError:
            raise InputError(
                f"{source.name}: line {_line_of(content, _VERTEX, _is_numbers)}: a vertex needs "
                "three numbers; mend the line, or export the part again"
            ) from None
        corners += len(batch)
    if not ended or corners != 3 * facets:
        raise InputError(
            f"{source.name}: a text STL with {corners} vertices in {facets} whole facets"
            + ("" if ended else " and no endsolid")
            + ": truncated or damaged; export the part again"
        )
    return _soup(V, [])


def _soup(V: Floats, remarks: list[str]) -> Triangles:
    return Triangles(V, np.arange(len(V)).reshape(-1, 3), remarks)


def _is_numbers(match: "re.Match[bytes]") -> bool:
    try:
        return bool([float(word) for word in match.groups()])
    except ValueError:
        return False


def _line_of(
    content: bytes, pattern: "re.Pattern[bytes]", good: Callable[["re.Match[bytes]"], bool]
) -> int:
    """Return the line, counted from 1, of the first match that is not good."""
    at = next((m.start() for m in pattern.finditer(content) if not good(m)), 0)
    return content.count(b"\n", 0, at) + 1

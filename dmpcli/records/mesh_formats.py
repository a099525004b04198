"""Triangles as they stand in STL, OBJ and PLY files; the content decides, not the name's ending.

PLY is read by trimesh. STL and OBJ are read here: numpy maps a binary STL in a twentieth of the
time that importing trimesh takes, and trimesh's OBJ reader turns index 0 into the last vertex, lets
faces of two corners vanish and doubles vertices along texture seams, all without a word.
"""

import re
import warnings
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.errors import InputError
from dmpcli.records.streams import Source

Triangles = tuple[Floats, Integers]
"""V (n, 3) in the file's unit, and F (m, 3): indices into V, not checked yet."""

_HEADER = 84
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_OBJ_LINE = re.compile(rb"^[ \t]*[vf][ \t]+\S", re.MULTILINE)


def triangles(source: Source) -> Triangles:
    """Read the triangles of an STL (binary or text), OBJ or PLY file as they stand.

    Polygons of more than three corners are cut into triangles. The facets of an STL share no
    vertices yet.

    Raises
    ------
    InputError
        Not one of these formats, truncated, or a number that is none; names the line in text.
    """
    return _reader(source)(source)


def format_of(source: Source) -> str | None:
    """Name the format of a mesh file by its content; None for what is no mesh."""
    try:
        return _NAMES[_reader(source)]
    except InputError:
        return None


def _reader(source: Source) -> Callable[[Source], Triangles]:
    content = source.content
    start = content[:512].lstrip()[:5].lower()
    if start[:3] == b"ply":
        return _ply
    if len(content) >= _HEADER and len(content) == _HEADER + _facets(content) * _FACET.itemsize:
        return _binary_stl
    if start == b"solid" and b"\0" not in content:
        return _text_stl
    if source.name.lower().endswith(".stl"):
        return _binary_stl
    if b"\0" not in content and _OBJ_LINE.search(content):
        return _obj
    raise InputError(
        f"{source.name}: is neither a mesh (STL, OBJ or PLY) nor a plane file (JSON); "
        "export the part as one of these"
    )


def _facets(content: bytes) -> int:
    """Return how many facets a binary STL says it holds."""
    return int.from_bytes(content[80:_HEADER], "little")


def _binary_stl(source: Source) -> Triangles:
    content = source.content
    count = _facets(content) if len(content) >= _HEADER else 0
    size = _HEADER + count * _FACET.itemsize
    if len(content) != size:
        raise InputError(
            f"{source.name}: as a binary STL of {count} facets it would have {size} bytes, but "
            f"has {len(content)}: truncated or damaged; export the part again"
        )
    corners = np.frombuffer(content, dtype=_FACET, offset=_HEADER)["corners"]
    return _soup(corners.reshape(-1, 3).astype(float))


def _text_stl(source: Source) -> Triangles:
    text = source.content
    # After its name: a solid may be called anything.
    body = text[text.find(b"\n") + 1 :].lower()
    facets = len(re.findall(rb"\bendfacet\b", body))
    corners = _VERTEX.findall(body)
    if b"endsolid" not in body or len(corners) != 3 * facets:
        raise InputError(
            f"{source.name}: a text STL with {len(corners)} vertices in {facets} whole facets"
            + ("" if b"endsolid" in body else " and no endsolid")
            + ": truncated or damaged; export the part again"
        )
    try:
        V = np.array(corners).astype(float).reshape(-1, 3)
    except ValueError:
        raise InputError(
            f"{source.name}: line {_line_of(text, _VERTEX, _is_numbers)}: a vertex needs three "
            "numbers; mend the line, or export the part again"
        ) from None
    return _soup(V)


def _soup(V: Floats) -> Triangles:
    return V, np.arange(len(V)).reshape(-1, 3)


def _is_numbers(match: "re.Match[bytes]") -> bool:
    try:
        return bool([float(word) for word in match.groups()])
    except ValueError:
        return False


def _line_of(
    text: bytes, pattern: "re.Pattern[bytes]", good: Callable[["re.Match[bytes]"], bool]
) -> int:
    """Return the line, counted from 1, of the first match that is not good."""
    at = next((m.start() for m in pattern.finditer(text) if not good(m)), 0)
    return text.count(b"\n", 0, at) + 1


def _obj(source: Source) -> Triangles:
    V: list[list[float]] = []
    F: list[tuple[int, int, int]] = []
    # A line that ends in a backslash goes on in the next one.
    lines = source.content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines()
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words or words[0] not in (b"v", b"f"):
            continue
        try:
            if words[0] == b"v":
                x, y, z = words[1:4]
                V.append([float(x), float(y), float(z)])
                continue
            a, *others = (_obj_index(word, len(V)) for word in words[1:])
            if len(others) < 2:
                raise ValueError
        except ValueError:
            need = "three numbers" if words[0] == b"v" else "three vertices or more, from 1"
            kind = "vertex" if words[0] == b"v" else "face"
            raise InputError(
                f"{source.name}: line {number}: a {kind} needs {need}; mend the line, or export "
                "the part again"
            ) from None
        F += [(a, b, c) for b, c in pairwise(others)]
    return np.array(V, dtype=float).reshape(-1, 3), np.array(F, dtype=np.int64).reshape(-1, 3)


def _obj_index(word: bytes, vertices: int) -> int:
    """Index from 0 of an OBJ corner: ``7``, ``7/2/5``, or counted back from the last vertex."""
    index = int(word.partition(b"/")[0])
    if index == 0 or index < -vertices or index > 2**31:
        raise ValueError
    return index - 1 if index > 0 else vertices + index


def _ply(source: Source) -> Triangles:
    from trimesh.exchange.ply import load_ply

    _check_ply_rows(source)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = load_ply(source.open())
        V = np.array(found.get("vertices", ()), dtype=float).reshape(-1, 3)
        F = np.array(found.get("faces", ()), dtype=np.int64)
    # Whatever trimesh stumbles over in a damaged file, it is the file that is at fault.
    except Exception as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"{source.name}: cannot be read as PLY: {reason}; export the part again"
        ) from None
    if F.ndim == 2 and F.shape[1] == 4:
        F = np.concatenate([F[:, [0, 1, 2]], F[:, [0, 2, 3]]])
    return V, F.reshape(-1, 3)


def _check_ply_rows(source: Source) -> None:
    """Refuse a text PLY whose rows are fewer or shorter than its header says.

    trimesh leaves such faces out without a word.
    """
    header, end, body = source.content.partition(b"end_header")
    if not end or b"format ascii" not in header:
        return
    rows = [row.split() for row in body.splitlines() if row.strip()]
    first = 0
    for element in re.split(rb"^element\s+", header, flags=re.MULTILINE)[1:]:
        said = re.match(rb"(\S+)\s+(\d{1,12})", element)
        name, wanted = (said[1], int(said[2])) if said else (b"?", 0)
        properties = re.findall(rb"^property\s+(\S+)", element, re.MULTILINE)
        lists = properties[:1] == [b"list"]
        found = rows[first : first + wanted]
        short = ((lists and not _is_list(row)) or len(row) < len(properties) for row in found)
        row = next((i for i, bad in enumerate(short) if bad), len(found))
        if row < wanted:
            raise InputError(
                f"{source.name}: its header announces {wanted} rows of {name.decode('latin-1')}, "
                f"but {row} whole ones follow: truncated or damaged; export the part again"
            )
        first += wanted


def _is_list(words: list[bytes]) -> bool:
    """Tell whether a row holds as many words as its first one says."""
    return words[0].isdigit() and len(words) > int(words[0])


_NAMES: dict[Callable[[Source], Triangles], str] = {
    _binary_stl: "binary STL",
    _text_stl: "text STL",
    _obj: "OBJ",
    _ply: "PLY",
}

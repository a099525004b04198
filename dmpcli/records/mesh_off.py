"""Triangles of OFF files (Geomview's Object File Format), with colours, normals or neither."""

import re

import numpy as np

from dmpcli.errors import InputError
from dmpcli.records import mesh_polygons, mesh_rows
from dmpcli.records.file_io import Source
from dmpcli.records.mesh_polygons import Triangles

# Some files have their counts on the line of the word, or without a gap after it.
_HEAD = re.compile(rb"\s*(?:ST)?C?N?(4?n?)OFF(?=[\s\d]|$)[ \t]*(BINARY)?", re.ASCII)
_COMMENT = re.compile(rb"#[^\r\n]*")


def suits(source: Source) -> bool:
    """Tell whether it begins as an OFF file does, after comments."""
    start = source.content[:65536]
    return _HEAD.match(_COMMENT.sub(b"", start)) is not None


def read(source: Source) -> Triangles:
    """Read an OFF file: the first three numbers of its vertices, and its faces.

    Raises
    ------
    InputError
        Binary, of four dimensions, too large or damaged; by the line.
    """
    name, content = source.name, source.content
    binary = _HEAD.match(_COMMENT.sub(b"", content[:65536]))
    if binary is not None and binary[2]:
        raise InputError(
            f"{name}: is a binary OFF file, which is not read; export the part as a text OFF, STL, "
            "OBJ or PLY"
        )
    text = _COMMENT.sub(b"", content)
    head = _HEAD.match(text)
    assert head is not None
    if head[1]:
        raise InputError(
            f"{name}: is an OFF file of {head[1].decode()}-dimensional points; export the part in "
            "three dimensions"
        )
    before = len(re.findall(rb"\r\n|\r|\n", text[: head.end()]))
    rows = mesh_rows.rows(name, text[head.end() :], before)
    if len(rows) == 0 or rows.count[0] < 2:
        raise InputError(
            f"{name}: an OFF file without its numbers of vertices and faces: truncated or "
            "damaged; export the part again"
        )
    said = rows.values[rows.start[0] : rows.start[0] + 2]
    if not np.all((said >= 0) & (said < 2.0**53) & (said == np.floor(said))):
        raise InputError(f"{name}: line {rows.line[0]}: its numbers of vertices and faces are none")
    vertices, faces = said.astype(np.int64).tolist()
    V = rows.table(1, vertices, 3, "vertex")
    corners, counts = rows.lists(1 + vertices, faces, 0, "face")
    return mesh_polygons.cut(name, V, corners, counts)

"""Triangles of OBJ files.

Read here: trimesh's reader turns index 0 into the last vertex, lets faces of two corners vanish,
doubles vertices along texture seams and fans polygons over their notches, all without a word.
"""

import re

import numpy as np

from dmpcli.errors import InputError
from dmpcli.records import mesh_polygons
from dmpcli.records.file_io import Source
from dmpcli.records.mesh_polygons import Triangles

_LINE = re.compile(rb"^[ \t]*[vf][ \t]+\S", re.MULTILINE)
_FACE = re.compile(rb"^[ \t]*f[ \t]", re.MULTILINE)


def suits(source: Source) -> bool:
    """Tell whether it is a text with lines of vertices or faces."""
    return b"\0" not in source.content and _LINE.search(source.content) is not None


def read(source: Source) -> Triangles:
    """Read an OBJ file: its vertices and faces, whatever else it holds.

    Raises
    ------
    InputError
        Too large, or a line that is neither; by its number.
    """
    mesh_polygons.judge(source.name, sum(1 for _ in _FACE.finditer(source.content)))
    V: list[list[float]] = []
    corners: list[int] = []
    counts: list[int] = []
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
            face = [_index(word, len(V)) for word in words[1:]]
            if len(face) < 3:
                raise ValueError
        except ValueError:
            need = "three numbers" if words[0] == b"v" else "three vertices or more, from 1"
            kind = "vertex" if words[0] == b"v" else "face"
            raise InputError(
                f"{source.name}: line {number}: a {kind} needs {need}; mend the line, or export "
                "the part again"
            ) from None
        corners += face
        counts.append(len(face))
    places = np.array(V, dtype=float).reshape(-1, 3)
    found = np.array(corners, dtype=np.int64), np.array(counts, dtype=np.int64)
    return mesh_polygons.cut(source.name, places, *found)


def _index(word: bytes, vertices: int) -> int:
    """Index from 0 of an OBJ corner: ``7``, ``7/2/5``, or counted back from the last vertex."""
    index = int(word.partition(b"/")[0])
    if index == 0 or index < -vertices or index > 2**31:
        raise ValueError
    return index - 1 if index > 0 else vertices + index

"""Polylines for viewers of meshes: PLY of vertices and edges, OBJ of vertices and lines; mm.

Formats: Turk, The PLY Polygon File Format (1994), element ``edge``; Wavefront OBJ, element ``l``.
An OBJ line has two vertices each: MeshLab reads no longer ones.
"""

import numpy as np

from dmpcli.arrays import Integers
from dmpcli.formats.motion import Motion


def _edges(motion: Motion) -> Integers:
    """Edges of all strokes, shape (m, 2), from 0; none between strokes."""
    parts, first = [], 0
    for one in motion.strokes:
        number = np.arange(first, first + len(one))
        parts.append(np.column_stack([number[:-1], number[1:]]))
        first += len(one)
    return np.concatenate(parts)


def encode_ply(motion: Motion) -> bytes:
    """Return a binary PLY (little endian, doubles) with time, and normals where there are some."""
    edges = _edges(motion)
    names = ["x", "y", "z"]
    values = [np.concatenate([one.position for one in motion.strokes])]
    if all(one.normal is not None for one in motion.strokes):
        names += ["nx", "ny", "nz"]
        values.append(
            np.concatenate(
                [np.broadcast_to(one.normal, (len(one), 3)) for one in motion.strokes]  # type: ignore[arg-type]
            )
        )
    names.append("t")
    values.append(np.concatenate([one.t for one in motion.strokes])[:, None])
    vertices = np.column_stack(values).astype("<f8")
    head = [
        "ply",
        "format binary_little_endian 1.0",
        "comment unit mm, t in s",
        f"element vertex {len(vertices)}",
        *(f"property double {name}" for name in names),
        f"element edge {len(edges)}",
        "property int vertex1",
        "property int vertex2",
        "end_header",
    ]
    return ("\n".join(head) + "\n").encode() + vertices.tobytes() + edges.astype("<i4").tobytes()


def encode_obj(motion: Motion) -> bytes:
    """Return an OBJ with an object per stroke."""
    lines, first = ["# unit mm"], 1
    for one in motion.strokes:
        lines.append("o " + "_".join(one.id.split()) or "stroke")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in (one.position + 0.0).tolist()]
        lines += [f"l {i} {i + 1}" for i in range(first, first + len(one) - 1)]
        first += len(one)
    return ("\n".join(lines) + "\n").encode()

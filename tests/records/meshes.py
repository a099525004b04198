"""Meshes for tests, whole and with one defect each, and writers that are not ours."""

import numpy as np
import trimesh


def grid(n=9, half=40.0, height=lambda x, y: (x**2 - y**2) / 240.0):
    """A height field of (n-1)² squares, each cut in two; normals up."""
    line = np.linspace(-half, half, n)
    x, y = np.meshgrid(line, line, indexing="ij")
    V = np.stack([x.ravel(), y.ravel(), height(x, y).ravel()], axis=1)
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = (s.ravel() for s in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    return V, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def box(size=(30.0, 20.0, 10.0)):
    made = trimesh.creation.box(size)
    return np.array(made.vertices, dtype=float), np.array(made.faces)


def written(V, F, kind):
    """Bytes of a mesh file as trimesh writes it: stl, stl_ascii, obj, ply or ply_ascii."""
    mesh = trimesh.Trimesh(V, F, process=False, validate=False)
    if kind == "ply_ascii":
        return mesh.export(file_type="ply", encoding="ascii")
    content = mesh.export(file_type=kind)
    return content if isinstance(content, bytes) else content.encode()


def obj(V, F):
    """OBJ text with every digit, and whatever indices are given."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(V, dtype=float).tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in F]
    return ("\n".join(lines) + "\n").encode()

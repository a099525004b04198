"""PLY and OBJ: what another library's reader finds in them."""

import io

import numpy as np
import trimesh

from dmpcli.formats import polylines
from tests.formats.motions import motion, wave

TWO = motion(wave(samples=30), wave(samples=12, offset=200.0, name="b c"))
POINTS = np.concatenate([one.position for one in TWO.strokes])


def test_trimesh_reads_the_vertices_of_the_ply():
    found = trimesh.load(io.BytesIO(polylines.encode_ply(TWO)), file_type="ply")
    np.testing.assert_array_equal(found.vertices, POINTS)


def test_the_ply_joins_the_samples_of_each_stroke_and_none_between():
    content = polylines.encode_ply(TWO)
    head, _, body = content.partition(b"end_header\n")
    assert b"element edge 40\n" in head
    edges = np.frombuffer(body[42 * 4 * 8 :], "<i4").reshape(-1, 2)
    assert [29, 30] not in edges.tolist()
    np.testing.assert_array_equal(edges[:, 1], edges[:, 0] + 1)
    vertices = np.frombuffer(body[: 42 * 4 * 8], "<f8").reshape(-1, 4)
    np.testing.assert_array_equal(vertices[:, 3], np.r_[TWO.strokes[0].t, TWO.strokes[1].t])


def test_trimesh_reads_the_obj_as_a_path_of_two_lines_of_its_length():
    text = polylines.encode_obj(TWO).decode()
    assert all(len(line.split()) == 3 for line in text.splitlines() if line.startswith("l "))
    rows = [line.split() for line in text.splitlines()]
    points = np.array([row[1:] for row in rows if row[0] == "v"], dtype=float)
    np.testing.assert_array_equal(points, POINTS)
    pairs = np.array([row[1:] for row in rows if row[0] == "l"], dtype=int) - 1
    length = np.linalg.norm(points[pairs[:, 1]] - points[pairs[:, 0]], axis=1).sum()
    truth = sum(np.linalg.norm(np.diff(s.position, axis=0), axis=1).sum() for s in TWO.strokes)
    np.testing.assert_allclose(length, truth)
    assert [row[1:] for row in rows if row[0] == "o"] == [["1"], ["b_c"]]

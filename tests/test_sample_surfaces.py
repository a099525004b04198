"""The sample surfaces are what they are said to be, and are made again byte for byte."""

import importlib.util
from pathlib import Path

import igl
import numpy as np
import pytest

from dmpcli.metrics.paper_values import EXPERIMENTS
from dmpcli.records import file_io, mesh

FOLDER = Path(__file__).parents[1] / "sample_runs"
CURVED = np.array([[-551.698, -37.580, -28.765], [-657.597, -43.254, -32.265]])
"""The paper's curved pair, printed to 0.001 mm."""


def script():
    spec = importlib.util.spec_from_file_location("make_surfaces", FOLDER / "make_surfaces.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


MAKER = script()


def kept(name):
    return mesh.decode(file_io.read(FOLDER / f"{name}.stl"))


@pytest.mark.parametrize("name", MAKER.SURFACES)
def test_the_files_in_the_folder_are_those_that_the_script_makes(name):
    content = MAKER.stl(*MAKER.SURFACES[name]())
    assert content == MAKER.stl(*MAKER.SURFACES[name]()), "two runs, the same bytes"
    file = (FOLDER / f"{name}.stl").read_bytes()
    assert len(file) == len(content)
    assert len(file) < 2**20
    # Another processor may round the last digit of a sine otherwise.
    facets = np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")])
    ours, theirs = (np.frombuffer(c, facets, offset=84)["corners"] for c in (content, file))
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-3)


@pytest.mark.parametrize(("name", "pieces"), [("bench", 1), ("saddle", 1), ("scan", 2)])
def test_they_load_without_mending(name, pieces):
    found = kept(name)
    assert found.remarks == []
    assert igl.facet_components(found.F)[0] == pieces


def normals(found):
    corners = found.V[found.F]
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return n / np.linalg.norm(n, axis=1, keepdims=True), corners.mean(axis=1)


def test_the_curved_pair_lies_on_the_fillet_to_the_printed_digits():
    # Exactly: a cylinder of radius 86.774 about the line y = 5.106, z = -17.54 - 86.774.
    distance = np.hypot(CURVED[:, 1] - 5.106, CURVED[:, 2] + 17.54 + 86.774) - 86.774
    assert np.abs(distance).max() < 1e-3
    found = kept("bench")
    chordal = 86.774 * (1.0 - np.cos(np.radians(0.75)))
    squares, _, _ = igl.point_mesh_squared_distance(CURVED, found.V, found.F)
    assert np.sqrt(squares).max() < chordal + 1e-3
    assert chordal < 0.01


def test_the_wave_spans_the_angles_of_the_fillet_that_were_solved_for():
    # Half a wave of 49.979 mm to either side of the start-goal line, along the surface.
    angles = np.degrees(np.arcsin((5.106 - CURVED[:, 1]) / 86.774))
    swing = np.degrees(49.979 / 2.0 / 86.774)
    assert angles.min() - swing == pytest.approx(13.0, abs=0.5)
    assert angles.max() + swing == pytest.approx(50.0, abs=0.5)


def test_the_flat_pairs_lie_on_the_top():
    found = kept("bench")
    points = np.array([end for e in EXPERIMENTS for end in (e.start, e.goal)])
    squares, _, foot = igl.point_mesh_squared_distance(points, found.V, found.F)
    np.testing.assert_allclose(foot[:, 2], -17.54, atol=1e-5)
    assert np.sqrt(squares).max() < 0.03


def test_the_bench_is_made_of_points_of_its_formula_and_faces_outwards():
    found = kept("bench")
    y, z = found.V[:, 1], found.V[:, 2]
    top, side = np.abs(z + 17.54), np.abs(y - (5.106 - 86.774))
    fillet = np.abs(np.hypot(y - 5.106, z + 17.54 + 86.774) - 86.774)
    off = np.where(y >= 5.106, top, np.where(z <= -17.54 - 86.774, side, fillet))
    assert off.max() < 2e-5, "the rounding of a binary STL"
    n, middle = normals(found)
    out = middle[:, 1:] - [5.106, -17.54 - 86.774]
    out = np.where(middle[:, [1]] > 5.106, [0.0, 1.0], out)
    out = np.where(middle[:, [2]] < -17.54 - 86.774, [-1.0, 0.0], out)
    assert (np.sum(n[:, 1:] * out, axis=1) > 0).all()


def test_the_saddle_keeps_its_formula_and_faces_up():
    found = kept("saddle")
    x, y, z = found.V.T
    np.testing.assert_allclose(z, (x**2 - y**2) / 240.0, atol=1e-5)
    assert (normals(found)[0][:, 2] > 0).all()


def test_the_scan_is_rough_as_said_and_has_a_hole():
    found = kept("scan")
    main = found.V[:, 2] < 12.0
    x, y, z = found.V[main].T
    smooth = x**2 / 800.0 - 6.0 * np.exp(-((x - 20.0) ** 2 + (y + 5.0) ** 2) / 1800.0)
    assert np.std(z - smooth) == pytest.approx(0.02, rel=0.05)
    assert (normals(found)[0][:, 2] > 0).all()
    gap = np.hypot((found.V[:, 0] + 50.0) / 9.0, (found.V[:, 1] - 30.0) / 6.0)
    assert gap.min() > 0.8
    assert len(igl.boundary_loop_all(found.F)) == 3

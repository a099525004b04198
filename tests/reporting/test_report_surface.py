"""Wave heights that a report measures along a mesh, against geodesics from other programs."""

from pathlib import Path

import igl
import numpy as np
import potpourri3d
import pytest

from dmpcli.records import file_io
from dmpcli.records import mesh as mesh_file
from dmpcli.reporting.report_surface import ReportSurface, placed
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.surfaces.mesh import Mesh
from tests.surfaces import cases, fields

ROOT = Path(__file__).parents[2]


def sample(name):
    found = mesh_file.decode(file_io.read(ROOT / "sample_runs" / name))
    return Mesh(found.V, found.F)


def stroke(position, start, goal):
    t = np.linspace(0.0, 10.0, len(position))
    names = ("drawn", "trajectory", "modified")
    return ReportedStroke(*names, t, position, position, start, goal, None, False, True, False)


def with_vertices(V, F, points, faces):
    """Mesh with points inside of faces, no two in one, as vertices; their numbers."""
    assert len(set(faces)) == len(faces)
    at = len(V) + np.arange(len(points))
    a, b, c = F[faces].T
    kept = np.delete(F, faces, axis=0)
    parts = [np.stack(t, axis=1) for t in ((a, b, at), (b, c, at), (c, a, at))]
    return np.vstack([V, points]), np.vstack([kept, *parts]), at


def centre_line(mesh, start, goal):
    """Geodesic by flipping edges (N. Sharp, K. Crane: ACM Trans. Graph. 39 (2020) 249)."""
    hits = mesh.closest(np.stack([start, goal]))
    V, F, (a, b) = with_vertices(mesh.V, mesh.F, hits.position, hits.face)
    return potpourri3d.EdgeFlipGeodesicSolver(V, F).find_geodesic_path(int(a), int(b))


def exact_distance(mesh, line, point):
    """Exact polyhedral distance (Mitchell, Mount, Papadimitriou 1987) of a point to a line.

    Squared distances to the middles of the line's pieces near the foot; their least by a parabola.
    """
    middles = 0.5 * (line[1:] + line[:-1])
    size = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.cumsum(size) - 0.5 * size
    hits = mesh.closest(middles)
    clear = size > 0.2 * np.median(size)
    order = np.argsort(np.linalg.norm(middles - point, axis=1) + np.where(clear, 0.0, 1e9))
    here = mesh.closest(point[None])
    _, first = np.unique(hits.face[order], return_index=True)
    near = order[np.sort(first)][:9]
    points = np.vstack([here.position, middles[near]])
    faces = np.concatenate([here.face, hits.face[near]])
    V, F, at = with_vertices(mesh.V, mesh.F, points, faces)
    far = igl.exact_geodesic(V, F, VS=at[:1], VT=at[1:])
    a, b, c = np.polyfit(along[near] - along[near[0]], far**2, 2)
    return np.sqrt(c - b * b / (4 * a))


def scan():
    return sample("scan.stl")


def saddle():
    return cases.mesh("saddle", 8_000)


def bumpy():
    return cases.mesh("bumpy", 8_000)


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("make", [saddle, bumpy, scan])
def test_wave_heights_are_those_of_exact_geodesics(make):
    mesh = make()
    middle = 0.5 * (mesh.V.min(axis=0) + mesh.V.max(axis=0))
    way = 50.0 * np.array([[-0.8, 0.6, 0.0], [0.8, -0.6, 0.0]])
    ends = mesh.closest(middle + way).position
    charts = mesh.charts(ends[:1], ends[1:])
    lift = charts.lift(fields.strokes(charts.lengths, 400))
    assert not lift.status.any()
    drawn = stroke(lift.position[0], *ends)
    (found,) = placed([drawn], ReportSurface("mesh", mesh), None)
    line = centre_line(mesh, *ends)
    turns = np.rint(found.wave.index).astype(int)
    exact = [exact_distance(mesh, line, found.footing.foot[i]) for i in turns]
    measured = np.abs(found.footing.uv[turns, 1])
    # Between the facets and a smooth surface through them lies the chordal error.
    np.testing.assert_allclose(measured, exact, atol=mesh.shape.heights.max())
    np.testing.assert_allclose(
        found.wave.heights, np.add(exact[1:], exact[:-1]), atol=2.0 * mesh.shape.heights.max()
    )
    assert found.wave.mean == pytest.approx(49.98, abs=0.02)
    straight = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    assert found.footing.length == pytest.approx(straight, abs=mesh.shape.heights.max())

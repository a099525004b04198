"""Noise: found where it is, and nowhere else."""

from pathlib import Path

import numpy as np
import pytest

from dmpcli.records.file_io import read
from dmpcli.records.mesh import MeshFile, decode, summary
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.surface import Status
from tests.surfaces import cases, fields
from tests.surfaces.test_mesh import folded

PARTS = Path(__file__).parent / "parts"


def part(name):
    """Return a machined part, see `parts/README.md`."""
    found = decode(read(PARTS / f"{name}.stl"))
    return Mesh(found.V, found.F)


def half_noisy(mesh, by_edge):
    """Noise of so much of an edge on the vertices of x > 0."""
    shift = by_edge * fields.edge_length(mesh) * np.random.default_rng(1).normal(size=mesh.V.shape)
    return Mesh(mesh.V + np.where(mesh.V[:, :1] > 0.0, shift, 0.0), mesh.F)


def share(mesh, faces):
    """Share of the area of some faces that is noisy."""
    a, b, c = np.moveaxis(mesh.corners[faces], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return area[mesh.shape.noise[faces] > 0.0].sum() / area.sum()


@pytest.mark.slow
@pytest.mark.parametrize("name", cases.SURFACES)
@pytest.mark.parametrize("faces", [5_000, 50_000])
def test_smooth_surfaces_are_not_noisy_anywhere(name, faces):
    assert not cases.mesh(name, faces).shape.noise.any()


@pytest.mark.parametrize("name", ["angle_block", "carriage"])
def test_the_slivers_of_machined_parts_are_not_noise(name):
    assert part(name).shape.noisy_share <= 0.001


@pytest.mark.parametrize("name", cases.SURFACES)
@pytest.mark.parametrize("by_edge", [0.03, 0.05, 0.07])
def test_noise_on_half_of_a_mesh_is_found_in_that_half(name, by_edge):
    smooth = cases.mesh(name, 5_000)
    mesh = half_noisy(smooth, by_edge)
    noisy = mesh.V[mesh.F][..., 0].mean(axis=1) > 0.0
    assert share(mesh, noisy) >= 0.6
    assert share(mesh, ~noisy) <= 0.05
    sigma = np.median(mesh.shape.noise[mesh.shape.noise > 0.0])
    assert sigma == pytest.approx(by_edge * fields.edge_length(smooth), rel=0.35)


def test_normals_far_from_noise_are_those_without_it():
    smooth = cases.mesh("saddle", 5_000)
    mesh = half_noisy(smooth, 0.07)
    far = mesh.V[mesh.F][..., 0].max(axis=1) < -30.0
    np.testing.assert_array_equal(mesh.shape.corner_normals[far], smooth.shape.corner_normals[far])
    np.testing.assert_array_equal(mesh.shape.reach[far], smooth.shape.reach[far])


def test_a_crease_far_from_noise_is_drawn_and_one_within_it_refused():
    clean = folded(60.0, half=60.0, cells=60)
    shift = 0.1 * np.random.default_rng(4).normal(size=clean.V.shape)
    V = clean.V + np.where(clean.V[:, 1:2] > 0.0, shift, 0.0)
    mesh = Mesh(V, clean.F)
    a = np.radians(60.0)
    start = np.array([[-20.0, -35.0, 0.0], [-20.0, 35.0, 0.0]])
    goal = start + [20.0 + 20.0 * np.cos(a), 0.0, -20.0 * np.sin(a)]
    charts = mesh.charts(start, goal)
    lift = charts.lift(fields.strokes(charts.lengths, 200, height=20.0))
    assert lift.status[0] == Status.DRAWN
    assert lift.unfolded[0]
    assert np.linalg.norm(lift.position[0, -1] - goal[0]) < 1e-6
    assert lift.status[1] in (Status.NOISY, Status.NO_GEODESIC)


@pytest.mark.parametrize(
    ("name", "start", "goal"),
    [
        ("angle_block", [15, 0, 20], [55, 0, 45]),
        ("angle_block", [0, 15, 20], [0, 55, 45]),
        ("angle_block", [66, 10, 20], [25, 10, 40]),
        ("carriage", [20, 8, 18], [64, 9, 18]),
        ("carriage", [20, 52, 0], [64, 50, 0]),
    ],
)
def test_flat_faces_of_machined_parts_are_drawn_on_as_planes(name, start, goal):
    a, b = np.array([start], dtype=float), np.array([goal], dtype=float)
    charts = part(name).charts(a, b)
    coordinates = fields.strokes(charts.lengths, 300, height=15.0)
    lift = charts.lift(coordinates)
    assert lift.status[0] == Status.DRAWN
    normal = np.round(lift.normal[0, 0])
    assert np.abs(normal).sum() == 1.0
    u = (b - a)[0] / np.linalg.norm(b - a)
    v = np.cross(normal, u)
    flat = a + coordinates[0, :, :1] * u + coordinates[0, :, 1:2] * v
    np.testing.assert_allclose(lift.position[0], flat, atol=1e-3)
    np.testing.assert_allclose(lift.position[0, -1], b[0], atol=1e-5)


def test_the_reach_beside_a_chamfer_is_not_that_of_its_turn_over_a_long_facet():
    # A plane of 100 mm, a chamfer of 1 mm at 20°, another plane: in facets as long as the part.
    a = np.radians(20.0)
    profile = np.array([[-100.0, 0.0], [0.0, 0.0], [np.cos(a), -np.sin(a)]])
    profile = np.vstack([profile, profile[-1] + 100.0 * np.array([np.cos(2 * a), -np.sin(2 * a)])])
    V = np.concatenate([[[x, y, z] for y in (-50.0, 50.0)] for x, z in profile])
    F = np.array([t for k in (0, 2, 4) for t in ((k, k + 2, k + 1), (k + 1, k + 2, k + 3))])
    assert Mesh(V, F).shape.reach.max() <= 1.0


def test_the_load_line_tells_how_much_is_noisy():
    smooth = cases.mesh("saddle", 2_000)
    assert "noisy" not in summary(MeshFile(smooth.V, smooth.F, []))
    mesh = half_noisy(smooth, 0.07)
    told = summary(MeshFile(mesh.V, mesh.F, []), mesh)
    assert f"{100 * mesh.shape.noisy_share:.2g} % of its area is noisy" in told

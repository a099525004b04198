"""Regions on meshes: which side of a line is its inside."""

import numpy as np
import trimesh

from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.mesh_regions import mesh_region


def test_of_a_closed_mesh_the_smaller_side_is_inside_wherever_it_lies():
    """A cap of two fifths of a ball; the origin lies at the far end of the ball."""
    made = trimesh.creation.icosphere(subdivisions=3, radius=10.0)
    mesh = Mesh(made.vertices + [0.0, 0.0, 10.0], made.faces)
    turn = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    z = 10.0 * (1.0 - 2.0 * 0.4)  # areas of caps are as their heights
    rim = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1) * np.sqrt(100.0 - z**2)
    region = mesh_region(mesh, mesh.closest(rim + [0.0, 0.0, 10.0 + z]).position)
    at = mesh.closest(np.array([[0.0, 0.0, 20.0], [0.0, 0.0, 0.0], [10.0, 0.0, 8.0]])).position
    assert region.inside(at).tolist() == [True, False, False]

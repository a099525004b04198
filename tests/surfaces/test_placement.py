"""Points that miss a part for one slip each: the slip is named, and none beside it."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.placement import box, slips
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere

POSITION, ANGLES = np.array([300.0, -80.0, 40.0]), np.array([0.4, -0.3, 1.1])
R = Rotation.from_euler("XYZ", ANGLES).as_matrix()
CENTRE = np.array([5.0, 8.0, -3.0])
PART = CENTRE + 60.0 * np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0.8, 0], [0, -0.6, 0.8]])


def found(given, in_part, position=POSITION, rotation=R, angles=ANGLES, scales=(1000.0, 0.001)):
    placed = Sphere(rotation @ CENTRE + position, 60.0)
    return slips(placed, given, in_part, position, angles, scales, 0.5)


def base(points):
    return points @ R.T + POSITION


@pytest.mark.parametrize("in_part", [True, False])
def test_a_slip_of_unit_or_frame_of_the_points_is_named(in_part):
    right, other = (PART, base(PART)) if in_part else (base(PART), PART)
    assert [s.kind for s in found(right / 1000.0, in_part, scales=())] == ["points in m"]
    [slip] = found(other, in_part)
    assert slip.kind == "other frame"
    assert slip.distance < 1e-9
    assert slip.scale == 1.0
    assert found(right + 40.0, in_part) == []


@pytest.mark.parametrize("scale", [1000.0, 0.001])
def test_a_part_of_another_scale_is_named_with_it(scale):
    # A part that is a thousand times smaller is, in its own axes, points in m.
    slip, *rest = sorted(found(PART * scale, True), key=lambda slip: slip.kind)
    assert (slip.kind, slip.scale) == ("part", scale)
    assert [s.kind for s in rest] == ["points in m"] * (scale < 1.0)
    assert slip.distance < 1e-6 * scale + 1e-9


def test_a_pose_in_m_or_degrees_is_named():
    """The file says 0.3 m where mm were meant, or 40° where radians were."""
    in_m = POSITION / 1000.0
    assert [s.kind for s in found(base(PART), False, position=in_m)] == ["pose in m"]
    angles = np.degrees(ANGLES)
    taken = Rotation.from_euler("XYZ", angles).as_matrix()
    kinds = [s.kind for s in found(base(PART), False, rotation=taken, angles=angles)]
    assert kinds == ["pose in degrees"]
    both = found(base(PART), False, position=in_m, rotation=taken, angles=angles)
    assert [s.kind for s in both] == ["pose in both"]


def test_the_best_slip_comes_first():
    near = PART * 1000.0 + [[90.0, 0, 0]]
    kinds = [(s.kind, s.scale) for s in found(near, True, scales=(1000.0, 1001.0))]
    assert kinds == []
    wide = slips(Sphere(CENTRE, 60.0), PART * 1000.0, True, np.zeros(3), np.zeros(3),
                 (1001.0, 1000.0), 200.0)  # fmt: skip
    assert [s.scale for s in wide] == [1000.0, 1001.0]


def test_the_box_of_a_part_and_of_an_endless_plane():
    low, high = box(Sphere(CENTRE, 60.0))
    assert low.tolist() == [-55.0, -52.0, -63.0]
    assert high.tolist() == [65.0, 68.0, 57.0]
    solid = trimesh.creation.box((10.0, 20.0, 30.0))
    low, high = box(Mesh(np.array(solid.vertices), np.array(solid.faces)))
    assert low.tolist() == [-5.0, -10.0, -15.0]
    assert high.tolist() == [5.0, 10.0, 15.0]
    assert box(Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))) is None

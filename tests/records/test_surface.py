"""Surface files: planes, cylinders and spheres in JSON, told apart, placed and refused by name."""

import json

import numpy as np
import pytest

from dmpcli.errors import InputError
from dmpcli.records import json_schema, surface
from dmpcli.records.file_io import Source
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere

PLANE = {"point": [1, 2, 3], "normal": [0, 0, 2]}
CYLINDER = {"point": [1, 2, 3], "axis": [0, -3, 4], "radius": 60}
SPHERE = {"centre": [1, 2, 3], "radius": 0.5}
KINDS = {"plane": (PLANE, Plane), "cylinder": (CYLINDER, Cylinder), "sphere": (SPHERE, Sphere)}


def load(document, *more, **options):
    return surface.load(Source("s.json", json.dumps(document).encode()), *more, **options)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("head", [True, False], ids=["schema", "by_hand"])
def test_a_surface_is_told_by_its_schema_or_its_keys(kind, head):
    document, type_ = KINDS[kind]
    found = load(({"schema": kind, "version": 1} if head else {}) | document)
    assert isinstance(found, type_)
    assert surface.kind(found) == kind


def test_an_axis_may_have_any_length():
    found = load(CYLINDER | {"axis": [0, -3e-300, 4e-300]})
    np.testing.assert_allclose(found.axis, [0, -0.6, 0.8])
    np.testing.assert_array_equal(found.point, [1, 2, 3])
    assert found.radius == 60.0


def test_a_pose_moves_points_and_turns_axes():
    pose = Pose.of(np.array([100.0, -20.0, 5.0, 0.1, -0.2, 0.6]))
    R = rotations.from_euler(np.array([0.1, -0.2, 0.6]))
    there = R @ [1, 2, 3] + [100.0, -20.0, 5.0]
    tube, ball = load(CYLINDER, pose=pose), load(SPHERE, pose=pose)
    np.testing.assert_allclose(tube.point, there)
    np.testing.assert_allclose(tube.axis, R @ [0, -0.6, 0.8])
    np.testing.assert_allclose(ball.centre, there)
    assert (tube.radius, ball.radius) == (60.0, 0.5)


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"colour": "red"}, "tells no surface: a plane is .*, a cylinder .*, a sphere "),
        ({"point": [1, 2, 3]}, "tells no surface"),
        (PLANE | CYLINDER, "tells no surface"),
        ({"schema": "skill"}, "has schema 'skill', not a surface's: a plane is "),
        ({"schema": ["plane"]} | PLANE, "not a surface's"),
        (CYLINDER | {"axis": [0, 0, 0]}, "axis: is zero; it must point along the cylinder"),
        (CYLINDER | {"axis": [0, 1]}, r"axis: .*; a cylinder is \{\"point\""),
        (CYLINDER | {"point": [2e6, 0, 0]}, "point: is beyond 1e.06 mm; check its unit"),
        (CYLINDER | {"radius": 0}, "radius: .*greater than or equal to 0.1; a cylinder is"),
        (CYLINDER | {"radius": -60}, "radius: "),
        (CYLINDER | {"radius": 0.06}, "radius: "),
        (CYLINDER | {"radius": 1e7}, "radius: "),
        (CYLINDER | {"radius": float("nan")}, "radius: "),
        (CYLINDER | {"length": 5}, "length: "),
        (CYLINDER | {"version": 9, "schema": "cylinder"}, "cylinder version 9 is newer"),
        ({"axis": [0, 0, 1], "radius": 5}, "point: Field required; a cylinder is"),
        (SPHERE | {"radius": "wide"}, r"radius: .*; a sphere is \{\"centre\""),
        (SPHERE | {"centre": [0, float("inf"), 0]}, "centre.1: "),
        (SPHERE | {"centre": [0, -2e6, 0]}, "centre: is beyond"),
        ({"centre": [0, 0, 1]}, "radius: Field required"),
    ],
)
def test_a_wrong_surface_is_refused_by_what_is_wrong(document, message):
    with pytest.raises(InputError, match=message):
        load(document)


@pytest.mark.parametrize("kind", KINDS)
def test_only_meshes_have_a_unit(kind):
    load(KINDS[kind][0], "mm")
    with pytest.raises(InputError, match=f"{kind} files are in mm; leave --surface-unit out"):
        load(KINDS[kind][0], "m")


def test_files_keep_to_their_published_schemas():
    import jsonschema

    for kind, (document, _) in KINDS.items():
        jsonschema.validate(document, json_schema.schema(kind))
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(CYLINDER | {"radius": 0}, json_schema.schema("cylinder"))
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"centre": [1, 2]}, json_schema.schema("sphere"))

"""Poses: from six numbers or a file, and surfaces that they place."""

import json

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError
from dmpcli.records import json_schema, pose, surface
from dmpcli.records.file_io import Source
from dmpcli.records.pose import Conditioning, Residuals
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.plane import Plane
from tests.records.meshes import grid, obj

SIX = [100.0, -20.5, 3.0, 0.1, -0.2, 2.8]
PLANE = b'{"point": [1, 2, 3], "normal": [0, 0, 2]}'


def expected(points):
    R = Rotation.from_euler("XYZ", SIX[3:])
    return R.apply(points) + SIX[:3]


@given(st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
def test_a_pose_survives_its_file(six):
    before = Pose.of(np.array(six))
    after, _ = pose.decode(Source("pose.json", pose.encode(before)))
    np.testing.assert_array_equal(after.position, before.position)
    np.testing.assert_allclose(after.rotation, before.rotation, atol=1e-14)


def test_the_facts_of_a_registration_are_kept_and_obey_the_published_schema():
    residuals = Residuals(points=9, rms=0.02, largest=0.05)
    conditioning = Conditioning(number=5.0, gain=0.2, weakest="slides", uncertainty=0.01)
    content = pose.encode(
        Pose.of(np.array(SIX)),
        residuals,
        conditioning,
        {"unit": "m"},
        [{"role": "part", "sha256": "0"}],
    )
    jsonschema.validate(json.loads(content), json_schema.schema("pose"))
    file = pose.decode(Source("pose.json", content))[1]
    assert (file.residuals, file.conditioning) == (residuals, conditioning)
    assert file.options == {"unit": "m"}


def test_position_and_rotation_are_enough():
    found, _ = pose.decode(Source("p", b'{"position": [1, 2, 3], "rotation": [0, 0, 0]}'))
    np.testing.assert_array_equal(found.position, [1, 2, 3])
    np.testing.assert_array_equal(found.rotation, np.eye(3))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"{", "is not JSON"),
        (PLANE, "position: Field required"),
        (b'{"schema": "plane"}', "has schema 'plane', a pose file is needed"),
        (b'{"version": 2}', "pose version 2 is newer"),
        (b'{"position": [1, 2], "rotation": [0, 0, 0]}', "position: List should have at least 3"),
        (b'{"position": [1, 2, NaN], "rotation": [0, 0, 0]}', "position.2: Input should be a fin"),
        (b'{"position": [1, 2, 3], "rotation": [0, 0, 0], "x": 1}', "x: Extra inputs"),
    ],
)
def test_a_wrong_pose_file_is_refused_by_field(content, words):
    with pytest.raises(InputError) as error:
        pose.decode(Source("pose.json", content))
    assert str(error.value).startswith("pose.json: ")
    assert words in str(error.value)


def test_six_numbers_and_a_file_say_the_same(tmp_path):
    words = " ".join(map(repr, SIX))
    said, source = pose.parse(words, "--surface-pose")
    assert source is None
    points = np.random.default_rng(0).standard_normal((5, 3))
    np.testing.assert_allclose(said.apply(points), expected(points), atol=1e-12)
    file = tmp_path / "a pose.json"
    file.write_bytes(pose.encode(said))
    read, source = pose.parse(str(file), "--surface-pose")
    assert source is not None
    assert source.content == file.read_bytes()
    np.testing.assert_allclose(read.apply(points), expected(points), atol=1e-12)


@pytest.mark.parametrize("value", ["1 2 3", "1 2 3 4 5 6 7", "1 2 3 4 5 six", "1 2 3 4 5 nan"])
def test_a_pose_that_is_not_six_numbers_is_refused_by_its_option(value):
    with pytest.raises(InputError, match=f"^--initial {value}: "):
        pose.parse(value, "--initial")


def test_a_missing_pose_file_is_refused():
    with pytest.raises(InputError, match=r"none\.json: no such file"):
        pose.parse("none.json", "--initial")


def test_a_surface_is_a_plane_or_a_mesh_by_its_content():
    assert isinstance(surface.load(Source("part.stl", PLANE)), Plane)
    V, F = grid()
    found = surface.load(Source("plane.json", obj(V, F)))
    np.testing.assert_array_equal(found.V, V)
    np.testing.assert_array_equal(found.F, F)


def test_a_pose_moves_planes_and_meshes_alike():
    placed = Pose.of(np.array(SIX))
    plane = surface.load(Source("plane.json", PLANE), pose=placed)
    np.testing.assert_allclose(plane.point, expected([1, 2, 3]), atol=1e-12)
    np.testing.assert_allclose(plane.normal, expected([0, 0, 1]) - expected([0, 0, 0]), atol=1e-12)
    V, F = grid()
    found = surface.load(Source("part.obj", obj(V / 1e3, F)), "m", placed)
    np.testing.assert_allclose(found.V, expected(V), atol=1e-9)


def test_a_plane_has_no_unit():
    assert isinstance(surface.load(Source("plane.json", PLANE), "mm"), Plane)
    with pytest.raises(InputError, match="plane files are in mm; leave --surface-unit out"):
        surface.load(Source("plane.json", PLANE), "m")

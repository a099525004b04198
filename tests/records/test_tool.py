import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.admittance.payload_identification import Identification, PayloadEstimate
from dmpcli.errors import InputError
from dmpcli.records import json_schema, tool
from dmpcli.records.file_io import Source
from dmpcli.simulation.mock import PEN
from dmpcli.spatial.rotations import exp
from dmpcli.spatial.wrench import Tool

TEXT = tool.encode(PEN)


def changed(**parts):
    document = json.loads(TEXT)
    for path, value in parts.items():
        *way, last = path.split("__")
        place = document
        for key in way:
            place = place[key]
        if value is None:
            del place[last]
        else:
            place[last] = value
    return Source("pen.json", json.dumps(document).encode())


@pytest.mark.slow
@given(st.integers(0, 10_000), st.booleans())
def test_a_tool_survives_its_file(seed, zeroed):
    rng = np.random.default_rng(seed)
    before = Tool(
        100 * rng.standard_normal(3),
        exp(rng.standard_normal(3)),
        100 * rng.standard_normal(3),
        exp(rng.standard_normal(3)),
        rng.uniform(0, 50),
        rng.standard_normal(3),
        rng.standard_normal(2),
        rng.standard_normal(6) if zeroed else None,
    )
    after = tool.decode(Source("pen.json", tool.encode(before)))
    np.testing.assert_array_equal(after.tcp_position, before.tcp_position)
    np.testing.assert_allclose(after.tcp_rotation, before.tcp_rotation, atol=1e-14)
    np.testing.assert_allclose(after.sensor_rotation, before.sensor_rotation, atol=1e-14)
    np.testing.assert_array_equal(after.inclination, before.inclination)
    assert after.weight == before.weight
    assert (after.zero is None) == (before.zero is None)
    if zeroed:
        np.testing.assert_array_equal(after.zero, before.zero)


def identified():
    payload = PayloadEstimate(
        6.0, np.array([1.0, -2.0, 45.0]), np.array([0.01, 0.0]), np.arange(6.0)
    )
    error = PayloadEstimate(0.01, np.full(3, 0.1), np.full(2, 0.001), np.full(6, 0.01))
    used = np.array([True, True, False, True])
    return Identification(payload, error, np.zeros((4, 6)), np.array([2.4, 3.2]), used)


def calibrated(**sensor):
    identity = tool.SensorIdentity(**sensor) if sensor else None
    return tool.calibrated(identified(), identity, {"poses": 4}, [])


def test_the_file_obeys_its_published_schema():
    whole = json.loads(tool.encode(PEN, calibrated(make="mock", serial="7")))
    for document in (json.loads(TEXT), whole, json.loads(GEOMETRY.content)):
        jsonschema.validate(document, json_schema.schema("tool"))


GEOMETRY = changed(payload=None, calibration=None)


def test_a_calibrated_tool_knows_its_sensor_and_how_it_was_found():
    content = tool.encode(PEN, calibrated(make="ATI", product="Mini45", serial="FT1"))
    assert tool.decode(Source("pen.json", content)).sensor == "ATI Mini45 FT1"
    said = json.loads(content)["calibration"]
    assert said["poses"] == 3
    assert said["rejected"] == [3]
    assert said["conditioning"] == {"force": 2.4, "torque": 3.2}
    assert said["standard_errors"]["centre_of_mass"] == [0.1, 0.1, 0.1]
    assert tool.decode(Source("pen.json", TEXT)).sensor == ""


def test_a_file_without_payload_is_a_geometry():
    found = tool.geometry(GEOMETRY)
    np.testing.assert_array_equal(found.tcp_position, PEN.tcp_position)
    np.testing.assert_array_equal(tool.geometry(Source("a", TEXT)).lever, PEN.lever)
    assert (found.weight, found.zero) == (0.0, None)


def test_the_first_version_is_read():
    assert tool.decode(changed(version=1, calibration=None)).weight == PEN.weight


@pytest.mark.slow
@given(st.integers(0, 1000))
def test_the_geometry_survives_the_facts_of_another_file(seed):
    rng = np.random.default_rng(seed)
    before = replace(
        PEN, sensor_rotation=exp(rng.standard_normal(3)), tcp_position=rng.standard_normal(3)
    )
    facts = {"geometry": tool.transforms(before), "sensor": {"make": "mock"}}
    after, sensor = tool.restored(facts, "poses.parquet")
    np.testing.assert_allclose(after.sensor_in_tcp, before.sensor_in_tcp, atol=1e-14)
    np.testing.assert_array_equal(after.tcp_position, before.tcp_position)
    assert str(sensor) == "mock"


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        ({}, "does not say where the sensor sits on the flange: --tool FILE"),
        ({"geometry": {"flange_to_tcp": 3}}, "flange_to_tcp"),
        ({"geometry": tool.transforms(PEN), "sensor": 3}, "sensor"),
    ],
)
def test_facts_that_are_no_geometry_are_refused(facts, words):
    with pytest.raises(InputError, match=words):
        tool.restored(facts, "poses.parquet")


def test_what_may_be_left_out_has_its_plain_meaning():
    source = changed(flange_to_tcp__rotation=None, payload__inclination=None, payload__zero=None)
    read = tool.decode(source)
    np.testing.assert_array_equal(read.tcp_rotation, np.eye(3))
    np.testing.assert_array_equal(read.inclination, 0.0)
    assert read.zero is None


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (Source("pen.json", b"{"), "is not JSON"),
        (Source("pen.json", b"[]"), "not an object"),
        (changed(schema="skill"), "has schema 'skill', a tool file is needed"),
        (changed(version=3), "version 3 is newer"),
        (changed(payload=None), "payload: is missing; dmpcli calibrate --tool pen.json finds it"),
        (changed(calibration={"poses": 2}), "calibration"),
        (changed(payload__weight=-1.0), "payload.weight"),
        (changed(payload__weight=None), "payload.weight"),
        (changed(payload__mass=3.0), "payload.mass"),
        (changed(flange_to_tcp__position=[1.0, 2.0]), "flange_to_tcp.position"),
        (Source("pen.json", TEXT.replace(b"160.0", b"NaN")), "flange_to_tcp.position.2"),
    ],
)
def test_a_wrong_tool_file_is_refused_by_field(source, words):
    with pytest.raises(InputError) as error:
        tool.decode(source)
    assert str(error.value).startswith("pen.json: ")
    assert words in str(error.value)

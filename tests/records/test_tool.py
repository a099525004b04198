import json

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.instruments.mock import PEN
from dmpcli.primitives.wrench import Tool
from dmpcli.records import tool
from dmpcli.records.streams import Source
from dmpcli.rotations import exp

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


def test_the_file_obeys_its_published_schema():
    jsonschema.validate(json.loads(TEXT), tool.schema())


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
        (changed(version=2), "version 2 is newer"),
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

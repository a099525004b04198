"""Skill files: exact, published, and refused by name when wrong."""

import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.errors import InputError
from dmpcli.records import exact_surface, json_schema, skill
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance
from tests.dmp.strokes import circle, paper_stroke

REPRODUCTION = skill.Reproduction(
    sha256="0" * 64, duration=10.0, rms=0.1, largest=0.2, end=0.0, smoothing=0.0
)


def encoded(stroke=None, **choices):
    result = fit([stroke or paper_stroke(turning=True)], FitOptions(**choices))
    return result.skill, skill.encode(result.skill, [REPRODUCTION], Provenance("fit"))


@pytest.mark.parametrize("model", ["modified", "original"])
@pytest.mark.parametrize("stroke", [paper_stroke(turning=True), circle()], ids=["open", "closed"])
def test_a_skill_round_trips_exactly(model, stroke):
    before, content = encoded(stroke, model=model)
    after, _ = skill.decode(Source("s.json", content))
    for name in ("weights", "alpha_f", "start", "goal", "initial_velocity", "forcing_factor"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    np.testing.assert_array_equal(after.basis.centres, before.basis.centres)
    np.testing.assert_array_equal(after.frame.axes, before.frame.axes)
    assert after.spring.tau == before.spring.tau
    if before.frame.rotation is not None:
        np.testing.assert_allclose(after.frame.rotation, before.frame.rotation, atol=1e-15)


def test_a_force_profile_is_version_3_and_round_trips_exactly():
    plain = paper_stroke()
    force = np.zeros((len(plain), 3))
    force[:, 2] = 3.0 + plain.t / 5.0
    stroke = replace(plain, contact_force=force)
    before, content = encoded(stroke, force_profile=True, normal=(0.0, 0.0, 1.0))
    document = json.loads(content)
    jsonschema.validate(document, json_schema.schema("skill"))
    assert document["version"] == 3
    after, _ = skill.decode(Source("s.json", content))
    np.testing.assert_array_equal(after.force.weights, before.force.weights)
    assert replace(after.force, weights=None) == replace(before.force, weights=None)
    document["force_profile"]["weights"].pop()
    with pytest.raises(InputError, match=r"force_profile\.weights must have basis = 80"):
        skill.decode(Source("s.json", json.dumps(document).encode()))


def test_a_skill_without_a_force_profile_keeps_its_version_and_its_bytes():
    document = json.loads(encoded()[1])
    assert document["version"] == 2
    assert "force_profile" not in document
    force = np.ones((len(paper_stroke()), 3))
    assert encoded(replace(paper_stroke(), contact_force=force))[1] == encoded(paper_stroke())[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(json_schema.FILES))
def test_the_published_json_schema_is_the_models(name):
    published = (json_schema.folder() / f"{name}.schema.json").read_text(encoding="utf-8")
    assert published == json_schema.text(name), "run make schemas"
    jsonschema.Draft202012Validator.check_schema(json.loads(published))


def test_our_files_keep_to_their_published_schema():
    jsonschema.validate(json.loads(encoded()[1]), json_schema.schema("skill"))
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(json.loads(changed(tau=-1.0)), json_schema.schema("skill"))


def test_a_weight_is_on_a_line_of_its_axis():
    text = encoded(basis=7)[1].decode()
    assert max(len(line) for line in text.splitlines()) < 7 * 30
    assert text.count("\n") < 120


def changed(**changes):
    document = json.loads(encoded()[1])
    for key, value in changes.items():
        if value is None:
            del document[key]
        else:
            document[key] = value
    return json.dumps(document).encode()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"{", "is not JSON"),
        (b"\x80{}", "is not JSON: not text"),
        (b"[1]", "not an object"),
        (b'{"schema": "plane"}', "has schema 'plane', a skill"),
        (changed(version=99), "version 99 is newer"),
        (changed(weights=None), "weights: Field required"),
        (changed(k=[1.0]), "k: "),
        (changed(centres=[1.0]), "centres, widths and weights must each have basis"),
        (changed(tau=-1.0), "tau: "),
        (changed(d=[0.0] * 6), "k, d and widths must be positive"),
        (changed(extra=1), "extra: "),
        (changed(version=None), "version: Field required"),
        (changed(version=True), "version: "),
        (changed(forcing_scale="axis"), "forcing_scale belongs to the original model"),
        (changed(tau=float("nan")), "tau: "),
    ],
)
def test_a_wrong_skill_file_is_refused_by_what_is_wrong(content, message):
    with pytest.raises(InputError, match=message) as caught:
        skill.decode(Source("s.json", content))
    assert str(caught.value).startswith("s.json")


@given(st.text(max_size=60))
def test_any_text_is_refused_by_name(text):
    with pytest.raises(InputError, match=r"s\.json"):
        skill.decode(Source("s.json", text.encode()))


def test_a_plane_is_a_point_and_a_normal_of_any_length():
    found = exact_surface.decode(Source("p", b'{"point": [1, 2, 3], "normal": [0, 0, 5]}'), "plane")
    np.testing.assert_array_equal(found.normal, [0, 0, 1])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'{"point": [1, 2, 3]}', "normal: Field required"),
        (b'{"point": [1, 2, 3], "normal": [0, 0, 0]}', "normal: is zero"),
        (b'{"point": [1, 2], "normal": [0, 0, 1]}', "point: "),
        (b'{"point": [1, 2, 3], "normal": [0, 0, NaN]}', "normal.2: "),
        (
            b'{"schema": "skill", "point": [1, 2, 3], "normal": [0, 0, 1]}',
            "has schema 'skill', a plane",
        ),
        (b'{"version": 7}', "version 7 is newer"),
    ],
)
def test_a_wrong_plane_file_is_refused_by_what_is_wrong(content, message):
    with pytest.raises(InputError, match=message):
        exact_surface.decode(Source("p.json", content), "plane")

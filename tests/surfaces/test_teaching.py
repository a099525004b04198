"""Taught on one curved part, drawn on another: a quick part of benchmarks/taught_surfaces.py."""

import pytest

from tests.surfaces import cases, teaching

FACES, HEADINGS, SAMPLES = 20_000, 3, 301


@pytest.fixture(scope="module")
def made():
    meshes, error = teaching.meshes(FACES)
    return meshes, error, {name: cases.case(name, HEADINGS, SAMPLES, 1) for name in meshes}


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["saddle", "bumpy", "cylinder"])
def test_a_stroke_is_carried_from_any_curved_part_to_any(made, name):
    meshes, error, truth = made
    skill = teaching.taught(name, meshes[name], truth[name], 1, teaching.RIDGE)
    for other, mesh in meshes.items():
        found = teaching.carried(skill, mesh, truth[other])
        assert all(c.status == 0 for c in found)
        assert max(c.rms for c in found) <= 1.5 * max(error[name], error[other]) + 0.02
        assert max(c.wave for c in found) <= 0.05
        # The bumpy field's radius is 29 mm: its facets of 2 mm turn by 4° each.
        bumpy = "bumpy" in (name, other)
        assert max(c.turn for c in found) <= (1.2 if bumpy else 0.3)
        if other == name:
            assert found[1].rms <= 0.05
            assert found[1].turn <= 0.3

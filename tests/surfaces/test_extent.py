"""Areas and volumes of parts that trimesh makes."""

import numpy as np
import pytest
import trimesh

from dmpcli.surfaces.extent import area, volume


def joined(*parts):
    made = trimesh.util.concatenate(parts)
    return np.array(made.vertices), np.array(made.faces)


def box(size, at=(0.0, 0.0, 0.0)):
    made = trimesh.creation.box((size, size, size))
    made.apply_translation(at)
    return made


BALL = trimesh.creation.icosphere(subdivisions=2, radius=30.0)


@pytest.mark.parametrize("at", [(0.0, 0.0, 0.0), (500.0, -300.0, 80.0)])
def test_area_and_volume_are_trimeshs_wherever_the_part_lies(at):
    part = BALL.copy()
    part.apply_translation(at)
    V, F = joined(part)
    assert area(V, F) == pytest.approx(BALL.area)
    assert volume(V, F) == pytest.approx(BALL.volume)
    assert volume(V, F[:, ::-1]) == pytest.approx(BALL.volume)
    assert volume(V, F[1:]) is None


def test_pieces_add_up_but_for_cavities_which_are_wound_against_what_holds_them():
    inside = box(10.0)
    cavity = inside.copy()
    cavity.invert()
    beside = box(20.0, (100.0, 0.0, 0.0))
    away = beside.copy()
    away.invert()
    assert volume(*joined(box(40.0), beside)) == pytest.approx(64_000 + 8_000)
    assert volume(*joined(box(40.0), away)) == pytest.approx(64_000 + 8_000)
    assert volume(*joined(box(40.0), cavity)) == pytest.approx(64_000 - 1_000)
    assert volume(*joined(box(40.0), inside)) == pytest.approx(64_000 + 1_000)
    assert volume(*joined(cavity, box(40.0), beside)) == pytest.approx(64_000 + 8_000 - 1_000)
    cut = joined(box(40.0), beside)
    assert volume(cut[0], cut[1][:-1]) is None

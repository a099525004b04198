"""Strokes that keep a speed, and strokes that are split at a border: on the path that they had."""

import numpy as np
import pytest

from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.generalization import draw
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.tool_speed import Pace
from dmpcli.surfaces.keep_off import KeepOff
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.surface import Status
from tests.dmp.strokes import paper_stroke

RATE = 50.0
PLATE = Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))
START = np.array([[0.0, 0.0, 0.0], [0.0, 200.0, 0.0], [0.0, 400.0, 0.0]])
GOAL = START + [[100.0, 0.0, 0.0], [120.0, 0.0, 0.0], [90.0, 30.0, 0.0]]


@pytest.fixture(scope="module")
def skill():
    return fit([paper_stroke()], FitOptions()).skill


def drawn(skill, **style):
    duration = np.full(3, skill.duration)
    return draw(skill, Pairs(START, GOAL), duration, PLATE, GeneralizeOptions(RATE, **style))


def away(points, path):
    """Distance of points from a path of many samples."""
    return np.linalg.norm(points[:, None] - path[None], axis=2).min(axis=1)


class Band:
    """All with x between two numbers."""

    def __init__(self, low, high):
        self.low, self.high = low, high

    def holds(self, points):
        return (points[..., 0] > self.low) & (points[..., 0] < self.high)


def test_at_a_pace_each_stroke_has_that_speed_on_its_own_path_and_as_long_as_that_takes(skill):
    plain, paced = drawn(skill), drawn(skill, pace=Pace(40.0))
    for before, after in zip(plain, paced, strict=True):
        assert after.status == Status.DRAWN
        assert after.timing.t == pytest.approx(np.arange(len(after.timing.t)) / RATE)
        assert after.position[[0, -1]] == pytest.approx(before.position[[0, -1]], abs=1e-6)
        # The plain stroke's samples are up to 1 mm apart.
        assert away(after.position, before.position).max() < 0.6
        v = np.linalg.norm(np.diff(after.position, axis=0), axis=1) * RATE
        assert v[12:-12] == pytest.approx(40.0, rel=2e-3)
        assert v.max() < 40.1
        length = np.linalg.norm(np.diff(before.position, axis=0), axis=1).sum()
        assert after.timing.t[-1] == pytest.approx(length / 40.0 + 0.18, abs=0.06)
        # tau is that of a stroke of this duration.
        whole = skill.spring.tau * after.timing.t[-1] / skill.duration
        assert after.timing.tau == pytest.approx(whole)
    assert len({len(stroke.timing.t) for stroke in paced}) == 3


def test_a_stroke_that_meets_no_border_is_not_changed_by_splitting(skill):
    keep_off = KeepOff(None, (Band(500.0, 600.0),))
    plain, split = drawn(skill), drawn(skill, on_border="split", keep_off=keep_off)
    for before, after in zip(plain, split, strict=True):
        assert np.array_equal(after.position, before.position)
        assert after.cuts == ()


def test_a_stroke_is_split_into_what_lies_before_and_behind_where_it_may_not_be(skill):
    keep_off = KeepOff(None, (Band(40.0, 60.0),))
    plain = drawn(skill)
    for before, after in zip(
        plain, drawn(skill, on_border="split", keep_off=keep_off), strict=True
    ):
        first, second = after.pieces()
        assert first.position[0] == pytest.approx(before.position[0])
        assert second.position[-1] == pytest.approx(before.position[-1])
        for piece in (first, second):
            x = piece.position[:, 0]
            assert not ((x > 40.0) & (x < 60.0)).any()
            assert away(piece.position, before.position).max() < 0.6
            assert piece.timing.t == pytest.approx(np.arange(len(x)) / RATE)
        # From the first to the last sample of each part, where the piece comes to rest.
        x = before.position[:, 0]
        outside = np.flatnonzero((x > 40.0) & (x < 60.0))
        assert first.position[-1] == pytest.approx(before.position[outside[0] - 1], abs=1e-3)
        assert second.position[0] == pytest.approx(before.position[outside[-1] + 1], abs=1e-3)
        for piece, end in ((first, -1), (second, 0)):
            v = np.linalg.norm(np.diff(piece.position, axis=0), axis=1) * RATE
            assert v[end] < 0.05 * v.max()


@pytest.mark.parametrize("pace", [None, Pace(30.0)])
def test_clipped_at_a_pace_only_the_part_before_the_border_is_timed(skill, pace):
    keep_off = KeepOff(None, (Band(40.0, 60.0),))
    for after in drawn(skill, on_border="clip", keep_off=keep_off, pace=pace):
        assert after.status == Status.KEPT_OUT
        assert after.cuts == ()
        part = after.until_border()
        assert part.position[:, 0].max() <= 40.0
        assert part.position[-1, 0] > 37.0
        if pace is not None:
            v = np.linalg.norm(np.diff(part.position, axis=0), axis=1) * RATE
            assert v[12:-12] == pytest.approx(30.0, rel=2e-3)

"""Real human handwriting: strokes of the LASA set must fit and generalize.

Each regression and each test takes strokes of its own; `benchmarks.human_strokes` takes all 210.
"""

import numpy as np
import pytest

from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.generalization import draw
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.plane import extent
from tests.human_strokes import shapes, strokes
from tests.nearest import nearest_rms

UP = np.array([0.0, 0.0, 1.0])


def draw_at(skill, start, goal, duration=None):
    pairs = Pairs(np.array([start], dtype=float), np.array([goal], dtype=float))
    seconds = np.array([duration or skill.duration])
    return draw(skill, pairs, seconds, None, GeneralizeOptions(rate=100.0))[0]


@pytest.mark.sweep(kept=12)
@pytest.mark.slow
@pytest.mark.parametrize("shape", shapes())
@pytest.mark.parametrize(
    ("regression", "percent", "which"), [("lwr", 0.12, (0,)), ("ridge", 0.03, (1,))]
)
def test_reproduction_stays_within_the_promised_share_of_the_diagonal(
    shape, regression, percent, which
):
    for stroke in (strokes(shape)[i] for i in which):
        result = fit([stroke], FitOptions(regression=regression, trim=False))
        reproduced = result.reproductions[0].reproduced @ result.skill.frame.axes.T
        reproduced += result.skill.frame.start
        error = nearest_rms(reproduced, stroke.position) / extent(stroke.position)
        assert 100 * error <= percent
        ends = reproduced[[0, -1]] - stroke.position[[0, -1]]
        assert np.linalg.norm(ends, axis=1).max() <= 0.05


@pytest.mark.sweep(kept=6)
@pytest.mark.slow
@pytest.mark.parametrize("shape", shapes())
def test_new_pairs_keep_the_shape(shape):
    for stroke in (strokes(shape)[i] for i in (2,)):
        skill = fit([stroke], FitOptions()).skill
        size = extent(stroke.position)
        angle, length = 1.2, skill.frame.length
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        offset = np.zeros(3)
        offset[:2] = turn @ (skill.frame.goal - skill.frame.start)[:2]
        here = draw_at(skill, skill.frame.start, skill.frame.goal)
        there = draw_at(skill, [300, -200, 40], np.array([300, -200, 40]) + offset)
        moved = here.position - skill.frame.start
        if not skill.closed:  # a closed stroke keeps the base axes
            moved[:, :2] = moved[:, :2] @ turn.T
            assert np.abs(there.position - [300, -200, 40] - moved).max() < 1e-6 * size
        for factor in (0.01, 0.5, 3.0):
            goal = np.array([0.6, 0.8, 0.0]) * length * factor
            drawn = draw_at(skill, [0, 0, 0], goal, duration=2.5)
            assert np.all(np.isfinite(drawn.position))
            assert np.linalg.norm(drawn.position[-1] - goal) < 0.02 * size
            across = drawn.position @ np.cross(drawn.normal[0], [0.6, 0.8, 0.0])
            line = (here.position - skill.frame.start) @ skill.frame.axes[:, 1]
            if not skill.closed:
                assert np.ptp(across) == pytest.approx(np.ptp(line), abs=0.02 * size)
            assert extent(drawn.position) < (max(factor, 1.0) + 0.1) * 1.5 * size


def test_the_set_holds_what_the_promise_is_about():
    everything = [stroke for shape in shapes() for stroke in strokes(shape)]
    assert len(everything) == 210
    swinging, moving = 0, 0
    for stroke in everything:
        offsets = stroke.position - stroke.position[0]
        u = offsets[-1] / np.linalg.norm(offsets[-1])
        along = offsets @ u / np.linalg.norm(offsets[-1])
        swinging += bool(along.min() < -0.05 or along.max() > 1.05)
        first = np.linalg.norm(stroke.position[1] - stroke.position[0]) / stroke.t[1]
        mean = np.linalg.norm(np.diff(stroke.position, axis=0), axis=1).sum() / stroke.t[-1]
        moving += bool(first > 0.05 * mean)
    assert swinging >= 60
    assert moving >= 80


@pytest.mark.sweep(kept=6)
@pytest.mark.slow
@pytest.mark.parametrize("shape", shapes())
def test_strokes_that_end_where_they_began_keep_their_shape_and_reach_their_goal(shape):
    """Each stroke and its way back: closed, and beyond its own ends."""
    for stroke in (strokes(shape)[i] for i in (3,)):
        back = stroke.position[-2::-1]
        there_and_back = Trajectory(
            np.linspace(0.0, 2.0 * stroke.duration, 2 * len(stroke.t) - 1),
            np.concatenate([stroke.position, back]),
        )
        skill = fit([there_and_back], FitOptions()).skill
        assert skill.closed
        size = extent(stroke.position)
        drawn = draw_at(skill, [10, 20, 5], [10, 20, 5])
        moved = there_and_back.position - there_and_back.position[0] + [10, 20, 5]
        assert nearest_rms(drawn.position, moved) < 0.02 * size
        assert np.linalg.norm(drawn.position[-1] - [10, 20, 5]) < 0.01 * size

"""The side that a skill is drawn on, and the same stroke seen from the other one."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.dmp.feasibility import nearly_closed
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.sides import normals_at, taught_side, turned_over
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere
from tests.dmp.strokes import circle, paper_stroke

BALL = Sphere(np.array([0.0, 0.0, -50.0]), 50.0)
DIRECTIONS = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, 0.8, -0.6], [-1.0, 0.0, 0.0]])
STARTS = BALL.centre + 50.0 * DIRECTIONS


@pytest.fixture(scope="module")
def blind():
    """A skill without orientation, with some height over its plane."""
    t = np.linspace(0.0, 4.0, 301)
    s = t / 4.0
    u = s**3 * (10 - 15 * s + 6 * s * s)
    bump = np.sin(np.pi * u) ** 2
    position = np.stack([90 * u, 20 * np.sin(2 * np.pi * u) + 3 * bump, 6 * bump + 2 * u], axis=1)
    return fit([Trajectory(t, position)], FitOptions(normal=(0.0, 0.0, 1.0))).skill


def test_a_skill_turned_over_draws_the_same_stroke_in_axes_that_are_turned_over(blind):
    over = blind.turned_over()
    assert np.linalg.det(over.frame.axes) == pytest.approx(1.0)
    assert over.frame.normal == pytest.approx(-blind.frame.normal)
    t = np.linspace(0.0, blind.duration, 50)
    drawn = [s.response(t).between(s, s.start, s.goal)[:, :3] for s in (blind, over)]
    here, there = (
        x @ s.frame.axes.T + s.frame.start for x, s in zip(drawn, (blind, over), strict=True)
    )
    np.testing.assert_allclose(there, here, atol=1e-9)
    assert np.ptp(drawn[0][:, 2]) > 5.0
    least, largest = blind.heights
    assert over.heights == (-largest, -least)
    again = over.turned_over()
    for name in ("weights", "start", "goal", "initial_velocity"):
        assert np.array_equal(getattr(again, name), getattr(blind, name))
    assert again.heights == blind.heights
    # What is no place keeps its sign.
    assert np.array_equal(over.weights[3:], blind.weights[3:])


def test_a_skill_that_knows_its_side_is_not_turned_over():
    with pytest.raises(ValueError, match="knows its side"):
        fit([paper_stroke()], FitOptions()).skill.turned_over()


def test_pairs_are_turned_over_where_the_surface_looks_away_from_a_side_that_was_guessed(blind):
    up = np.array([0.0, 0.0, 1.0])
    pairs = Pairs(STARTS, STARTS + 1.0)
    guessed = replace(blind, side_guessed=True)
    assert turned_over(guessed, pairs, Plane(np.zeros(3), up)).tolist() == [False] * 4
    assert turned_over(guessed, pairs, Plane(np.zeros(3), -up)).tolist() == [True] * 4
    assert (
        turned_over(replace(blind, side_guessed=False), pairs, Plane(np.zeros(3), -up)).sum() == 0
    )
    assert turned_over(guessed, pairs, None).tolist() == [False] * 4
    # A sphere is drawn on from above, wherever its normal points; at its equator by the largest.
    normal = normals_at(BALL, STARTS)
    assert normal == pytest.approx(DIRECTIONS * [[1.0], [1.0], [-1.0], [-1.0]])
    aside = replace(guessed, frame=replace(blind.frame, axes=np.roll(blind.frame.axes, 1, axis=1)))
    looks = normal @ aside.frame.normal
    assert turned_over(aside, pairs, BALL).tolist() == (looks < 0.0).tolist()


def test_the_side_that_was_taught_is_the_tools_or_on_the_very_surface_that_surfaces():
    skill = fit([paper_stroke()], FitOptions()).skill
    tool = -skill.frame.rotation[:, 2]
    assert np.array_equal(taught_side(skill, BALL, STARTS), tool)
    named = replace(skill, surface={"kind": "sphere"})
    assert np.array_equal(taught_side(named, BALL, STARTS), tool)
    for inward in (1.0, -1.0):
        n = skill.frame.normal
        ball = Sphere(skill.frame.start - inward * 50.0 * n, 50.0)
        there = ball.centre + 50.0 * DIRECTIONS
        assert taught_side(named, ball, there) == pytest.approx(inward * DIRECTIONS)
        aside = Sphere(ball.centre + [0.0, 0.0, 0.2], 50.0)
        assert np.array_equal(taught_side(named, aside, there), tool)


def test_without_orientation_the_side_is_the_normal_where_it_was_taught_if_anywhere(blind):
    assert taught_side(replace(blind, surface=None), BALL, STARTS) is None
    far = replace(blind, surface={"kind": "sphere"})
    far = replace(far, frame=replace(far.frame, start=np.array([0.0, 0.0, 30.0])))
    assert np.array_equal(taught_side(far, BALL, STARTS), far.frame.normal)


@pytest.mark.parametrize("degrees", [90.0, 300.0, 325.0, 340.0])
def test_a_stroke_is_nearly_closed_where_its_ends_are_near_for_its_size(degrees):
    angle = np.radians(degrees) * np.linspace(0.0, 1.0, 401)
    t = np.linspace(0.0, 6.0, 401)
    arc = np.stack([30 * np.cos(angle), 30 * np.sin(angle), 0 * t], axis=1)
    skill = fit([Trajectory(t, arc)], FitOptions(normal=(0.0, 0.0, 1.0))).skill
    # The box is that in the chart, whose u axis is the chord.
    chord = 60.0 * np.sin(np.radians(degrees) / 2)
    u = arc[-1] - arc[0]
    u /= np.linalg.norm(u)
    box = np.hypot(np.ptp(arc @ u), np.ptp(arc @ np.cross([0.0, 0.0, 1.0], u)))
    assert nearly_closed(skill) == (chord < 0.25 * box)


def test_a_closed_stroke_is_nearly_closed_but_not_to_the_papers_learning():
    assert nearly_closed(fit([circle()], FitOptions()).skill)
    assert not nearly_closed(fit([circle()], FitOptions(learning="paper")).skill)

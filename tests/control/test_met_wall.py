"""A wall: how hard it was met, and what no loop of that delay would have spared the tool."""

import numpy as np
import pytest

from dmpcli.control.met_wall import against, met, resisting


def rising(begin, slope, until, since=0.0, every=0.01, most=200):
    """Readings of a force that rises by so many N/s from a time on, and rests from another."""
    times = [since + every * n for n in range(most)]
    return [(t, max(min(t, until) - begin, 0.0) * slope) for t in times]


@pytest.mark.parametrize("begin", [0.1, 0.1004, 0.107, 0.1099])
def test_the_unavoidable_force_does_not_depend_on_when_in_a_cycle_the_wall_is_met(begin):
    """20 mm/s into 45 N/mm, known after 75 ms: 67.5 N, whatever the first readings show of it."""
    felt = rising(begin, 20.0 * 45.0, begin + 0.06)
    wall = met(2.5, felt, 20.0, 0.075, 0.02)
    assert wall.stiffness == pytest.approx(45.0)
    assert wall.unavoidable == pytest.approx(67.5)
    assert wall.largest == pytest.approx(54.0)
    assert "67.5 N are unavoidable at 20 mm/s on 45 N/mm behind 0.075 s" in str(wall)


def test_the_largest_force_is_that_at_which_it_was_ended_where_nothing_more_was_felt():
    wall = met(9.0, [(0.0, 1.0), (0.01, 4.0)], 10.0, 0.05, 0.02)
    assert wall.largest == 9.0
    assert wall.unavoidable == pytest.approx(0.05 * 300.0)


def test_the_blow_at_the_first_touch_is_no_stiffness():
    """As on the bench: 18 N at once by inertia and damping, then 800 N/s until the arm stands."""
    felt = [(0.0, 1.0), (0.01, 18.5), (0.02, 26.5), (0.03, 3.3), (0.04, 4.1)]
    assert met(22.5, felt, 21.0, 0.075, 0.02).unavoidable == pytest.approx(60.0)


def test_one_reading_that_felt_the_wall_is_taken_to_have_risen_for_a_period_and_half_a_step():
    felt = [(0.0, 0.1), (0.01, 0.0), (0.02, 20.3), (0.03, 0.3), (0.04, 0.7)]
    assert met(10.2, felt, 21.0, 0.075, 0.02).unavoidable == pytest.approx(0.075 * 20.3 / 0.025)


@pytest.mark.parametrize("friction", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("slant", [30.0, -35.0, 60.0])
@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8)])
def test_what_slides_along_a_wall_that_rubs_is_no_speed_against_it(friction, slant, up):
    """Coulomb: the force leans from the wall's normal, against the sliding."""
    up = np.array(up)
    wall = np.cross(up, [0.0, 1.0, 0.0])
    wall /= np.linalg.norm(wall)
    beside, turn = np.cross(up, wall), np.radians(slant)
    velocity = 30.0 * (-np.cos(turn) * wall + np.sin(turn) * beside)
    force = 12.0 * (wall - friction * np.sign(slant) * beside) + 5.0 * up
    series, speed = against([(0.0, 0.1 * force), (0.01, force)], up, velocity, friction)
    assert speed == pytest.approx(30.0 * np.cos(turn))
    assert [t for t, _ in series] == [0.0, 0.01]
    assert series[1][1] == pytest.approx(12.0 * np.hypot(1.0, friction))


def test_a_force_along_the_way_is_no_wall():
    up = np.array([0.0, 0.0, 1.0])
    _, speed = against([(0.0, np.array([0.0, 3.0, 0.0]))], up, np.array([9.0, 0.0, 0.0]), 0.3)
    assert speed == pytest.approx(0.0, abs=1e-12)
    assert against([(0.0, 2.0 * up)], up, np.array([9.0, 0.0, 0.0]), 0.3)[1] == 0.0


@pytest.mark.parametrize("felt", [[], [(0.0, 0.0), (0.01, 0.0)]])
def test_where_nothing_was_felt_nothing_is_said(felt):
    assert met(4.0, felt, 10.0, 0.05, 0.02) is None


def test_nor_of_a_tool_that_does_not_move():
    assert met(4.0, rising(0.0, 100.0, 1.0), 0.0, 0.05, 0.02) is None


@pytest.mark.parametrize("turn", [0.0, 50.0, -80.0, 85.0])
def test_a_wall_that_the_tool_runs_into_resists_with_all_of_its_force(turn):
    """At any slant, with friction on wall and floor: its force takes work from the tool."""
    angle = np.radians(turn)
    wall, beside = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    way = 0.4 * (-np.cos(angle) * wall + np.sin(angle) * beside)
    heading = way / np.linalg.norm(way)
    side = 6.0 * (wall - 0.2 * np.sign(turn) * beside) - 0.2 * 5.0 * heading
    assert resisting(side, way, 0.2 * 5.0) == pytest.approx(np.linalg.norm(side))


@pytest.mark.parametrize("turn", [0.0, 50.0, -80.0])
def test_an_edge_that_the_tool_slides_down_from_resists_nothing(turn):
    angle = np.radians(turn)
    off = np.array([0.6, 0.8, 0.0])
    beside = np.array([-0.8, 0.6, 0.0])
    way = 0.3 * (np.cos(angle) * off + np.sin(angle) * beside)
    heading = way / np.linalg.norm(way)
    side = 4.4 * off - 0.2 * 5.0 * heading
    assert resisting(side, way, 0.2 * 5.0) == 0.0


def test_beside_a_tool_that_does_not_move_every_force_counts():
    assert resisting((3.0, 4.0, 0.0), (0.0, 0.0, 0.0), 1.0) == 5.0

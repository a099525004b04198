import numpy as np
import pytest

from dmpcli.dmp.drawn_strokes import DrawnStroke
from dmpcli.dmp.time_scaling import Timing
from dmpcli.errors import RefusedError
from dmpcli.kinematics import chain, models
from dmpcli.kinematics.reachability import Reach, attitude
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp, from_euler, to_euler
from dmpcli.spatial.wrench import Tool
from dmpcli.surfaces.surface import Status

EC66 = models.model("ec66")
RATE = 50.0
Q = np.array([0.4, -1.1, 1.3, -1.5, -1.5, 0.7])
PEN = Tool(
    tcp_position=np.array([10.0, -20.0, 150.0]),
    tcp_rotation=from_euler(np.array([0.1, 0.2, 0.3])),
    sensor_position=np.zeros(3),
    sensor_rotation=np.eye(3),
    weight=5.0,
    centre=np.zeros(3),
)


def stroke(position, euler=None, normal=None):
    t = np.arange(len(position)) / RATE
    status = Status.DRAWN
    return DrawnStroke(Timing(t, t, 1.0), position, euler, normal, status, np.zeros(1, bool), False)


def line(start, goal, samples=101):
    return np.linspace(start, np.asarray(goal, dtype=float), samples)


DOWN = np.tile([np.pi, 0.0, 0.0], (101, 1))


def test_a_stroke_in_reach_is_not_refused_and_one_beyond_says_where_and_by_how_much():
    near, far = line([500, -100, 100], [500, 100, 100]), line([500, 0, 100], [1100, 0, 100])
    said = Reach(EC66).refusals([stroke(near, DOWN), stroke(far, DOWN)], RATE)
    assert said[0] == ""
    assert said[1].startswith("out of reach: at t = 2.000 s the ec66 misses the pose by ")


def test_strokes_of_different_lengths_are_each_judged_in_their_place():
    strokes = [
        stroke(line([500, 0, 100], [1100, 0, 100], n), DOWN[:n])
        if n % 2
        else stroke(line([500, -50, 100], [500, 50, 100], n), DOWN[:n])
        for n in (51, 80, 33, 60, 51, 1)
    ]
    said = Reach(EC66).refusals(strokes, RATE)
    assert [bool(text) for text in said] == [True, False, True, False, True, False]


def test_too_fast_a_stroke_says_how_much_longer_it_must_last():
    n = 9
    fast = line([500, -150, 100], [500, 150, 100], n)
    [said] = Reach(EC66).refusals([stroke(fast, DOWN[:n])], RATE)
    assert "would turn at" in said
    factor = float(said.split("; ")[1].split(" times")[0])
    assert factor > 1
    # Stretched so much, on the same path, it is let pass; a little less, it is not.
    assert Reach(EC66).refusals([stroke(fast, DOWN[:n])], RATE / factor) == [""]
    assert Reach(EC66).refusals([stroke(fast, DOWN[:n])], RATE / (factor - 0.02)) != [""]


def test_the_tool_moves_what_can_be_reached():
    at_limit = line([830, -10, 0], [830, 10, 0])
    bare = Reach(EC66).refusals([stroke(at_limit, DOWN)], RATE)
    long_pen = Tool(np.array([0, 0, 500.0]), np.eye(3), np.zeros(3), np.eye(3), 1.0, np.zeros(3))
    assert bare == [""]
    assert Reach(EC66, long_pen).refusals([stroke(at_limit, DOWN)], RATE) != [""]


@pytest.mark.parametrize("base_turn", [0.0, np.pi])
@pytest.mark.parametrize("flange_turn", [0.0, np.pi / 2])
def test_the_joints_that_a_robot_tells_are_believed_only_where_its_tcp_is(base_turn, flange_turn):
    # The TCP composed from the chain, not taken apart as the code does.
    at = chain.forward(EC66, Q)
    p, R = at.position, at.rotation
    base, flange = exp(np.array([0, 0, -base_turn])), exp(np.array([0, 0, flange_turn]))
    attitude_of_flange = base @ R @ flange
    position = base @ p + attitude_of_flange @ PEN.tcp_position
    rotation = attitude_of_flange @ PEN.tcp_rotation
    reach = Reach(EC66, PEN, base_turn, flange_turn)
    tcp = Pose(position, rotation)
    assert reach.standing(Q, tcp) is Q
    assert reach.standing(None, tcp) is None
    with pytest.raises(RefusedError, match=r"10\.0 mm and 0\.0° from where an ec66"):
        reach.standing(Q, Pose(position + [0, 0, 10], rotation))
    with pytest.raises(RefusedError, match="check --robot-model and --tool"):
        reach.standing(np.zeros(7), tcp)
    found = reach.follow(position[None, None], rotation[None, None], 0.02, Q)
    assert found.joints[0, 0] == pytest.approx(Q, abs=1e-9)


def test_the_stroke_of_a_start_is_followed_from_that_start():
    at = chain.forward(EC66, Q + np.linspace(0, 0.3, 30)[:, None])
    position, rotation = at.position, at.rotation
    found = Reach(EC66).follow(position[None], rotation[None], 0.02, Q)
    assert found.joints[0, -1] == pytest.approx(Q + 0.3, abs=1e-9)


@pytest.mark.parametrize(
    "normal", [[0, 0, 1.0], [0.6, 0, 0.8], [0, 1.0, 0], [0, 0, -1.0], [0.0, 0.6, -0.8]]
)
def test_a_stroke_without_orientation_is_held_against_its_normal(normal):
    normal = np.array(normal)
    R = attitude(stroke(line([0, 0, 0], [1, 0, 0], 5), normal=normal[None]))
    assert R.shape == (5, 3, 3)
    assert R[0] @ R[0].T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(R[0]) == pytest.approx(1.0)
    assert R[0][:, 2] == pytest.approx(-normal)


def test_on_a_level_plane_the_pen_points_straight_down_with_its_x_axis_along_base_x():
    held = attitude(stroke(line([0, 0, 0], [1, 0, 0], 5), normal=np.array([[0, 0, 1.0]])))
    assert to_euler(held[0]) == pytest.approx([np.pi, 0, 0])
    assert attitude(stroke(line([0, 0, 0], [1, 0, 0], 5)))[0] == pytest.approx(held[0])


def test_a_stroke_with_orientation_keeps_its_own():
    angles = np.linspace([3, 0, 0], [3.2, 0.1, 0.4], 5)
    assert attitude(stroke(line([0, 0, 0], [1, 0, 0], 5), angles)) == pytest.approx(
        from_euler(angles)
    )

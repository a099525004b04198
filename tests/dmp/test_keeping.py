"""What a skill keeps by construction: ends, the frame it was taught in, and the paper's numbers."""

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.generalization import draw
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.spatial.trajectory import Trajectory
from tests import cases
from tests.dmp.strokes import circle, paper_stroke
from tests.human_strokes import strokes as human_strokes

Q = Rotation.from_euler("xyz", [0.7, -0.4, 2.1]).as_matrix()
SHIFT = np.array([310.0, -820.0, 95.0])
MIRROR = np.diag([1.0, -1.0, 1.0])


def drawn(skill, start, goal, duration=None, rate=100.0, **style):
    pairs = Pairs(np.array([start], dtype=float), np.array([goal], dtype=float))
    seconds = np.array([duration or skill.duration])
    return draw(skill, pairs, seconds, None, GeneralizeOptions(rate=rate, **style))[0]


def wandering(seed, samples=301, duration=4.0):
    """Return an open stroke in motion at both ends, of a few random sines about a line."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, duration, samples)
    r = t / duration
    position = np.outer(r, [120.0, 30.0, 0.0])
    for k in range(1, 5):
        size = rng.normal(0.0, 12.0 / k, 3) * [1.0, 1.0, 0.3]
        position += np.outer(np.sin(np.pi * k * r + rng.uniform(0.0, 6.0)), size)
    return Trajectory(t, position)


# Ends.


@pytest.mark.slow
@settings(max_examples=25, phases=[Phase.explicit, Phase.generate])
@given(
    seed=st.integers(0, 10_000),
    regression=st.sampled_from(["lwr", "ridge"]),
    basis=st.integers(2, 200) | st.none(),
    damping=st.floats(4.0, 60.0),
    tau=st.floats(0.2, 1.0),
    share=st.floats(0.1, 1.7),
    stretch=st.floats(0.3, 2.5),
)
def test_an_open_stroke_ends_on_any_goal(seed, regression, basis, damping, tau, share, stretch):
    choices = FitOptions(
        regression=regression, basis=basis, damping=damping, tau=tau, alpha_1=share * 2 * tau
    )
    skill = fit([wandering(seed)], choices).skill
    along = skill.frame.goal - skill.frame.start
    turned = Rotation.from_rotvec(0.8 * skill.frame.normal).as_matrix() @ along
    for goal in (along, stretch * along, stretch * turned):
        found = drawn(skill, SHIFT, SHIFT + goal, rate=25.0)
        # w ends at the skill's own.
        asked = SHIFT + goal + skill.goal[2] * skill.frame.normal
        assert np.linalg.norm(found.position[-1] - asked) <= 1e-6


def velocities(result):
    """Velocities (2, 3) of reproduction and demonstration at the start and at the end, mm/s.

    Of the reproduction by differences of the exact roll-out.
    """
    skill = result.skill
    h = 1e-4 * skill.duration
    steps = h * np.arange(5.0)
    t = np.concatenate([steps, skill.duration - steps[::-1]])
    r = skill.response(t)
    x = skill.start * r.a + skill.goal * r.b + skill.initial_velocity * r.c
    x = (x + skill.alpha_f * r.forced)[:, :3]
    backward = np.array([0.25, -4.0 / 3.0, 3.0, -4.0, 25.0 / 12.0])
    found = np.stack([-backward[::-1] @ x[:5], backward @ x[5:]]) / h
    return found, result.prepared[0].signal.velocity[[0, -1], :3]


@pytest.mark.slow
@settings(max_examples=15, phases=[Phase.explicit, Phase.generate])
@given(
    seed=st.integers(0, 10_000),
    regression=st.sampled_from(["lwr", "ridge"]),
    basis=st.integers(20, 200),
    samples=st.sampled_from([61, 101, 301]),
    damping=st.floats(4.0, 60.0),
    tau=st.floats(0.3, 1.0),
)
def test_it_begins_and_ends_at_the_demonstrated_velocity(
    seed, regression, basis, samples, damping, tau
):
    """Whether N carries the whole band of the recording or not."""
    choices = FitOptions(regression=regression, basis=basis, damping=damping, tau=tau)
    velocity, taught = velocities(fit([wandering(seed, samples)], choices))
    # The differences are within 1e-6 of it themselves.
    assert velocity == pytest.approx(taught, abs=2e-6 * np.abs(taught).max())


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("shape", ["Snake", "WShape"])
def test_strokes_that_people_stop_abruptly_end_at_their_velocity(shape):
    """By the samples themselves, whose last steps tell it roughly: by no swing of a spline."""
    for stroke in human_strokes(shape):
        velocity, taught = velocities(fit([stroke], FitOptions(trim=False)))
        assert velocity == pytest.approx(taught, abs=1e-4 * np.abs(taught).max() + 1e-4)
        x, h = stroke.position, stroke.t[1] - stroke.t[0]
        last = (3.0 * x[-1] - 4.0 * x[-2] + x[-3]) / (2.0 * h)
        fastest = np.linalg.norm(np.diff(x, axis=0), axis=1).max() / h
        assert np.linalg.norm(taught[1] - last) <= 0.6 * fastest


# Equivariance.

STROKES = {
    "paper": lambda: paper_stroke(turning=True),
    "lifted": lambda: from_table(cases.pen_lift(oriented=True)),
    "aslant": lambda: from_table(cases.aslant(30.0, "x")),
    "circle": circle,
    "wandering": lambda: wandering(3),
}


def from_table(table):
    """Stroke of a recording with or without quaternions."""
    rotation = None
    if table.shape[1] == 8:
        rotation = Rotation.from_quat(table[:, 4:]).as_matrix()
    return Trajectory(table[:, 0], table[:, 1:4], rotation)


@pytest.mark.sweep(kept=3)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "lifted", "aslant"])
@pytest.mark.parametrize("regression", ["lwr", "ridge"])
def test_moving_a_recording_with_its_tool_moves_the_drawn_stroke(name, regression):
    here = STROKES[name]()
    there = Trajectory(here.t, here.position @ Q.T + SHIFT, Q @ here.rotation)
    a, b = (fit([s], FitOptions(regression=regression)).skill for s in (here, there))
    start = here.position[0] + [3.0, -8.0, 0.0]
    goal = start + 1.3 * (here.position[-1] - here.position[0])
    old, new = drawn(a, start, goal), drawn(b, Q @ start + SHIFT, Q @ goal + SHIFT)
    np.testing.assert_allclose(new.position, old.position @ Q.T + SHIFT, atol=1e-5)
    turned = Q @ Rotation.from_euler("XYZ", old.euler).as_matrix()
    found = Rotation.from_euler("XYZ", new.euler).as_matrix()
    np.testing.assert_allclose(found, turned, atol=1e-7)


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "wandering", "lifted"])
def test_mirroring_a_recording_mirrors_the_drawn_stroke(name):
    here = STROKES[name]()
    there = Trajectory(here.t, here.position @ MIRROR)
    a, b = (
        fit([Trajectory(here.t, here.position)], FitOptions()).skill,
        fit([there], FitOptions()).skill,
    )
    start = here.position[0] + [3.0, -8.0, 0.0]
    goal = start + 0.7 * (here.position[-1] - here.position[0])
    old, new = drawn(a, start, goal), drawn(b, MIRROR @ start, MIRROR @ goal)
    np.testing.assert_allclose(new.position, old.position @ MIRROR, atol=1e-5)


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["timing", "shaken", "walls"])
def test_the_order_of_demonstrations_changes_nothing(kind):
    if kind == "timing":
        strokes = [from_table(cases.timing(name)) for name in cases.TIMINGS]
    elif kind == "walls":
        strokes = [from_table(cases.wall(lean)) for lean in (-3.0, 2.0, 3.0)]
    else:
        whole = paper_stroke(turning=True)
        strokes = []
        for seed in range(3):
            rng = np.random.default_rng(seed)
            turn = Rotation.from_euler("z", rng.normal(0.0, 0.03)).as_matrix()
            position = whole.position @ turn.T + rng.normal(0.0, 0.1, whole.position.shape)
            strokes.append(
                Trajectory(whole.t, position + rng.normal(0.0, 2.0, 3), turn @ whole.rotation)
            )
    forward = fit(strokes, FitOptions()).skill
    start, goal = np.array([10.0, 20.0, 5.0]), np.array([-90.0, 60.0, 5.0])
    old = drawn(forward, start, goal)
    for order in (strokes[::-1], [*strokes[1:], strokes[0]]):
        skill = fit(order, FitOptions()).skill
        assert np.abs(skill.frame.start - forward.frame.start).max() <= 1e-9
        assert np.abs(skill.frame.goal - forward.frame.goal).max() <= 1e-9
        assert np.abs(drawn(skill, start, goal).position - old.position).max() <= 1e-9


# The paper's learning, by the figures that it gave before there was another.

PAPER = {"alpha_1": 1.7, "widths": "power", "learning": "paper", "basis": 80}
AS_IT_WAS = {
    "modified": (-14198.780725784427, 6723.273680976657, 1.036024835524877, 0.5475210267525286),
    "ridge": (-14241.702081510324, 6819.24981042322, 1.000000069816149, 0.0002595698667121143),
    "axis": (-130.35267647983582, 4742.79111838476, 1.0, 0.748244036226035),
    "distance": (130.34245198043578, -59.39434958614266, 1.0, 0.748244036226037),
}
"""Weights u, 8th and v, 21st; alpha_f of v; RMS, mm."""


@pytest.mark.parametrize("name", AS_IT_WAS)
def test_the_papers_learning_gives_the_figures_it_always_gave(name):
    own = {"modified": {}, "ridge": {"regression": "ridge"}}
    other = {"model": "original", "forcing_scale": name}
    result = fit([paper_stroke(turning=True)], FitOptions(**PAPER, **own.get(name, other)))
    skill = result.skill
    found = (skill.weights[0, 7], skill.weights[1, 20], skill.alpha_f[1])
    # One last bit of a sine may differ between processor types.
    assert (*found, result.reproductions[0].rms) == pytest.approx(AS_IT_WAS[name], rel=1e-9)


@pytest.mark.parametrize(("regression", "most"), [("lwr", 0.05), ("ridge", 0.005)])
def test_the_default_keeps_the_reference_stroke(regression, most):
    stroke = paper_stroke(turning=True)
    result = fit([stroke], FitOptions(regression=regression))
    found = drawn(result.skill, stroke.position[0], stroke.position[-1])
    distance = np.linalg.norm(found.position[::2] - stroke.position, axis=1)
    assert distance.max() <= 2.0 * most
    assert result.reproductions[0].rms <= most
    heights = result.reproductions[0].wave
    assert abs(heights[1] - heights[0]) <= most
    assert distance[-1] <= 1e-6

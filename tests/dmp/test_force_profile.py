"""The force along a stroke as a seventh primitive: what is learned of it, and what is drawn."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from dmpcli.dmp.canonical_system import even_in_time
from dmpcli.dmp.contact_heights import contact_heights
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.force_profile import ForceProfile, unsprung
from dmpcli.dmp.generalization import draw
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.transformation_system import TransformationGains
from dmpcli.errors import InputError
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.plane import Plane
from tests.minimum_jerk import minimum_jerk

DURATION, STIFFNESS = 10.0, 2.0
NORMAL = (0.0, 0.0, 1.0)


def taught(t):
    """3 to 8 to 4 N, in a closed form."""
    u = t / DURATION
    return 3.0 + u + 4.5 * np.sin(np.pi * u) ** 2


def pressed_stroke(force=taught, noise=0.0, samples=1001, lift=None, stiffness=STIFFNESS):
    """A wave on the plane z = 0 drawn by a pen that gives way; the tool points straight down."""
    t = np.linspace(0.0, DURATION, samples)
    u = minimum_jerk(t / DURATION)
    f = force(t)
    height = -f / stiffness if lift is None else np.where(f > 0.0, -f / stiffness, lift(t))
    position = np.stack([120.0 * u, 25.0 * np.sin(2.0 * np.pi * u), height], axis=1)
    rotation = np.broadcast_to(rotations.from_euler(np.array([np.pi, 0.0, 0.0])), (samples, 3, 3))
    felt = np.zeros((samples, 3))
    felt[:, 2] = f
    felt[:, 0] = -0.2 * f  # friction lies in the plane
    felt += noise * np.random.default_rng(3).normal(size=felt.shape)
    return Trajectory(t, position, rotation, contact_force=felt)


def learned(stroke, **options):
    return fit([stroke], FitOptions(force_profile=True, normal=NORMAL, **options)).skill


def test_the_profile_that_was_taught_comes_back_in_its_closed_form():
    skill = learned(pressed_stroke())
    t = np.linspace(0.0, DURATION, 501)
    np.testing.assert_allclose(skill.taught_force(t), taught(t), atol=0.02)
    assert skill.force.rms < 0.01
    assert skill.taught_force(t)[-1] == pytest.approx(4.0, abs=1e-6)
    # Pressed by 1 N more at the goal than at the start, the pen does not lean the plane.
    np.testing.assert_allclose(skill.frame.normal, NORMAL, atol=1e-12)


def test_noise_of_the_sensor_is_smoothed_away():
    skill = learned(pressed_stroke(noise=0.1))
    t = np.linspace(0.0, DURATION, 501)
    assert np.sqrt(np.mean((skill.taught_force(t) - taught(t)) ** 2)) < 0.05


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(
    st.integers(2, 30),
    st.floats(0.3, 2.0),
    st.floats(0.0, 10.0),
    st.floats(0.0, 10.0),
    st.floats(-20.0, 20.0),
    st.integers(0, 2**31),
)
def test_the_roll_out_is_what_an_integrator_makes_of_the_same_equations(
    count, alpha_1, start, goal, V0, seed
):
    tau, d = 3.0, 20.0
    k = d * d / 4.0
    basis = even_in_time(count, DURATION, tau, alpha_1, "spacing")
    weights = 300.0 * np.random.default_rng(seed).normal(size=count)
    profile = ForceProfile(weights, 0.8, start, goal, V0)
    spring = TransformationGains(np.full(6, k), np.full(6, d), tau)
    t = np.linspace(0.0, DURATION, 41)
    found = profile.at(t, spring, basis, alpha_1, DURATION)

    def slope(at, state):
        x, V = state
        s = np.exp(-alpha_1 * at / tau)
        psi = np.exp(-basis.widths * (s - basis.centres) ** 2)
        f = s * (psi @ weights) / psi.sum()
        return [V / tau, (k * (goal - x) - d * V + 0.8 * f) / tau]

    true = solve_ivp(
        slope,
        (0.0, DURATION),
        [start, V0],
        method="DOP853",
        t_eval=t,
        rtol=1e-10,
        atol=1e-10,
        max_step=0.2,
    )
    scale = 1.0 + np.abs(true.y[0]).max()
    np.testing.assert_allclose(found, true.y[0], rtol=0, atol=2e-7 * scale)


def test_how_deep_a_pressed_pen_stands_in_its_spring_is_no_geometry():
    """The plain skill follows the pen down by millimetres, the one with a profile stays at 0."""
    stroke = pressed_stroke()
    t = np.linspace(0.0, DURATION, 301)

    def w(skill):
        r = skill.response(t)
        return r.between(skill, skill.start, skill.goal)[:, 2]

    assert np.ptp(w(fit([stroke], FitOptions(normal=NORMAL)).skill)) > 2.0
    assert np.abs(w(learned(stroke))).max() < 1e-9


def lifted_force(t):
    """Pressed with 4 N, lifted from 4 to 6 s; ramps of 0.3 s."""
    ramp = np.clip((np.abs(t - 5.0) - 1.0) / 0.3, 0.0, 1.0)
    return 4.0 * ramp


def test_where_the_pen_was_lifted_it_is_lifted_and_nothing_presses():
    # A pen that gives way by 2 mm touches at z = 0; lifted, it is 6 mm over the work.
    stroke = pressed_stroke(
        lifted_force, lift=lambda t: 6.0 * np.clip(1.0 - np.abs(t - 5.0), 0.0, 1.0) ** 2
    )
    skill = learned(stroke)
    pairs = Pairs(np.array([[0.0, 0.0, 0.0]]), np.array([[120.0, 0.0, 0.0]]))
    (drawn,) = draw(skill, pairs, np.array([DURATION]), None, GeneralizeOptions())
    t = drawn.timing.t
    assert np.all(drawn.force[np.abs(t - 5.0) < 0.6] == 0.0)
    np.testing.assert_allclose(drawn.force[np.abs(t - 5.0) > 1.8], 4.0, atol=0.1)
    assert drawn.position[np.argmin(np.abs(t - 5.0)), 2] == pytest.approx(6.0, abs=0.3)
    np.testing.assert_allclose(drawn.position[np.abs(t - 5.0) > 1.6, 2], 0.0, atol=0.05)


def test_the_profile_keeps_its_place_on_another_surface_and_at_another_duration():
    skill = learned(pressed_stroke())
    cylinder = Cylinder(np.array([0.0, 0.0, -60.0]), np.array([1.0, 0.0, 0.0]), 60.0)
    pairs = Pairs(np.array([[0.0, 0.0, 0.0]]), np.array([[109.0, 0.0, 0.0]]))
    (drawn,) = draw(skill, pairs, np.array([2 * DURATION]), cylinder, GeneralizeOptions())
    np.testing.assert_allclose(drawn.force, taught(drawn.timing.t / 2.0), atol=0.02)


def test_at_a_stand_off_nothing_presses():
    skill = learned(pressed_stroke())
    pairs = Pairs(np.array([[0.0, 0.0, 0.0]]), np.array([[120.0, 0.0, 0.0]]))
    style = GeneralizeOptions(heights=contact_heights(skill, None, 5.0))
    (drawn,) = draw(skill, pairs, np.array([DURATION]), Plane(np.zeros(3), np.array(NORMAL)), style)
    assert set(drawn.force) == {0.0}


def test_a_set_point_overrides_the_profile():
    skill = learned(pressed_stroke())
    pairs = Pairs(np.array([[0.0, 0.0, 0.0]]), np.array([[120.0, 0.0, 0.0]]))
    (drawn,) = draw(skill, pairs, np.array([DURATION]), None, GeneralizeOptions(force=6.0))
    assert set(drawn.force) == {6.0}


def test_several_demonstrations_are_averaged():
    strokes = [pressed_stroke(lambda t, by=by: taught(t) + by) for by in (-1.0, 1.0)]
    skill = fit(strokes, FitOptions(force_profile=True, normal=NORMAL)).skill
    t = np.linspace(0.0, DURATION, 201)
    np.testing.assert_allclose(skill.taught_force(t), taught(t), atol=0.03)


def test_a_recording_in_the_air_or_pushed_from_the_other_side_teaches_no_force():
    with pytest.raises(InputError, match=r"in 0 % of the stroke; record it in contact"):
        learned(pressed_stroke(lambda t: 0.1 + 0.0 * t))
    with pytest.raises(InputError, match="pushes to the other side"):
        learned(pressed_stroke(lambda t: -taught(t)))
    with pytest.raises(InputError, match=r"^--force-profile: "):
        fit([pressed_stroke()], FitOptions(force_profile=True, learning="paper"))


def test_heights_of_a_stroke_all_in_contact_are_0_and_in_the_air_untouched():
    w = np.linspace(-3.0, 5.0, 50)
    np.testing.assert_array_equal(unsprung(w, np.full(50, 2.0)), np.zeros(50))
    np.testing.assert_array_equal(unsprung(w, np.zeros(50)), w)


def test_of_several_the_one_without_force_is_named():
    good, air = pressed_stroke(samples=201), pressed_stroke(lambda t: 0.0 * t, samples=201)
    bare = replace(good, contact_force=None)
    for others, number in (([good, bare], 2), ([bare, good], 1), ([good, good, air], 3)):
        with pytest.raises(InputError, match=f"^demonstration {number}: --force-profile"):
            fit(others, FitOptions(force_profile=True, normal=NORMAL))


def test_a_force_is_learned_whole_by_as_many_functions_as_it_has_samples():
    stroke = pressed_stroke(samples=61)
    skill = learned(stroke, basis=241, trim=False)
    t = np.linspace(0.0, DURATION, 61)
    np.testing.assert_allclose(skill.taught_force(t), taught(t), atol=1e-3)

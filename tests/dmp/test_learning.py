"""What a fit must reach, and the strokes that must not break it."""

import numpy as np
import pytest

from dmpcli.dmp.learning import _beyond_noise, fit
from dmpcli.dmp.options import FitOptions
from dmpcli.errors import InputError
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from tests.dmp.strokes import HEIGHT, circle, paper_stroke
from tests.minimum_jerk import minimum_jerk


def height(reproduction):
    return np.ptp(reproduction.reproduced[:, 1])


def test_default_preset_reproduces_within_the_promised_bounds():
    lwr = fit([paper_stroke()], FitOptions()).reproductions[0]
    assert lwr.rms <= 0.05
    assert lwr.end <= 0.01
    assert abs(height(lwr) - HEIGHT) <= 0.05
    ridge = fit([paper_stroke()], FitOptions(regression="ridge")).reproductions[0]
    assert ridge.rms <= 0.002
    assert ridge.end <= 0.01
    assert abs(height(ridge) - HEIGHT) <= 0.005


def test_paper_preset_attenuates_as_table_1_and_alpha_f_repairs_it():
    paper = {"alpha_1": 1.7, "widths": "power", "learning": "paper"}
    original = fit([paper_stroke()], FitOptions(model="original", **paper)).reproductions[0]
    modified = fit([paper_stroke()], FitOptions(**paper)).reproductions[0]
    assert abs(height(original) - 47.669) <= 0.5
    assert height(modified) >= 49.16


def test_in_chart_coordinates_the_goal_lies_on_the_u_axis():
    skill = fit([paper_stroke()], FitOptions()).skill
    np.testing.assert_allclose(skill.goal[1:3], 0.0, atol=1e-9)
    assert skill.goal[0] == pytest.approx(skill.frame.length)


def test_fit_does_not_depend_on_where_and_how_the_stroke_lies():
    here = paper_stroke(turning=True)
    Q, shift = rotations.from_euler(np.array([0.4, -0.3, 1.1])), np.array([10.0, -900.0, 300.0])
    there = Trajectory(here.t, here.position @ Q.T + shift, Q @ here.rotation)
    a, b = fit([here], FitOptions()).skill, fit([there], FitOptions()).skill
    # Straight-down ties are broken by base axes, so the frames agree up to the motion itself.
    np.testing.assert_allclose(b.frame.axes, Q @ a.frame.axes, atol=1e-9)
    np.testing.assert_allclose(b.weights, a.weights, atol=1e-5)


def test_a_nearly_zero_component_of_the_original_model_is_fitted_with_factor_1():
    stroke = paper_stroke()
    result = fit([stroke], FitOptions(model="original"))
    assert result.skill.exempt.tolist()[:3] == [False, False, True]
    assert result.skill.forcing_factor[2] == 1.0
    assert np.abs(result.skill.weights[2]).max() < 100.0
    assert result.reproductions[0].rms < 0.2


@pytest.mark.parametrize("model", ["modified", "original"])
@pytest.mark.parametrize("regression", ["lwr", "ridge"])
def test_a_closed_stroke_fits_without_blow_up(model, regression):
    result = fit([circle()], FitOptions(model=model, regression=regression))
    assert result.skill.closed
    assert result.reproductions[0].rms < 0.1
    assert np.abs(result.skill.weights).max() < 1e5


def test_a_stroke_that_begins_in_motion_keeps_its_initial_velocity():
    t = np.linspace(0.0, 2.0, 401)
    position = np.stack([40.0 * t, 10.0 * np.sin(3.0 * t), 0 * t], axis=1)
    result = fit([Trajectory(t, position)], FitOptions(regression="ridge"))
    speed = np.linalg.norm(result.skill.initial_velocity[:3]) / result.skill.spring.tau
    assert speed == pytest.approx(50.0, rel=0.02)
    assert result.reproductions[0].rms < 0.02
    without = result.skill.initial_velocity * 0
    assert not np.allclose(result.skill.initial_velocity, without)


def test_a_straight_line_fits_and_has_no_wave():
    t = np.linspace(0, 5, 251)
    r = t / 5
    s = minimum_jerk(r)
    position = np.array([1.0, 2.0, 3.0]) + np.outer(80 * s, [0.6, 0.0, 0.8])
    result = fit([Trajectory(t, position)], FitOptions())
    assert result.reproductions[0].rms < 0.05
    np.testing.assert_allclose(result.reproductions[0].reproduced[:, 1:], 0.0, atol=1e-9)


def test_alpha_f_is_the_closed_form_least_squares_factor():
    stroke = paper_stroke()
    choices = FitOptions(alpha_1=1.7, widths="power", learning="paper")
    result = fit([stroke], choices)
    skill, signal = result.skill, result.prepared[0].signal
    r = skill.response(np.linspace(0, skill.duration, len(signal.x)))
    rest = signal.x - skill.start * r.a - skill.goal * r.b - skill.initial_velocity * r.c
    for axis in (0, 1):
        best = np.linalg.lstsq(r.forced[:, axis : axis + 1], rest[:, axis], rcond=None)[0][0]
        assert skill.alpha_f[axis] == pytest.approx(best, rel=1e-9)
    assert skill.alpha_f[2] == 1.0  # nothing off the plane, nothing to tell it from


def test_idle_ends_are_trimmed_and_a_soft_start_is_kept():
    moving = paper_stroke()
    idle = 150
    position = np.concatenate(
        [
            np.repeat(moving.position[:1], idle, axis=0),
            moving.position,
            np.repeat(moving.position[-1:], idle, axis=0),
        ]
    )
    t = np.arange(len(position)) * 0.02
    result = fit([Trajectory(t, position)], FitOptions())
    before, after = result.prepared[0].trimmed
    assert 2.4 < before < 3.1
    assert 2.4 < after < 3.1
    np.testing.assert_allclose(result.skill.frame.start, moving.position[0], atol=1e-3)
    untouched = fit([moving], FitOptions()).prepared[0].trimmed
    assert untouched == (0.0, 0.0)


def test_several_demonstrations_of_differing_length_and_duration_share_one_skill():
    a = paper_stroke()
    longer = Trajectory(a.t[::2] * 1.4, a.position[::2] * [1.2, 1.0, 1.0])
    plain = Trajectory(a.t, a.position)
    result = fit([plain, longer], FitOptions())
    assert len(result.reproductions) == 2
    lengths = [p.frame.length for p in result.prepared]
    assert result.skill.goal[0] == pytest.approx(np.mean(lengths))
    assert result.skill.duration == pytest.approx(12.0)
    for r in result.reproductions:
        assert r.rms < 1.0


def test_two_equal_demonstrations_give_the_skill_of_one():
    one = fit([paper_stroke()], FitOptions()).skill
    two = fit([paper_stroke(), paper_stroke()], FitOptions()).skill
    t = np.linspace(0.0, 10.0, 501)
    # Each takes its initial velocity from a spline of its own: rounding of 1e-9 mm/s and more.
    responses = [(s, s.response(t)) for s in (one, two)]
    here, there = (s.initial_velocity * r.c + s.alpha_f * r.forced for s, r in responses)
    np.testing.assert_allclose(there, here, rtol=0, atol=5e-8)  # mm and rad
    np.testing.assert_allclose(two.alpha_f, one.alpha_f, rtol=1e-9)


@pytest.mark.parametrize("scale", ["axis", "distance"])
def test_several_demonstrations_of_the_original_model_reproduce_each(scale):
    a = paper_stroke()
    result = fit(
        [a, Trajectory(a.t, a.position + [5.0, 3.0, 0.0], a.rotation)],
        FitOptions(model="original", forcing_scale=scale),
    )
    assert max(r.rms for r in result.reproductions) < 0.2


def test_unequal_demonstrations_are_refused_by_what_differs():
    with pytest.raises(InputError, match=r"demonstration 2 is closed, the first is open"):
        fit([Trajectory(paper_stroke().t, paper_stroke().position), circle()], FitOptions())
    bare = Trajectory(paper_stroke().t, paper_stroke().position)
    with pytest.raises(InputError, match="only one has an orientation"):
        fit([paper_stroke(), bare], FitOptions())


def test_a_tool_that_does_not_move_is_refused():
    t = np.linspace(0, 1, 50)
    with pytest.raises(InputError, match="does not move"):
        fit([Trajectory(t, np.ones((50, 3)))], FitOptions())


def test_unevenly_sampled_recordings_give_nearly_the_same_skill():
    rng = np.random.default_rng(5)
    t = np.sort(np.concatenate([[0.0, 10.0], rng.uniform(0, 10, 900)]))
    even = paper_stroke()
    from scipy.interpolate import CubicSpline

    position = CubicSpline(even.t, even.position)(t)
    a = fit([Trajectory(even.t, even.position)], FitOptions()).reproductions[0]
    b = fit([Trajectory(t, position)], FitOptions()).reproductions[0]
    assert abs(height(a) - height(b)) < 0.01


def test_a_turning_tool_is_reproduced_in_its_angles():
    result = fit([paper_stroke(turning=True)], FitOptions(regression="ridge"))
    skill, signal = result.skill, result.prepared[0].signal
    r = skill.response(np.linspace(0, skill.duration, len(signal.x)))
    x = skill.goal * r.b + skill.initial_velocity * r.c + skill.alpha_f * r.forced
    assert np.abs(x[:, 3:] - signal.x[:, 3:]).max() < 1e-4


@pytest.mark.slow
def test_the_first_orientation_is_smoothed_too_where_the_recording_begins_before_it():
    stroke = paper_stroke()
    idle = 200
    position = np.concatenate([np.repeat(stroke.position[:1], idle, axis=0), stroke.position])
    t = np.arange(len(position)) * 0.02
    errors, raw = [], []
    for seed in range(8):
        noise = rotations.exp(0.02 * np.random.default_rng(seed).normal(size=(len(t), 3)))
        noisy = Trajectory(t, position, noise @ stroke.rotation[0])
        prepared = fit([noisy], FitOptions()).prepared[0]
        first = prepared.frame.rotation
        errors.append(np.linalg.norm(rotations.log(first @ stroke.rotation[0].T)))
        raw.append(np.linalg.norm(rotations.log(noise[idle])))
    # Smoothing by noise leaves far less of it than the paper's low-pass: 4 of 25 Hz, 40 %.
    assert np.mean(errors) < 0.6 * np.mean(raw)


@pytest.mark.parametrize(
    ("name", "asked"),
    [
        ("--normal", {"normal": (0.0, 0.0, 1.0)}),
        ("--tolerance", {"tolerance": 0.2}),
        ("--from", {"start": 1.0}),
        ("--until", {"until": 5.0}),
        ("--cut-pauses", {"cut_pauses": True}),
        ("passes", {"passes": 2}),
        ("--align", {"align": "time"}),
        ("--force-profile", {"force_profile": True}),
    ],
)
@pytest.mark.parametrize("paper", [{"learning": "paper"}, {"model": "original"}])
def test_what_the_papers_learning_knows_nothing_of_is_refused(name, asked, paper):
    with pytest.raises(InputError, match=rf"^{name}: "):
        fit([paper_stroke()], FitOptions(**asked, **paper))


def test_the_spread_of_several_demonstrations_is_their_standard_deviation_by_axis():
    """Three strokes lifted by -2, 0 and 2 mm and swung by 40, 50 and 60: along one path in plan."""
    t = np.linspace(0.0, 5.0, 401)
    u = minimum_jerk(t / 5.0)
    swing = np.sin(np.pi * u) ** 2
    given = [
        Trajectory(t, np.stack([200 * u, (50 + by) * swing, 0.2 * by * swing], axis=1))
        for by in (-10.0, 0.0, 10.0)
    ]
    skill = fit(given, FitOptions(align="time", normal=(0.0, 0.0, 1.0))).skill
    found = skill.spread
    assert found.share[[0, -1]].tolist() == [0.0, 1.0]
    at = np.sin(np.pi * minimum_jerk(found.share)) ** 2
    deviation = np.sqrt(200.0 / 3.0)
    np.testing.assert_allclose(found.deviation[:, 1], deviation * at, atol=0.15)
    np.testing.assert_allclose(found.deviation[:, 2], 0.2 * deviation * at, atol=0.15)
    np.testing.assert_allclose(found.deviation[:, [0, 3, 4, 5]], 0.0, atol=0.15)
    assert fit(given[:1], FitOptions()).skill.spread is None


@pytest.mark.slow
@pytest.mark.parametrize("model", ["modified", "original"])
def test_the_same_stroke_drawn_slower_teaches_the_same_to_the_paper(model):
    """Two demonstrations of one shape, 5 s and 10 s: the skill of either, drawn in 7.5 s."""
    options = FitOptions(model=model, learning="paper", regression="ridge")

    def drawn(duration):
        t = np.linspace(0.0, duration, 501)
        u = minimum_jerk(t / duration)
        position = np.stack([120 * u, 30 * np.sin(2 * np.pi * u) + 5 * u, 10 * u], axis=1)
        return Trajectory(t, position, None)

    both = fit([drawn(5.0), drawn(10.0)], options).skill
    alone = fit([drawn(7.5)], options).skill
    assert both.duration == pytest.approx(7.5)
    size = np.abs(alone.weights).max()
    np.testing.assert_allclose(both.weights, alone.weights, atol=0.01 * size)
    np.testing.assert_allclose(both.start, alone.start, atol=1e-6)
    np.testing.assert_allclose(both.goal, alone.goal, atol=1e-6)


def test_what_smoothing_took_off_is_the_root_mean_square_of_the_distances():
    stroke = paper_stroke(801)
    rng = np.random.default_rng(3)
    noisy = Trajectory(
        stroke.t, stroke.position + 0.2 * rng.standard_normal((801, 3)), stroke.rotation
    )
    found = fit([noisy], FitOptions()).prepared[0]
    off = np.linalg.norm(found.stroke.position - found.recorded, axis=1)
    assert found.removed == pytest.approx(np.sqrt(np.mean(off**2)))
    # Nearly all of the noise of three axes.
    assert found.removed == pytest.approx(0.2 * np.sqrt(3.0), rel=0.06)


def test_strokes_of_differing_length_teach_the_paper_the_stroke_of_their_mean_length():
    """Lengths of 100 and 140 mm, one wave height: in u they are brought to 120 mm, v stays."""
    options = FitOptions(learning="paper", regression="ridge")

    def drawn(length):
        t = np.linspace(0.0, 6.0, 501)
        u = minimum_jerk(t / 6.0)
        return Trajectory(t, np.stack([length * u, 30 * np.sin(2 * np.pi * u), 0 * u], axis=1))

    both, alone = (fit([drawn(x) for x in of], options) for of in ([100.0, 140.0], [120.0]))
    size = np.abs(alone.skill.weights).max()
    np.testing.assert_allclose(both.skill.weights, alone.skill.weights, atol=1e-6 * size)
    assert both.skill.goal[0] == pytest.approx(120.0, abs=1e-3)
    assert both.lost == 0.0  # it knows of no noise that smoothing could have gone beyond
    # Each is shown in the length in which it was drawn.
    for reproduction, length in zip(both.reproductions, (100.0, 140.0), strict=True):
        assert np.ptp(reproduction.demonstrated[:, 0]) == pytest.approx(length, abs=0.01)
        assert reproduction.reproduced[-1, 0] == pytest.approx(length, abs=0.1)
        assert height(reproduction) == pytest.approx(60.0, abs=3.0)


def test_the_largest_angle_between_what_was_shown_and_what_is_drawn_is_told():
    for given in ([paper_stroke(turning=True)], [paper_stroke(turning=True)] * 2):
        for told in fit(given, FitOptions()).reproductions:
            assert 0.0 < told.angle < np.radians(1.0)
    still = fit([Trajectory(paper_stroke().t, paper_stroke().position)], FitOptions())
    assert not still.reproductions[0].angle


@pytest.mark.parametrize(("sigma", "count"), [(0.0, 9), (0.1, 9), (0.1, 400), (2.0, 400)])
def test_what_noise_explains_is_two_of_its_three_components_and_some_doubt(sigma, count):
    distance = np.tile([0.5, 0.7, 0.9], count)[:count]
    rms, largest = _beyond_noise(distance, sigma)
    mean = np.mean(distance**2)
    left = mean - 2.0 * sigma**2 * (1.0 + 3.0 / np.sqrt(count))
    assert rms == pytest.approx(np.sqrt(max(left, 0.0)))
    assert largest == pytest.approx(max(0.9 - 4.5 * sigma, 0.0))

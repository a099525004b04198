"""A recording is seen as its skill saw it: cut, smoothed, laid on its plane or surface."""

import numpy as np
import pytest

from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.paper_preprocessing import prepare
from dmpcli.dmp.skill import TaughtSurface
from dmpcli.errors import InputError
from dmpcli.records.learning_record import PAPER, Lesson
from dmpcli.reporting.recorded import Recorded
from dmpcli.reporting.stroke_measures import row_of
from dmpcli.reporting.strokes import strokes_of
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.sphere import Sphere
from tests.minimum_jerk import minimum_jerk
from tests.nearest import nearest_rms
from tests.reporting.example_files import GOAL, START, trajectory, wave

RADIUS = 200.0
SPHERE = Sphere(np.array([0.0, 0.0, -RADIUS]), RADIUS)


def recording(path=None, dt=0.02, noise=0.0):
    path = wave() if path is None else path
    path = path + noise * np.random.default_rng(11).standard_normal(path.shape)
    return Trajectory(np.arange(len(path)) * dt, path, None)


def on_sphere(height=30.0, n=801):
    """Two half waves across a great circle of the sphere, 120 mm long: u, v in closed form."""
    s = np.linspace(0.0, 1.0, n)
    u = minimum_jerk(s)
    a, b = (120.0 * u - 60.0) / RADIUS, 0.5 * height * np.sin(2 * np.pi * u) / RADIUS
    up = np.stack([np.cos(b) * np.sin(a), np.sin(b), np.cos(b) * np.cos(a)], axis=-1)
    return RADIUS * up + SPHERE.centre, np.stack([120.0 * u, RADIUS * b], axis=-1)


def with_lifts(path, w):
    path = path.copy()
    path[:, 2] += w
    return path


def test_the_papers_lesson_shows_the_papers_preparation():
    made = recording(noise=0.05)
    seen, own = Recorded(made, "demo").stroke(PAPER), prepare(made, FitOptions())
    np.testing.assert_array_equal(seen.position, own.stroke.position)
    np.testing.assert_array_equal(seen.axes, own.frame.axes)
    assert seen.lost == (0.0, 0.0)


def test_by_default_noise_tells_how_much_is_smoothed():
    true = wave()
    seen = Recorded(recording(noise=0.1), "demo").stroke(Lesson(trim=False))
    assert seen.noise == pytest.approx(0.1, rel=0.15)
    assert np.sqrt(np.mean(np.sum((seen.position - true) ** 2, axis=1))) < 0.06
    # What the noise explains is not lost.
    assert seen.lost[0] < 0.02


def test_a_skill_tells_where_the_recording_is_cut():
    whole = Recorded(recording(), "demo", sha256="a")
    part = whole.stroke(Lesson(start=2.0, until=7.0, trim=False, recordings=("a",)))
    assert part.t[-1] == pytest.approx(5.0)
    assert part.start == pytest.approx(wave()[100], abs=1e-3)
    # The cut is of the recordings that the skill learned from; this may be another one.
    other = whole.stroke(Lesson(start=2.0, until=7.0, recordings=("b",)))
    assert other.t[-1] == pytest.approx(whole.stroke().t[-1])


def test_the_skills_plane_decides_what_across_means():
    made = Recorded(recording(with_lifts(wave(), 0.0)), "demo")
    seen = made.stroke(Lesson(normal=(0.0, -1.0, 1.0)))
    assert seen.wave.mean == pytest.approx(made.stroke().wave.mean / np.sqrt(2.0), rel=1e-3)


def test_strokes_are_held_against_the_recording_not_against_what_smoothing_left():
    made = Recorded(recording(), "demo", sha256="a")
    # 0.15 Hz leaves little of a wave that takes 4 s: the skill that learned it so is flat.
    lesson = Lesson(cutoff=0.15, recordings=("a",))
    flat = made.stroke(lesson)
    (drawn,) = strokes_of(trajectory(flat.position, **lesson.facts()), "drawn")
    off = row_of(drawn, made.stroke())["deviation"]
    assert off["phase_rms"] < 0.1
    assert off["nearest_rms"] == pytest.approx(nearest_rms(wave(), flat.position), rel=0.05)
    assert off["nearest_rms"] > 0.3


def test_each_stroke_is_compared_with_what_its_own_skill_saw():
    made = Recorded(recording(), "demo", sha256="a")
    cut = Lesson(until=5.0, trim=False, recordings=("a",))
    (drawn,) = strokes_of(trajectory(wave()[:251], **cut.facts()), "drawn")
    assert row_of(drawn, made.stroke())["deviation"]["nearest_max"] < 0.01
    (whole,) = strokes_of(trajectory(wave()[:251]), "whole")
    assert row_of(whole, made.stroke())["deviation"]["nearest_max"] > 5.0


def test_on_its_taught_surface_a_recording_has_the_surfaces_coordinates():
    path, uv = on_sphere()
    lesson = Lesson(surface="ball", closed=False)
    seen = Recorded(recording(path, 0.01), "demo", surfaces={"ball": SPHERE}).stroke(lesson)
    assert seen.axes is None
    assert seen.length == pytest.approx(120.0, abs=1e-3)
    assert seen.wave.heights == pytest.approx([30.0], abs=0.01)
    share = np.linspace(0.0, 1.0, len(seen.t))
    there = np.stack([np.interp(share, np.linspace(0, 1, len(uv)), c) for c in uv.T], axis=-1)
    # Idle ends are cut off.
    assert np.abs(np.sort(seen.place[:, 0]) - np.sort(there[:, 0])).max() < 3.0
    assert np.abs(seen.place[:, 2]).max() < 1e-3


def test_without_that_surface_the_skills_own_curve_stands_for_it():
    path, _ = on_sphere()
    skill = fit([recording(path, 0.01)], FitOptions(), SPHERE, TaughtSurface("sphere", {})).skill
    lesson = Lesson(surface="ball", closed=False, recordings=("a",))
    made = Recorded(recording(path, 0.01), "demo", sha256="a", skills=[(lesson, skill)])
    seen = made.stroke(lesson)
    assert (seen.by_skill, seen.elsewhere) == (True, False)
    assert seen.wave.heights == pytest.approx([30.0], abs=0.2)
    assert seen.lost == (skill.reached.rms, skill.reached.largest)
    alone = Recorded(recording(path, 0.01), "demo", sha256="a").stroke(lesson)
    assert alone.elsewhere
    (drawn,) = strokes_of(trajectory(wave(), **lesson.facts()), "drawn")
    assert (
        row_of(drawn, Recorded(recording(path, 0.01), "demo", sha256="a").stroke())["deviation"]
        is None
    )


def test_a_tool_that_rests_or_hardly_a_sample_is_refused():
    with pytest.raises(InputError, match="does not move"):
        Recorded(recording(np.tile(START, (100, 1))), "demo").stroke()
    with pytest.raises(InputError, match="4 samples"):
        Recorded(recording(np.linspace(START, GOAL, 4)), "demo").stroke()

"""What a skill gives back of a recording, whichever way it was learned."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.preprocessing import preprocess
from dmpcli.dmp.recall import recalled, recalled_as_paper
from dmpcli.dmp.taught_strokes import taught_strokes
from tests.dmp.strokes import HEIGHT, paper_stroke

PAPER = {"learning": "paper", "alpha_1": 1.7, "widths": "power"}


def taught(stroke, choices=None):
    found, _, _ = taught_strokes([preprocess(stroke)], choices or FitOptions(), None)
    return found[0]


@pytest.mark.parametrize("method", ["lwr", "ridge"])
def test_a_skill_recalls_its_one_recording_as_fit_said(method):
    result = fit([paper_stroke()], FitOptions(regression=method))
    found = recalled(result.skill, taught(paper_stroke()))
    assert found.rms == pytest.approx(result.reproductions[0].rms, abs=2e-5)
    assert found.wave == pytest.approx(result.reproductions[0].wave, abs=2e-3)
    assert found.end < 1e-6


def test_a_skill_whose_wave_is_a_tenth_too_low_keeps_nine_tenths():
    skill = fit([paper_stroke()], FitOptions(regression="ridge")).skill
    weaker = skill.weights.copy()
    weaker[1] *= 0.9
    found = recalled(replace(skill, weights=weaker), taught(paper_stroke()))
    assert found.wave[1] / found.wave[0] == pytest.approx(0.9, abs=2e-3)
    assert found.largest == pytest.approx(0.05 * HEIGHT, rel=0.1)


def test_the_papers_skills_are_held_against_the_recording_too():
    choices = FitOptions(**PAPER)
    skill = fit([paper_stroke()], choices).skill
    found = recalled_as_paper(skill, paper_stroke(), preprocess(paper_stroke()), choices)
    # The wave height of the paper's experiment, Table 1 as it is made here.
    assert found.wave[1] == pytest.approx(49.447, abs=2e-3)
    assert found.rms == pytest.approx(0.32, abs=0.01)
    original = replace(choices, model="original")
    other = fit([paper_stroke()], original).skill
    worse = recalled_as_paper(other, paper_stroke(), preprocess(paper_stroke()), original)
    assert worse.wave[1] == pytest.approx(47.728, abs=2e-3)
    assert worse.rms > found.rms


def test_what_the_papers_smoothing_took_counts_as_its_error():
    choices = FitOptions(**PAPER, basis=10)
    few = fit([paper_stroke()], choices).skill
    found = recalled_as_paper(few, paper_stroke(), preprocess(paper_stroke()), choices)
    many = FitOptions(**PAPER)
    better = recalled_as_paper(
        fit([paper_stroke()], many).skill, paper_stroke(), preprocess(paper_stroke()), many
    )
    assert found.rms > 2.0 * better.rms
    assert np.isfinite(found.largest)


def test_a_stroke_of_less_than_a_millimetre_is_recalled_as_one_of_any_length():
    """Along the line the skill is scaled to it; across it keeps its wave."""
    result = fit([paper_stroke()], FitOptions())
    one = taught(paper_stroke())
    found = recalled(result.skill, one)
    for share in (0.004, 2.0):
        x = one.curve.spline.c * [share, *[1.0] * 5]
        curve = replace(one.curve, spline=one.curve.spline.construct_fast(
            one.curve.spline.t, x, one.curve.spline.k))  # fmt: skip
        other = recalled(result.skill, replace(one, curve=curve, length=share * one.length))
        assert other.rms == pytest.approx(found.rms, rel=1e-6)
        assert other.wave == pytest.approx(found.wave, rel=1e-9)


def test_a_stroke_of_no_length_is_not_scaled():
    result = fit([paper_stroke()], FitOptions())
    one = taught(paper_stroke())
    assert recalled(result.skill, replace(one, length=0.0)).rms == recalled(result.skill, one).rms

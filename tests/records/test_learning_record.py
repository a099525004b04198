"""What a skill tells of how it saw its recordings, and its mark."""

import pytest

from dmpcli.dmp.skill import Accuracy
from dmpcli.errors import InputError
from dmpcli.records import learning_record, tolerance_mark
from dmpcli.records.learning_record import PAPER, Lesson


def test_facts_hold_what_is_not_as_by_default_and_come_back():
    told = Lesson(cutoff=3.0, start=1.5, normal=(0.0, 0.0, 1.0), closed=False, recordings=("a",))
    facts = told.facts()
    assert set(facts["taught"]) == {"cutoff", "start", "normal", "closed", "recordings"}
    assert facts["taught"]["normal"] == [0.0, 0.0, 1.0]
    assert learning_record.of_facts(facts) == told


def test_the_original_model_learns_as_the_paper_has_it_whatever_is_told():
    assert learning_record.of_facts({"model": "original"}) == PAPER
    assert learning_record.of_facts({"model": "modified"}) is None


def test_wrong_facts_are_refused_by_name():
    with pytest.raises(InputError, match="'taught': learning"):
        learning_record.of_facts({"taught": {"learning": "by heart"}})
    with pytest.raises(InputError, match="'taught'"):
        learning_record.of_facts({"taught": 3})


def test_another_recording_keeps_neither_cut_nor_plane():
    told = Lesson(learning="paper", basis=40, start=1.0, recordings=("a",))
    assert told.of("a") is told
    assert told.of("b") == Lesson(learning="paper", basis=40)
    assert Lesson(start=1.0).of("b") == Lesson(start=1.0)


def test_surfaces_are_the_same_by_file_unit_and_pose_in_any_order():
    here = {"kind": "sphere", "sha256": "a", "unit": "mm", "pose": None}
    there = dict(reversed(here.items()))
    assert learning_record.surface_key(here) == learning_record.surface_key(there)
    assert learning_record.surface_key(here) != learning_record.surface_key(here | {"unit": "m"})


def test_only_a_skill_beyond_its_tolerance_is_marked_with_the_remedy():
    assert tolerance_mark.of_reached(Accuracy(0.1, 0.05, 0.2, 0.0, True)) is None
    assert tolerance_mark.of_reached(None) is None
    mark = tolerance_mark.of_reached(Accuracy(0.1, 0.5, 2.0, 0.0, False))
    said = tolerance_mark.text("skill.json", mark)
    for part in ("skill.json: ", "RMS 0.5 mm", "largest 2 mm", "tolerance of 0.1 mm", "ridge"):
        assert part in said
    assert tolerance_mark.of_facts({"trajectory": {"beyond_tolerance": mark}}) == mark

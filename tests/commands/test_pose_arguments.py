"""A pose of six words is one value, whatever stands around it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.commands.pose_arguments import POSE_OPTIONS, WORKSPACE, joined
from dmpcli.settings.ranges import WIDEST

SIX = ["1", "-2.5", "3e1", "-.1", "0", "nan"]


@pytest.mark.parametrize("option", POSE_OPTIONS)
def test_six_numbers_become_one_value(option):
    words = ["generalize", "s.json", option, *SIX, "--goal", "1", "2", "3"]
    assert joined(words) == [
        "generalize", "s.json", f"{option}=1 -2.5 3e1 -.1 0 nan", "--goal", "1", "2", "3",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--initial", "pose.json", "7"], ["--initial", "pose.json", "7"]),
        (["--initial=pose.json", "7"], ["--initial=pose.json", "7"]),
        (["--initial", "-"], ["--initial", "-"]),
        (["--initial"], ["--initial"]),
        (["--initial=1", *SIX[1:]], [f"--initial={' '.join(SIX)}"]),
        (["--initial=1 2 3 4 5 6"], ["--initial=1 2 3 4 5 6"]),
        (["--initial", "1", "2", "-o", "p"], ["--initial=1 2", "-o", "p"]),
        (["--initial", *SIX, "7"], [f"--initial={' '.join(SIX)}", "7"]),
        (["--", "--initial", *SIX], ["--", "--initial", *SIX]),
        (["--workspace", "none", "-q"], ["--workspace", *map(str, WIDEST), "-q"]),
        (["--workspace=none", "none"], ["--workspace", *map(str, WIDEST), "none"]),
        (["--workspace", *SIX], ["--workspace", *SIX]),
        (["--workspace"], ["--workspace"]),
    ],
)
def test_files_short_poses_and_the_end_of_options(words, expected):
    assert joined(words) == expected


@given(st.lists(st.text()))
def test_words_without_a_pose_option_pass_unchanged(words):
    options = (*POSE_OPTIONS, WORKSPACE)
    kept = [word for word in words if word.partition("=")[0] not in options]
    assert joined(kept) == kept

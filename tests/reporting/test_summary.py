import pytest

from dmpcli.reporting.summary import FEW, sentences


def row(n, surface=None, **other):
    return {
        "stroke": f"batch[{n}]",
        "role": "modified",
        "simulated": False,
        "closed": False,
        "start": [0.0, 0.0, 0.0],
        "goal": [100.0 + n, 0.0, 0.0],
        "duration": 10.0,
        "length": 150.0 + n,
        "wave": {"mean": 50.0},
        "deviation": {"nearest_max": 0.02 * n},
        "start_error": 0.0,
        "goal_error": 0.0,
        "surface": surface,
        **other,
    }


def told(rows, reference="demo"):
    entry = dict.fromkeys(("statistics", "states", "skill", "deadlines", "contact"))
    files = [{"file": "batch", "strokes": rows, **entry}]
    return sentences({"files": files, "surface": None, "reference": reference})[1:]


def on(distance, share=1.0, tilt=None, wave=49.0):
    return {
        "distance_max": distance,
        "contact_share": share,
        "tilt_max": tilt,
        "wave_height": wave,
        "start_error": 0.0,
        "goal_error": 0.03 if distance > 0.5 else 0.0,
    }


def test_few_strokes_are_told_one_by_one():
    assert [text.split(":")[0] for text in told([row(n) for n in range(FEW)])] == [
        f"batch[{n}]" for n in range(FEW)
    ]


def test_many_alike_are_told_together_by_ranges_and_the_worst_by_its_name():
    (text,) = told([row(n) for n in (2, 9, 4, 1, 3)])
    assert text == (
        "batch: 5 strokes, planned by the modified model; from start to goal 101.0 to 109.0 mm, "
        "10.0 s, paths of 151.0 to 159.0 mm. Their waves are 50.00 mm high. With start and goal "
        "laid upon each other they stay within 0.18 mm (most: batch[9]) of the demonstrated shape. "
        "They begin and end less than 0.01 mm off where they should."
    )


def test_on_a_surface_the_worst_of_distance_contact_tilt_and_end_are_named():
    rows = [row(n, on(0.1)) for n in range(3)]
    rows += [row(3, on(0.7, tilt=2.0)), row(4, on(0.2, share=0.6, tilt=5.5))]
    (text,) = told(rows)
    assert "Their waves are 49.00 mm high, measured along the surface." in text
    assert "They begin and end up to 0.03 mm (most: batch[3]) off where they should." in text
    assert "They lie within 0.70 mm (most: batch[3]) of the surface" in text
    assert "touching it over 60 % of the path or more (least: batch[4])" in text
    assert "leans up to 5.5° off its normal (most: batch[4])." in text


@pytest.mark.parametrize(
    "other", [{"role": "run"}, {"simulated": True}, {"closed": True}, {"surface": on(0.1)}]
)
def test_many_of_which_one_is_of_another_kind_are_told_one_by_one(other):
    assert len(told([*map(row, range(6)), row(6, **other)])) == 7


def test_what_the_others_are_compared_with_is_told_by_itself():
    assert len(told([row(n) for n in range(6)], reference="batch[3]")) == 6

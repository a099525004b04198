"""SVG drawings: millimetres, y up, transforms and viewBox applied, curves within the tolerance."""

import numpy as np
import pytest

from dmpcli.errors import InputError
from dmpcli.extras import SVG
from dmpcli.formats import svg_paths
from dmpcli.records.file_io import Source
from tests.extras_here import needs

pytestmark = needs(SVG)


def drawn(body, root='width="100mm" height="50mm" viewBox="0 0 200 100"', **options):
    text = f'<svg xmlns="http://www.w3.org/2000/svg" {root}>{body}</svg>'
    return svg_paths.decode(Source("a.svg", text.encode()), **options)


def corners(stroke):
    """Where the path turns, with its ends."""
    step = np.diff(stroke.position, axis=0)
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    turn = np.linalg.norm(np.diff(step, axis=0), axis=1) > 1e-6
    return stroke.position[np.r_[True, turn, True]]


def test_the_view_box_scales_to_mm_and_y_points_up():
    stroke, told = drawn('<path d="M 0 100 L 200 100 L 200 0"/>')
    np.testing.assert_allclose(corners(stroke), [[0, 0, 0], [100, 0, 0], [100, 50, 0]], atol=1e-6)
    assert told == ["1 path, 100.0 x 50.0 mm"]


def test_transforms_are_applied_in_their_order():
    # (10, 0) turned by 90° (SVG's y is down) to (0, 10), moved to (50, 60); a group scales by 0.5.
    body = (
        '<g transform="scale(0.5)"><line x1="0" y1="0" x2="10" y2="0" '
        'transform="translate(50 50) rotate(90)" stroke="black"/></g>'
    )
    stroke, _ = drawn(body, 'width="100mm" height="100mm" viewBox="0 0 100 100"')
    np.testing.assert_allclose(corners(stroke), [[25, 75, 0], [25, 70, 0]], atol=1e-6)


def test_a_pixel_is_a_96th_of_an_inch_unless_said():
    body = '<path d="M 0 0 H 96"/>'
    stroke, told = drawn(body, 'width="200" height="100"')
    np.testing.assert_allclose(np.ptp(stroke.position[:, 0]), 25.4)
    assert "1/96 inch" in told[0]
    stroke, _ = drawn(body, 'width="200" height="100"', unit="mm")
    np.testing.assert_allclose(np.ptp(stroke.position[:, 0]), 96.0)
    with pytest.raises(InputError, match="says its size itself"):
        drawn(body, unit="m")


@pytest.mark.parametrize("tolerance", [0.5, 0.01])
def test_a_circle_stays_within_the_tolerance_and_has_its_length(tolerance):
    body = '<circle cx="100" cy="50" r="40" fill="none"/>'
    stroke, _ = drawn(body, tolerance=tolerance, speed=20.0)
    radius = np.hypot(stroke.position[:, 0] - 50, stroke.position[:, 1] - 25)
    assert radius.max() <= 20 + 1e-6
    assert radius.min() >= 20 - tolerance
    # Chords of 0.2 mm are short of the arc by next to nothing; the tolerance counts.
    length = np.linalg.norm(np.diff(stroke.position, axis=0), axis=1).sum()
    np.testing.assert_allclose(length, 40 * np.pi, rtol=tolerance / 10)


@pytest.mark.slow
def test_a_bezier_lies_on_its_polynomial():
    stroke, _ = drawn('<path d="M 0 0 C 0 80, 200 80, 200 0"/>', tolerance=0.001, speed=10.0)
    u = np.linspace(0, 1, 4001)[:, None]
    control = np.array([[0, 50], [0, 10], [100, 10], [100, 50]])
    weights = np.hstack([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3])
    truth = weights @ control
    off = np.linalg.norm(stroke.position[:, None, :2] - truth[None], axis=2).min(axis=1)
    assert off.max() < 0.03  # half the spacing of the truth's points
    assert np.abs(off).mean() < 0.01


def test_the_pen_is_lifted_between_paths_and_keeps_its_speed():
    body = '<path d="M 0 0 H 100"/><path d="M 0 50 H 100"/>'
    stroke, told = drawn(body, lift=3.0, speed=25.0, rate=50.0)
    assert told[0].startswith("2 paths")
    expected = [[0, 50, 0], [50, 50, 0], [50, 50, 3], [0, 25, 3], [0, 25, 0], [50, 25, 0]]
    np.testing.assert_allclose(corners(stroke), expected, atol=1e-6)
    np.testing.assert_allclose(np.diff(stroke.t), 0.02)
    speed = np.linalg.norm(np.diff(stroke.position, axis=0), axis=1) / 0.02
    np.testing.assert_allclose(speed, 25.0, rtol=0.02)


def test_what_is_hidden_or_only_defined_is_not_drawn():
    body = (
        '<defs><path id="p" d="M 0 0 H 10"/></defs><path d="M 0 0 H 100" display="none"/>'
        '<use href="#p" x="20" y="0"/><text x="0" y="9">hello</text>'
    )
    stroke, told = drawn(body)
    np.testing.assert_allclose(corners(stroke)[:, 0], [10, 15], atol=1e-6)
    assert "text" in told[1]


@pytest.mark.parametrize(
    ("body", "words"),
    [("", "holds no path"), ("<text>a</text>", "holds no path"), ("<path", "cannot be read")],
)
def test_what_holds_no_path_is_refused(body, words):
    with pytest.raises(InputError, match=words):
        drawn(body)


@pytest.mark.parametrize(
    "path",
    ["M 0 0 C 1e300 1e300 5 5 9 9", "M 0 0 L 1e308 1e308 L -1e308 0", "M 0 0 A 1e200 2 0 1 1 9 9"],
)
def test_a_path_of_numbers_without_bounds_is_refused_without_a_warning(path):
    with pytest.raises(InputError, match="beyond 100 m"):
        drawn(f'<path d="{path}"/>')


def test_a_number_without_end_is_refused_before_the_library_looks_for_one_in_it():
    with pytest.raises(InputError, match="line 1: a number of more than 64 digits"):
        drawn(f'<polyline points="{"9" * 5000}"/>')
    drawn(f'<polyline points="0.{"3" * 60},0 5,5"/>')

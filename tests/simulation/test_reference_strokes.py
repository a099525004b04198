import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.records.file_io import Source
from dmpcli.settings.record import RecordSettings
from dmpcli.simulation import reference_strokes


def settings(**options):
    six = (1.0,) * 6
    return RecordSettings(mass=six, damping=six, stiffness=six, **options)


@pytest.mark.parametrize("shape", ["sine", "line", "circle"])
def test_every_shape_begins_at_the_start_and_lies_in_its_plane(shape):
    stroke = reference_strokes.build(settings(reference=shape))
    p = stroke.at(np.linspace(0.0, 8.0, 100), 8.0)
    np.testing.assert_allclose(p[0], stroke.start, atol=1e-9)
    np.testing.assert_allclose((p - stroke.start) @ stroke.normal, 0.0, atol=1e-9)
    assert stroke.normal[2] > 0.99
    assert stroke.facts["shape"] == shape


def test_a_vertical_line_has_a_plane_too():
    stroke = reference_strokes.build(settings(reference="line", start=(0, 0, 0), goal=(0, 0, 80)))
    np.testing.assert_allclose(stroke.normal, [1.0, 0.0, 0.0])


def test_an_unknown_shape_is_refused_with_the_choices():
    with pytest.raises(InputError, match=r"--reference star: .*sine, line, circle"):
        reference_strokes.build(settings(reference="star"))


def test_start_and_goal_must_differ():
    with pytest.raises(InputError, match="the same point"):
        reference_strokes.build(settings(start=(1, 2, 3), goal=(1, 2, 3)))


def test_a_csv_with_its_columns_in_any_order_is_a_polyline(tmp_path):
    file = tmp_path / "path.csv"
    file.write_text("z, y, x, note\n0, 0, 0, a\n0, 40, 30, b\n")
    stroke = reference_strokes.build(settings(reference=str(file)))
    p = stroke.at(np.array([0.0, 2.5, 5.0]), 5.0)
    np.testing.assert_allclose(p, [[0, 0, 0], [15, 20, 0], [30, 40, 0]], atol=1e-12)
    assert stroke.facts == {"shape": "polyline", "points": 2}
    assert stroke.source.sha256


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"x,y\n1,2\n", "column 'z' is missing; the first row has x, y"),
        (b"x,y,z\n1,2,3\n1,two,3\n", "column 'y', row 2: 'two'"),
        (b"x,y,z\n1,2,3\n4,5\n", "column 'z', row 2: ''"),
        (b"x,y,z\n1,2,inf\n", "column 'z', row 1: 'inf'"),
        (b"x,y,z\n", "two different points"),
        (b"x,y,z\n1,2,3\n1,2,3\n", "two different points"),
        (b"\xff\xfe\x00x", "is not text"),
    ],
)
def test_a_wrong_csv_is_refused_with_file_column_and_row(content, words):
    with pytest.raises(InputError) as error:
        reference_strokes.read_points(Source("path.csv", content))
    assert str(error.value).startswith("path.csv: ")
    assert words in str(error.value)


@given(st.binary(max_size=60) | st.text(alphabet="xyz,;.\"'\n0123456789e-\r\0", max_size=60))
def test_any_bytes_are_points_or_an_input_error(content):
    content = content if isinstance(content, bytes) else content.encode()
    for bytes_ in (content, b"x,y,z\n" + content):
        try:
            points = reference_strokes.read_points(Source("path.csv", bytes_))
        except InputError:
            continue
        assert np.isfinite(points).all()
        assert points.shape[1] == 3

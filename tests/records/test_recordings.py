"""Demonstrations from any table: separators, columns, units, and what gets refused."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError
from dmpcli.records import recordings, tables
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import LAYOUTS, Layout, adapted
from dmpcli.records.recordings import stroke

T = np.linspace(0.0, 1.0, 20)
XYZ = np.stack([30 * T, np.sin(5 * T), 0 * T + 2.5], axis=1)


def csv(separator=",", header="t x y z", values=None, name="log.csv"):
    values = np.column_stack([T, XYZ]) if values is None else values
    lines = [separator.join(header.split())]
    lines += [separator.join(repr(float(v)) for v in row) for row in values]
    return Source(name, ("\n".join(lines) + "\n").encode())


@pytest.mark.parametrize("separator", [",", ", ", ";", "\t", " ", "   "])
def test_separators_are_recognised(separator):
    found = stroke(csv(separator))
    np.testing.assert_array_equal(found.t, T)
    np.testing.assert_array_equal(found.position, XYZ)
    assert found.rotation is None


def test_comments_blank_lines_and_a_byte_order_mark_are_passed_over():
    body = csv().content.decode().splitlines()
    text = "\ufeff# made by hand\n\n" + "\n# half way\n".join(["\n".join(body[:9]), *body[9:]])
    np.testing.assert_array_equal(stroke(Source("a", text.encode())).position, XYZ)


def test_a_parquet_file_of_another_program_is_read():
    import pandas as pd

    stream = io.BytesIO()
    pd.DataFrame(np.column_stack([T, XYZ]), columns=list("txyz")).to_parquet(stream)
    np.testing.assert_array_equal(stroke(Source("a", stream.getvalue())).position, XYZ)


def test_a_universal_robots_log_is_read_in_metres_and_rotation_vectors():
    rotvec = np.stack([3.1 + 0 * T, 0.1 * T, 0.2 * T], axis=1)
    header = "timestamp " + " ".join(f"actual_TCP_pose_{i}" for i in range(6))
    values = np.column_stack([100.0 + T, XYZ / 1000, rotvec])
    found = stroke(csv(" ", header, values), LAYOUTS["ur"])
    np.testing.assert_allclose(found.position, XYZ, rtol=1e-14)
    np.testing.assert_allclose(found.rotation, Rotation.from_rotvec(rotvec).as_matrix(), atol=1e-14)


def test_columns_and_units_can_be_mapped_one_by_one():
    layout = adapted(
        Layout(),
        ["t=ms", "x=px", "rx=roll", "ry=pitch", "rz=yaw"],
        {"time": "ms", "length": "in", "angle": "deg"},
    )
    degrees = np.stack([170 + 5 * T, 3 * T, -2 * T], axis=1)
    source = csv(",", "ms px y z roll pitch yaw", np.column_stack([1000 * T, XYZ / 25.4, degrees]))
    found = stroke(source, layout)
    np.testing.assert_allclose(found.t, T, rtol=1e-12)
    np.testing.assert_allclose(found.position, XYZ, rtol=1e-12)
    expected = Rotation.from_euler("XYZ", degrees, degrees=True).as_matrix()
    np.testing.assert_allclose(found.rotation, expected, atol=1e-12)


def test_quaternions_are_read():
    q = Rotation.from_euler("XYZ", np.stack([3 + 0 * T, T, -T], axis=1))
    source = csv(" ", "t x y z qx qy qz qw", np.column_stack([T, XYZ / 1000, q.as_quat()]))
    np.testing.assert_allclose(stroke(source, LAYOUTS["tum"]).rotation, q.as_matrix(), atol=1e-12)
    bad = csv(" ", "t x y z qx qy qz qw", np.column_stack([T, XYZ, 2 * q.as_quat()]))
    with pytest.raises(InputError, match="line 2: the quaternion has norm 2"):
        stroke(bad, LAYOUTS["tum"])


@pytest.mark.parametrize(
    ("entries", "given_units", "message"),
    [
        (["t"], {}, "--map t: must be OURS=THEIRS"),
        (["speed=v"], {}, "--map speed=v: must be"),
        ([], {"length": "ell"}, "--length-unit ell: must be one of mm"),
        ([], {"rotation": "dice"}, "--rotation dice: must be one of euler"),
    ],
)
def test_a_wrong_mapping_is_refused(entries, given_units, message):
    with pytest.raises(InputError, match=message):
        adapted(Layout(), entries, given_units)


def edited(row, column, text, name="log.csv"):
    lines = csv().content.decode().splitlines()
    cells = lines[row].split(",")
    cells[column] = text
    lines[row] = ",".join(cells)
    return Source(name, "\n".join(lines).encode())


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (csv(header="t x y q"), r"column 'z' is missing; it has t, x, y, q"),
        (edited(5, 2, "left"), r"column 'y', line 6: 'left' is not a finite number"),
        (edited(5, 2, "nan"), r"column 'y', line 6: 'nan' is not a finite number"),
        (edited(3, 1, "inf"), r"column 'x', line 4: 'inf' is not a finite number"),
        (edited(4, 3, ""), r"column 'z', line 5: an empty cell is not a finite number"),
        (edited(4, 0, "0.0"), r"column 't', line 5: time runs backward"),
        (edited(4, 0, repr(float(T[2]))), r"column 't', line 5: time repeats"),
        (edited(7, 1, "1,2"), r"line 8 has 5 columns, the header has 4"),
        (csv(values=np.column_stack([T, XYZ])[:9]), "9 samples; a stroke needs at least 10"),
        (csv(values=np.empty((0, 4))), "holds no rows"),
        (Source("log.csv", b"# only a comment\n"), "holds no rows"),
        (Source("log.csv", b"\x00\xff\xfe"), "neither a Parquet file nor text"),
        (csv(header="t x x y z", values=np.column_stack([T, T, XYZ])), "column 'x' is there twice"),
        (Source("log.csv", b' {"schema": "skill"}'), "is JSON, not a recording"),
        (
            csv(header="t x y z rx ry rz", values=np.column_stack([T, XYZ, 180 + 0 * XYZ])),
            "line 2: an angle of 180 rad; check the unit of angle",
        ),
        (csv(values=np.column_stack([T * 1e25, XYZ])), "check the unit of time"),
        (csv(values=np.column_stack([T * 1e300, XYZ])), r"column 't', line 3: .* is beyond 1e\+30"),
        (csv(header="t x y z rx", values=np.column_stack([T, XYZ, T])), "'ry' is missing"),
    ],
)
def test_what_is_wrong_is_named_with_column_and_line(source, message):
    with pytest.raises(InputError, match=message) as caught:
        stroke(source)
    assert str(caught.value).startswith("log.csv")


def test_a_long_pause_is_refused_where_it_is():
    t = T.copy()
    t[8:] += 3600.0
    with pytest.raises(InputError, match=r"line 10: nothing was recorded for 3600\.05 s"):
        stroke(csv(values=np.column_stack([t, XYZ])))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.column_stack([T * 1e-9, XYZ]), "rows are 5.26e-11 s apart; check the unit of time"),
        (np.column_stack([T * 1e-320, XYZ]), "time repeats|check the unit of time"),
        (np.column_stack([T, XYZ * 1e6]), r"line 2: the position is beyond 1e\+06 mm"),
    ],
)
def test_numbers_beyond_all_sense_are_refused_with_a_hint_at_the_unit(values, message):
    with pytest.raises(InputError, match=message):
        stroke(csv(values=values))


cells = st.text(alphabet="0123456789.,;-eExyzt \n#\"'nainf", max_size=120)


@given(cells)
def test_any_table_is_read_or_refused_by_name(text):
    try:
        table = tables.read(Source("any.csv", text.encode() or b" "))
        for column in table.columns:
            table.numbers(column)
    except InputError as error:
        assert "any.csv" in str(error)


def test_a_row_that_comes_sooner_than_any_recorder_could_is_refused():
    values = np.column_stack([T, XYZ])
    values[1, 0] = values[0, 0] + 1e-320
    with pytest.raises(InputError, match=r"line 3: comes .* after the row before"):
        stroke(csv(values=values))


def test_the_shortest_stroke_has_ten_samples():
    values = np.column_stack([T, XYZ])[: recordings.SHORTEST]
    assert len(stroke(csv(values=values)).t) == 10


numbers = st.floats(-1e4, 1e4).map(lambda value: round(value, 6))


@pytest.mark.slow
@given(st.lists(st.tuples(numbers, numbers, numbers), min_size=2, max_size=12), st.data())
def test_decimal_commas_are_read_as_points_are(rows, data):
    separator = data.draw(st.sampled_from([";", "\t", " "]))
    text = "\n".join(
        [separator.join("abc"), *(separator.join(f"{v:.6f}" for v in r) for r in rows)]
    )
    points = tables.read(Source("a.csv", text.encode()), decimal=None)
    commas = tables.read(Source("a.csv", text.replace(".", ",").encode()), decimal=None)
    said = tables.read(Source("a.csv", text.replace(".", ",").encode()), decimal=",")
    for name in "abc":
        expected = [r["abc".index(name)] for r in rows]
        np.testing.assert_array_equal(points.numbers(name), expected)
        np.testing.assert_array_equal(commas.numbers(name), expected)
        np.testing.assert_array_equal(said.numbers(name), expected)
    assert commas.remarks == ("commas between digits read as decimal signs",)
    assert points.remarks == ()


@pytest.mark.slow
@given(
    st.lists(st.lists(numbers, min_size=3, max_size=3), min_size=2, max_size=9),
    st.sampled_from([",", ";", "\t", " "]),
)
def test_tables_without_header_are_known_by_their_first_line(rows, separator):
    text = "\n".join(separator.join(f"{v:.6f}" for v in row) for row in rows).encode()
    with pytest.raises(tables.HeadlessError, match="line 1 holds numbers"):
        tables.read(Source("a.csv", text))
    table = tables.read(Source("a.csv", text), ["a", "b", "c"])
    np.testing.assert_array_equal(np.column_stack([table.numbers(n) for n in "abc"]), rows)
    assert table.at(1) == "line 2"


def test_decimal_commas_are_not_guessed_where_a_point_or_a_comma_means_something_else():
    mixed = tables.read(Source("a.csv", b"a;b\n1,5;2.5\n"), decimal=None)
    assert mixed.decimal == "."
    with pytest.raises(InputError, match=r"'1,5' is not a finite number"):
        mixed.numbers("a")
    assert tables.read(Source("a.csv", b"a,b\n1,5\n"), decimal=None).numbers("b").tolist() == [5.0]

"""Tables say where each pair lies; what is wrong with a word is told by row."""

import io

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from dmpcli.errors import InputError
from dmpcli.records import pairs
from dmpcli.records.file_io import Source
from dmpcli.records.pair_places import Place
from dmpcli.records.pair_stream import PairStream

HEADER = "x0,y0,z0,xg,yg,zg"


def table(*rows, more):
    lines = [f"{HEADER},{more}", *(f"1,2,3,4,5,6,{row}" for row in rows)]
    return pairs.read(Source("pairs.csv", "\n".join(lines).encode()))


def test_a_table_without_such_columns_has_no_places():
    assert table("a", more="id").places is None


def test_places_stand_in_the_order_in_which_they_are_named_first():
    found = table(
        "z.stl,mm,,part,2",
        "a.stl,,0 0 1 0 0 0,,",
        " z.stl ,mm,,part,2.0",
        "a.stl,,0 0 1 0 0 0,,",
        "z.stl,m,pose.json,base,",
        more="surface,surface_unit,pose,in,offset",
    )
    assert found.places.of.tolist() == [0, 1, 2, 1, 3]
    assert found.places.places == [
        Place("z.stl", "mm", "", "part", 2.0),
        Place("a.stl", "", "0 0 1 0 0 0", "", None),
        Place("z.stl", "mm", "", "part", 2.0),
        Place("z.stl", "m", "pose.json", "base", None),
    ]
    assert found.good.all()


@pytest.mark.parametrize(
    ("row", "what"),
    [
        ("a.stl,foot,,", "column 'surface_unit': 'foot' is none of mm, cm, m, in"),
        ("a.stl,,tool,", "column 'in': 'tool' is neither base nor part"),
        ("a.stl,,,high", "column 'offset': 'high' is no number of mm up to 1000"),
        ("a.stl,,,nan", "column 'offset': 'nan' is no number"),
        ("a.stl,,,2000", "column 'offset': '2000' is no number"),
    ],
)
def test_a_word_that_is_none_is_told_by_its_line(row, what):
    found = table("a.stl,,,", row, more="surface,surface_unit,in,offset")
    assert found.good.tolist() == [True, False]
    assert found.status[1].startswith(f"line 3, {what}")


def test_numbers_of_parquet_tables_are_words_too():
    columns = {name: [1.0, 2.0] for name in HEADER.split(",")}
    sink = io.BytesIO()
    pq.write_table(pa.table(columns | {"surface": ["a", None], "offset": [1.5, None]}), sink)
    found = pairs.read(Source("p.parquet", sink.getvalue()))
    assert [place.surface for place in found.places.places] == ["a", ""]
    assert [place.offset for place in found.places.places] == [1.5, None]


def parquet(**columns):
    sink = io.BytesIO()
    numbers = {name: pa.array([1.0, 2.0]) for name in HEADER.split(",")}
    pq.write_table(pa.table(numbers | columns), sink)
    return sink.getvalue()


def both_ways(content, tmp_path):
    """Read as a whole, and in pieces, as a table of many rows is."""
    path = tmp_path / "p.parquet"
    path.write_bytes(content)
    stream = PairStream(path, "", 2, True)
    return [pairs.read(Source("p.parquet", content)), next(stream.pieces(10))]


TEXTS = [
    pa.string(),
    pa.large_string(),
    pa.string_view(),
    pa.binary(),
    pa.large_binary(),
    pa.binary_view(),
    pa.dictionary(pa.int8(), pa.string()),
    pa.dictionary(pa.int32(), pa.large_string()),
]


@pytest.mark.parametrize("kind", TEXTS, ids=str)
def test_text_is_text_in_whichever_type_its_writer_keeps_it(kind, tmp_path):
    names = pa.array(["ä.stl", None])
    dictionary = pa.types.is_dictionary(kind)
    column = (names.cast(kind.value_type).dictionary_encode() if dictionary else names).cast(kind)
    ids = pa.array(["u", "v"]).cast(pa.string() if dictionary else kind)
    for found in both_ways(parquet(id=ids, surface=column), tmp_path):
        assert found.ids == ["u", "v"]
        assert [place.surface for place in found.places.places] == ["ä.stl", ""]


def test_a_column_without_any_value_says_nothing(tmp_path):
    nothing = dict.fromkeys(("surface", "pose", "in", "offset", "duration"), pa.nulls(2))
    for found in both_ways(parquet(**nothing), tmp_path):
        assert found.places.places == [Place()]
        assert found.good.all()


def test_an_offset_that_is_nan_is_none_as_null_is(tmp_path):
    for found in both_ways(parquet(offset=pa.array([float("nan"), 2.5])), tmp_path):
        assert [place.offset for place in found.places.places] == [None, 2.5]
        assert found.good.all()


@pytest.mark.parametrize("column", [pa.array([None, 8], pa.duration("s")), pa.array([None, [8]])])
def test_a_duration_that_is_no_number_is_told_not_passed_over(column, tmp_path):
    for found in both_ways(parquet(duration=column), tmp_path):
        assert found.good.tolist() == [True, False]
        assert found.status[1].endswith("is not a positive time in s")


@pytest.mark.parametrize("first", [None, [0.0, 0, 0, 0, 0, 0]])
@pytest.mark.parametrize("kind", [pa.list_(pa.float64()), pa.list_(pa.float32(), 6)])
def test_poses_may_be_lists_of_numbers(first, kind, tmp_path):
    column = pa.array([first, [500.5, 0, 20, 0, 0, 0.25]], kind)
    for found in both_ways(parquet(pose=column), tmp_path):
        poses = [[float(word) for word in place.pose.split()] for place in found.places.places]
        assert poses == [first or [], [500.5, 0, 20, 0, 0, 0.25]]
        assert found.unknown == []


@pytest.mark.parametrize(
    ("said", "pose"),
    [
        ("[500.5, 0, 20, 0, 0, 0.1]", "500.5 0 20 0 0 0.1"),
        ("(500.5,0,20,0,0,0.1)", "500.5 0 20 0 0 0.1"),
        ("[500.5  0.  20.  0.  0.  0.1]", "500.5 0. 20. 0. 0. 0.1"),
        ("500,5 0 20 0 0 0,1", "500.5 0 20 0 0 0.1"),
        ("500,5 0 20 0 0", "500,5 0 20 0 0"),
        ("poses/1,2,3,4,5,6.json", "poses/1,2,3,4,5,6.json"),
    ],
)
def test_a_pose_is_six_numbers_however_a_table_parts_them(said, pose):
    found = table(f'"{said}"', more="pose")
    assert [place.pose for place in found.places.places] == [pose]


def test_decimal_commas_are_those_of_the_numbers_whatever_names_hold():
    text = (
        "\ufeffid;x0;y0;z0;xg;yg;zg;surface;offset;duration\r\n"
        "a;-40;0;5,25;40;0;5,5;v2.1.stl;2,5;8,5\r\n"
        "b;-40;0;5;40;0;1e-1;v2.2.stl;;\r\n"
    )
    found = pairs.read(Source("pairs.csv", text.encode()))
    np.testing.assert_array_equal(found.pairs.start[:, 2], [5.25, 5.0])
    np.testing.assert_array_equal(found.pairs.goal[:, 2], [5.5, 0.1])
    np.testing.assert_array_equal(found.duration, [8.5, np.nan])
    assert [place.offset for place in found.places.places] == [2.5, None]
    assert [place.surface for place in found.places.places] == ["v2.1.stl", "v2.2.stl"]
    assert found.good.all()
    assert found.remarks == ("commas between digits read as decimal signs",)


def test_points_and_commas_together_are_not_guessed_at():
    text = "x0;y0;z0;xg;yg;zg\n1,5;2;3;4;5;6\n1.5;2;3;4;5;6\n"
    found = pairs.read(Source("pairs.csv", text.encode()))
    assert found.good.tolist() == [False, True]
    assert found.remarks == ()


def test_rows_without_a_word_are_no_rows():
    text = f"id,{HEADER},surface\na,1,2,3,4,5,6,a.stl\n,,,,,,,\nb,1,2,3,4,5,x,a.stl\n, ,,,,,,\n"
    found = pairs.read(Source("pairs.csv", text.encode()))
    assert found.ids == ["a", "b"]
    assert found.status[1].startswith("line 4, column 'zg'")


def test_ids_that_are_empty_are_told_as_such():
    with pytest.raises(InputError, match="line 3: is empty, and so is line 2; give each pair an"):
        table("", "", more="id")


def test_columns_that_nobody_reads_are_known_but_not_those_of_our_own_tables():
    found = table("red,ok,part-00000.parquet,0.5", more="colour,status,part,nx")
    assert found.unknown == ["colour"]
    np.testing.assert_array_equal(found.pairs.start, [[1, 2, 3]])


def test_a_piece_of_a_file_does_not_decide_what_its_commas_are(tmp_path):
    """Its text is in one type or another, and another piece may have points."""
    cells = {name: pa.array(["1,5", "2,25"]) for name in HEADER.split(",")}
    whole, piece = both_ways(parquet(**cells), tmp_path)
    assert whole.pairs.start[0, 0] == 1.5
    assert all("x0" in status for status in piece.status)


def said(text, name="t.csv"):
    return pairs.read(Source(name, text.encode()))


@pytest.mark.parametrize(
    ("rows", "where", "either"),
    [
        # Excel in English quotes 1,234; another program quotes a decimal comma in the same way.
        (['"1,234",0,0,"1,334",0,0'], "'x0', line 2", "1.234 or 1234"),
        (["900,0,0,950,0,0", '950,0,0,"-1,050",0,0'], "'xg', line 3", "-1.050 or -1050"),
        (['"1,234",0,0,"1,234,567",0,0'], "'x0', line 2", "1.234 or 1234"),
        (["900;0;0;1,050;0;0"], "'xg', line 2", "1.050 or 1050"),
    ],
)
def test_a_comma_that_may_part_thousands_is_refused(rows, where, either):
    separator = ";" if ";" in rows[0] else ","
    with pytest.raises(InputError, match=f"column {where}: .* may be {either}; write the numbers"):
        said("\n".join([HEADER.replace(",", separator), *rows]))


@pytest.mark.parametrize(
    ("row", "x0"),
    [
        ('"0,234",0,0,"1,334",0,0', 0.234),
        ('"12,5",0,0,"1,334",0,0', 12.5),
        ("12,500;0,000;0,000;60,125;1,000;0,000", 12.5),
        ("12,500;10,100;10,200;60,125;11,000;10,500", 12.5),
    ],
)
def test_a_comma_that_can_only_be_a_decimal_sign_is_one(row, x0):
    separator = ";" if ";" in row else ","
    found = said(f"{HEADER.replace(',', separator)}\n{row}\n")
    assert found.pairs.start[0, 0] == x0
    assert found.remarks == ("commas between digits read as decimal signs",)


def test_thousands_beside_points_are_bad_rows_by_name():
    found = said(f'{HEADER}\n"1,234.5",0,0,9.5,0,0\n1,2.5,3,4,5,6\n')
    assert found.status[0] == "line 2, column 'x0': '1,234.5' is not a finite number"
    assert found.good.tolist() == [False, True]


def test_truth_values_are_no_numbers():
    truth = pa.array([True, False])
    found = pairs.read(Source("p.parquet", parquet(duration=truth)))
    assert "column 'duration': 'True' is not a positive time in s" in found.status[0]
    assert not found.good.any()
    found = pairs.read(Source("p.parquet", parquet(yg=truth)))
    assert "column 'yg': 'True' is not a finite number" in found.status[0]


@pytest.mark.parametrize("width", [6, 9])
def test_text_in_bytes_of_one_width_is_text_and_bytes_that_are_none_stay(width, tmp_path):
    """As numpy writes its own: padded with zeros."""
    names = pa.array([name.ljust(width, b"\0") for name in (b"a.stl", b"bc.stl")], pa.binary(width))
    for found in both_ways(parquet(surface=names), tmp_path):
        assert [place.surface for place in found.places.places] == ["a.stl", "bc.stl"]
    key = pa.array([b"\xff" * 16, b"\xfe" * 16], pa.binary(16))
    assert pairs.read(Source("p.parquet", parquet(key=key))).good.all()

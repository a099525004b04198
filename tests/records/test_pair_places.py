"""Tables say where each pair lies; what is wrong with a word is told by row."""

import numpy as np
import pytest

from dmpcli.records import pairs
from dmpcli.records.file_io import Source
from dmpcli.records.pair_places import Place

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
    import io

    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {name: [1.0, 2.0] for name in HEADER.split(",")}
    sink = io.BytesIO()
    pq.write_table(pa.table(columns | {"surface": ["a", None], "offset": [1.5, None]}), sink)
    found = pairs.read(Source("p.parquet", sink.getvalue()))
    assert [place.surface for place in found.places.places] == ["a", ""]
    assert [place.offset for place in found.places.places] == [1.5, None]


def test_columns_that_nobody_reads_are_known_but_not_those_of_our_own_tables():
    found = table("red,ok,part-00000.parquet,0.5", more="colour,status,part,nx")
    assert found.unknown == ["colour"]
    np.testing.assert_array_equal(found.pairs.start, [[1, 2, 3]])

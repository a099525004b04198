"""Strokes of a file and of a batch's folder: which are drawn, in what order, with what facts."""

import dataclasses

import numpy as np
import pytest

from dmpcli.errors import InputError
from dmpcli.records import record, schemas, stroke_selection
from dmpcli.records.file_io import TABLE, Source
from dmpcli.records.record import Provenance, Record
from dmpcli.spatial.output_events import OutputEvent
from tests.control.mock_runs import UP, short, source

EVENTS = (OutputEvent(0.2, "DO1", on=True),)
THREE = [
    short("a", force=np.linspace(1.0, 2.0, 41), events=EVENTS),
    short("b", by=(0.0, 5.0, 0.0)),
    short("c", by=(0.0, 9.0, 0.0)),
]


def test_a_file_is_read_whole_in_its_order_or_as_asked():
    content = source(THREE, tau=3.0)
    batch = stroke_selection.find(content)
    assert [one.id for one in batch.strokes] == ["a", "b", "c"]
    assert (batch.folder, batch.failed) == (False, {})
    assert batch.entries == ({"role": "trajectory", "sha256": content.sha256},)
    for one, wanted in zip(batch.strokes, THREE, strict=True):
        for name in ("t", "position", "rotation", "normal"):
            np.testing.assert_allclose(getattr(one, name), getattr(wanted, name), atol=1e-9)
    np.testing.assert_allclose(batch.strokes[0].force, THREE[0].force)
    assert batch.strokes[0].events == EVENTS
    assert [one.first_row for one in batch.strokes] == [1, 42, 83]
    assert batch.strokes[1].facts == {"tau": 3.0}
    some = stroke_selection.find(content, ["c", "a"])
    assert [one.id for one in some.strokes] == ["c", "a"]
    bare = batch.without_events()
    assert [one.events for one in bare.strokes] == [()] * 3
    assert bare.entries == batch.entries


def test_ids_that_are_not_there_or_twice_are_refused():
    with pytest.raises(InputError, match="--id a: is given twice"):
        stroke_selection.find(source(THREE), ["a", "b", "a"])
    with pytest.raises(InputError, match="no stroke has the id x; it has a, b, c"):
        stroke_selection.find(source(THREE), ["a", "x"])
    one = dataclasses.replace(
        THREE[0], t=np.zeros(1), position=np.zeros((1, 3)), rotation=None, normal=None, force=None,
        events=(),
    )  # fmt: skip
    with pytest.raises(InputError, match="stroke a has one row; a motion needs at least two"):
        stroke_selection.find(source([one]))


def test_many_ids_are_named_by_the_first_five():
    assert stroke_selection.listed(list("abcde")) == "a, b, c, d, e"
    assert stroke_selection.listed(list("abcdefg")) == "a, b, c, d, e and 2 more"


@pytest.fixture
def folder(tmp_path):
    """A batch of four pairs in two parts; one of them has failed."""
    for part, strokes in ((0, [THREE[0], THREE[1]]), (1, [THREE[2]])):
        content = source(strokes, tau=3.0)
        (tmp_path / f"part-{part:05d}.parquet").write_bytes(content.content)
    names = ["a", "bad", "b", "c"]
    columns = {
        "id": names,
        "part": ["part-00000.parquet", None, "part-00000.parquet", "part-00001.parquet"],
    }
    columns["status"] = [schemas.OK, "too long", schemas.OK, schemas.OK]
    table = {name: np.array(values, dtype=object) for name, values in columns.items()}
    for k, name in enumerate(("x0", "y0", "z0", "xg", "yg", "zg")):
        table[name] = 10.0 * k + np.arange(4.0)
    nothing = np.full(4, np.nan)
    table |= {
        name: np.where(np.arange(4) < 3, value, nothing)
        for name, value in zip(schemas.NORMAL, UP, strict=True)
    }
    made = Record(schemas.PAIRS, table, Provenance("generalize", {}, (), {}))
    (tmp_path / TABLE).write_bytes(record.encode(made))
    return tmp_path


def test_a_batch_is_drawn_in_the_order_of_its_pairs_with_their_own_facts(folder):
    batch = stroke_selection.find(str(folder))
    assert [one.id for one in batch.strokes] == ["a", "b", "c"]
    assert (batch.folder, batch.failed) == (True, {"bad": "too long"})
    assert [entry["role"] for entry in batch.entries] == ["pairs", "trajectory", "trajectory"]
    assert batch.strokes[0].facts == {
        "tau": 3.0,
        "start": [0.0, 10.0, 20.0],
        "goal": [30.0, 40.0, 50.0],
        "normal": [0.0, 0.0, 1.0],
    }
    # A pair whose plane is not known has no normal of its own.
    assert batch.strokes[2].facts == {
        "tau": 3.0,
        "start": [3.0, 13.0, 23.0],
        "goal": [33.0, 43.0, 53.0],
    }
    np.testing.assert_allclose(batch.strokes[1].position, THREE[1].position)
    some = stroke_selection.find(str(folder), ["c", "a"])
    assert [one.id for one in some.strokes] == ["c", "a"]
    assert (some.failed, len(some.entries)) == ({}, 3)
    assert len(stroke_selection.find(str(folder), ["c"]).entries) == 2


def test_a_pair_without_trajectory_is_refused_where_it_is_asked_for(folder):
    with pytest.raises(InputError, match="pair bad has no trajectory: too long"):
        stroke_selection.find(str(folder), ["a", "bad"])
    with pytest.raises(InputError, match="no stroke has the id x; it has a, bad, b, c"):
        stroke_selection.find(str(folder), ["x"])


def test_a_part_that_lacks_a_stroke_or_a_batch_of_none_is_refused(folder):
    content = source([THREE[1]], tau=3.0)
    (folder / "part-00000.parquet").write_bytes(content.content)
    with pytest.raises(InputError, match=f"holds no stroke a, which {TABLE} says is there"):
        stroke_selection.find(str(folder))
    held = record.decode(Source(TABLE, (folder / TABLE).read_bytes()), schemas.PAIRS)
    columns = held.columns | {"status": np.array(["too long"] * 4, dtype=object)}
    made = dataclasses.replace(held, columns=columns)
    (folder / TABLE).write_bytes(record.encode(made))
    with pytest.raises(InputError, match="no pair has a trajectory; the first, a: too long"):
        stroke_selection.find(str(folder))


def test_a_file_of_another_kind_is_refused():
    columns = {"t": np.arange(3.0), **{name: np.zeros(3) for name in ("x", "y", "z")}}
    made = Record(schemas.DEMONSTRATION, columns, Provenance("record", {}, (), {}))
    with pytest.raises(InputError, match="demonstration"):
        stroke_selection.find(Source("d.parquet", record.encode(made)))

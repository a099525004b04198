"""The lines of a text that count: against a plain reading, line by line."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.records import tables, text_lines
from dmpcli.records.file_io import Source
from dmpcli.records.text_lines import counted_lines


def plainly(text):
    """Lines and their numbers, by str alone."""
    every = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    every = every.rstrip("\n").split("\n")
    kept = [(i, line) for i, line in enumerate(every, 1) if line.strip(" \t")[:1] not in ("", "#")]
    return [line for _, line in kept], [i for i, _ in kept]


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@example("a\n\n")
@example("a\n# b")
@example("\ufeff# a\nb\n \nc\n\t# d")
@given(st.text(st.sampled_from("a1,é# \t\n\r"), min_size=1, max_size=40))
def test_lines_and_their_numbers_are_those_of_a_plain_reading(text):
    lines, numbers = plainly(text)
    found = counted_lines(Source("a.csv", text.encode()))
    assert found.text() == "\n".join(lines).encode()
    if lines:
        np.testing.assert_array_equal(found.numbers, numbers)
        assert found.first() == lines[0].encode()
        assert found.rest().text() == "\n".join(lines[1:]).encode()


@pytest.mark.parametrize("size", [1, 7, 1 << 20])
@pytest.mark.parametrize("tail", ["", "\n", "\n" * 9000])
def test_nothing_changes_with_how_much_is_looked_at_at_once(monkeypatch, size, tail):
    monkeypatch.setattr(text_lines, "_AT_ONCE", size)
    text = "a,b\n1,2\n# c\n3,4\n\n5,6" + tail
    found = counted_lines(Source("a.csv", text.encode()))
    assert found.text() == b"a,b\n1,2\n3,4\n5,6"
    np.testing.assert_array_equal(found.numbers, [1, 2, 4, 6])


def test_what_is_no_text_is_refused_by_name():
    with pytest.raises(InputError, match=r"a\.csv: is neither"):
        counted_lines(Source("a.csv", b"a,b\n\xff\xfe,1\n"))


def test_a_part_of_a_text_is_no_copy_for_arrow():
    body = counted_lines(Source("a.csv", b"a,b\n1,2\n3,4\n")).rest()
    assert body.reader().read() == b"1,2\n3,4"
    assert b"a" not in body
    assert b"4" in body


@pytest.mark.parametrize("texts", [None, ()])
def test_rows_longer_than_a_block_are_read_and_numbers_are_those_of_python(monkeypatch, texts):
    monkeypatch.setattr(tables, "_BLOCK", 64)
    rows = [f"{i},{0.1 * i!r},{'0' * 90}{i}.5" for i in range(200)]
    table = tables.read(Source("a.csv", "\n".join(["a,b,c", *rows]).encode()), texts=texts)
    np.testing.assert_array_equal(table.numbers("b"), [0.1 * i for i in range(200)])
    np.testing.assert_array_equal(table.numbers("c"), [i + 0.5 for i in range(200)])


def test_a_bad_cell_in_a_later_block_is_named_with_its_line(monkeypatch):
    monkeypatch.setattr(tables, "_BLOCK", 64)
    rows = [f"{i},{i}" for i in range(100)]
    rows[80] = "80,none"
    table = tables.read(Source("a.csv", "\n".join(["a,b", *rows]).encode()), texts=())
    with pytest.raises(InputError, match="line 82: 'none'"):
        table.numbers("b")

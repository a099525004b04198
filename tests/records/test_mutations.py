"""Every reader on some hundreds of damaged and crafted inputs; `benchmarks.mutations` does more."""

import json
import warnings
from random import Random

import pytest

from benchmarks import mutations
from benchmarks.mutations import Reader, readers, run, tried
from dmpcli.errors import InputError

COUNT = 120


@pytest.fixture(scope="module")
def known():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return readers()


def test_there_are_as_many_readers_as_the_files_that_are_read(known):
    assert len(known) >= 20


@pytest.mark.slow
@pytest.mark.parametrize("name", readers())
def test_whatever_is_done_to_an_input_it_is_read_or_refused_by_name(name, known):
    found = run(known[name], COUNT, seed=20)
    assert found.held == []
    assert found.read + found.refused == COUNT
    assert found.slowest < mutations.LONGEST


def test_a_mutation_is_made_again_by_its_number(known):
    reader = known["tool"]
    first = [mutations.mutated(reader, Random(f"7 tool {n}")) for n in range(50)]
    again = [mutations.mutated(reader, Random(f"7 tool {n}")) for n in reversed(range(50))]
    assert first == again[::-1]
    assert len(set(first)) > 40


def planted(deed):
    def read(source):
        if b"x" in source.content:
            deed(source)
        raise InputError(f"{source.name}: is refused")

    return Reader("planted", read, "a.bin", (b"x",))


def test_the_tool_finds_what_is_planted(known):
    def divide(_):
        return 1 / 0

    def warn(_):
        warnings.warn("overflow", RuntimeWarning, stacklevel=1)

    def nameless(_):
        raise InputError("something is wrong")

    for deed, kind in (
        (divide, "ZeroDivisionError"),
        (warn, "RuntimeWarning"),
        (nameless, "no name"),
    ):
        assert tried(planted(deed), b"x")[0].startswith(kind)
    assert tried(planted(divide), b"y") == ("refused", "")


def test_the_tool_finds_a_hang(monkeypatch):
    monkeypatch.setattr(mutations, "LONGEST", 0.05)

    def hang(_):
        while True:
            json.dumps({})

    assert tried(planted(hang), b"x")[0] == "hang"

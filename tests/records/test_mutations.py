"""Every reader on some hundreds of damaged and crafted inputs; `benchmarks.mutations` does more."""

import ctypes
import json
import os
import signal
import warnings

import pytest

from benchmarks.mutations import guard, worker
from benchmarks.mutations.guard import Reader, tried
from benchmarks.mutations.records import MAKES
from benchmarks.mutations.worker import Asked, run, runs
from dmpcli.errors import InputError, RefusedError

COUNT = 60


def test_there_are_as_many_readers_as_the_files_that_are_read():
    assert len(MAKES) >= 20


@pytest.mark.sweep(kept=10)
@pytest.mark.slow
@pytest.mark.parametrize("name", MAKES)
def test_whatever_is_done_to_an_input_it_is_read_or_refused_by_name(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        reader = MAKES[name]()
    found = run(reader, Asked(COUNT, seed=20))
    assert found.held == []
    assert found.read + found.refused == COUNT
    assert found.slowest < guard.LONGEST


def test_a_mutation_is_made_again_by_its_number():
    reader = MAKES["tool"]()
    first = [reader.mutation(7, n) for n in range(50)]
    again = [reader.mutation(7, n) for n in reversed(range(50))]
    assert first == again[::-1]
    assert len(set(first)) > 40


def planted(deed):
    def read(source):
        if b"x" in source.content:
            deed(source)
        raise InputError(f"{source.name}: is refused")

    return Reader("planted", read, "a.bin", (b"x",))


def test_the_tool_finds_what_is_planted():
    def divide(_):
        return 1 / 0

    def warn(_):
        warnings.warn("overflow", RuntimeWarning, stacklevel=1)

    def nameless(_):
        raise InputError("something is wrong")

    def mistaken(source):
        raise RefusedError(f"{source.name}: cannot be drawn")

    for deed, kind in (
        (divide, "ZeroDivisionError"),
        (warn, "RuntimeWarning"),
        (nameless, "no name"),
        (mistaken, "exit code"),
    ):
        assert tried(planted(deed), b"x")[0].startswith(kind)
    assert tried(planted(divide), b"y") == ("refused", "")


def test_the_tool_finds_a_hang(monkeypatch):
    monkeypatch.setattr(guard, "LONGEST", 0.05)

    def hang(_):
        while True:
            json.dumps({})

    assert tried(planted(hang), b"x")[0] == "hang"


def harmful(deed):
    """A maker of a reader whose process suffers from every mutation with a bracket in it."""

    def read(source):
        if source.content.count(b"[") > 100:
            deed()
        if source.content != b"sound text, 1":
            raise InputError(f"{source.name}: is refused")

    return {"planted": lambda _: Reader("planted", read, "a.bin", (b"sound text, 1",))}


def suffering(count, seed=3):
    """Numbers of the mutations that the reader above suffers from, told without reading any."""
    reader = harmful(None)["planted"](None)
    return [n for n in range(count) if reader.mutation(seed, n).count(b"[") > 100]


def crash():
    ctypes.string_at(1)


def end():
    os._exit(0)


@pytest.mark.slow
@pytest.mark.parametrize("deed", [crash, end])
def test_a_process_that_dies_is_told_by_its_mutation_and_the_rest_goes_on(deed, tmp_path):
    count = 400
    bad = suffering(count)
    assert 1 < len(bad) < 40
    [found] = runs(harmful(deed), Asked(count, 3, tmp_path), jobs=1)
    assert [int(line.split()[1].rstrip(":")) for line in found.held] == bad
    assert found.count == count
    assert all("died" in line for line in found.held)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(f"planted-{n}" for n in bad)


def block():
    read, _ = os.pipe()
    os.read(read, 1)


def spin():
    signal.signal(signal.SIGPROF, signal.SIG_IGN)
    while True:
        json.dumps({})


@pytest.mark.slow
@pytest.mark.parametrize(("deed", "limit"), [(block, "STILL"), (spin, "DEAF")])
def test_a_process_that_hears_no_alarm_is_ended(monkeypatch, deed, limit):
    monkeypatch.setattr(worker, limit, 0.5)
    count = suffering(400)[0] + 1
    [found] = runs(harmful(deed), Asked(count, 3), jobs=1)
    [line] = found.held
    assert "no alarm heard" in line
    assert found.count == count

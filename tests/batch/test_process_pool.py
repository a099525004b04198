"""Processes that draw know what this one knows, whenever it came to know it."""

import os

from dmpcli.batch import process_pool


def keep(words):
    os.environ["GIVEN"] = words


def told(name):
    return os.environ.get(name)


def test_processes_begin_with_what_is_given_in_the_environment_of_now(monkeypatch):
    """They are forked from a process that is as old as the first of them."""
    process_pool.begin()
    monkeypatch.setenv("BEFORE", "old")
    with process_pool.executor(1, keep, "first") as pool:
        assert list(pool.map(told, ["GIVEN", "BEFORE", "AFTER"])) == ["first", "old", None]
    monkeypatch.setenv("AFTER", "new")
    monkeypatch.delenv("BEFORE")
    with process_pool.executor(1, keep, "then") as pool:
        assert list(pool.map(told, ["GIVEN", "BEFORE", "AFTER"])) == ["then", None, "new"]

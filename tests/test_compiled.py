"""Kernels that an earlier version has left are no defect: they are compiled anew."""

import sys

import pytest

from dmpcli import extras
from tests.extras_here import needs

pytestmark = needs(extras.FAST)

BEFORE = """
from typing import NamedTuple
from dmpcli.compiled import kernel
class NAME(NamedTuple):
    value: float
@kernel
def doubled(one: NAME) -> float:
    return 2.0 * one.value
"""


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Write and load a module with one kernel, whose argument is of a type of so named."""
    monkeypatch.syspath_prepend(tmp_path)

    def load(name):
        sys.modules.pop("of_theirs", None)
        (tmp_path / "of_theirs.py").write_text(BEFORE.replace("NAME", name))
        return __import__("of_theirs")

    yield load
    sys.modules.pop("of_theirs", None)


def kept_in(folder):
    return sorted(folder.rglob("*.nbi"))


def test_what_another_version_has_kept_of_types_that_are_gone_is_compiled_anew(module, tmp_path):
    theirs = module("Theirs")
    assert theirs.doubled(theirs.Theirs(2.0)) == 4.0
    [index] = kept_in(tmp_path)
    before = index.read_bytes()
    ours = module("WithAnotherName")
    assert ours.doubled(ours.WithAnotherName(3.0)) == 6.0
    assert kept_in(tmp_path) == [index]
    assert index.read_bytes() != before


@pytest.mark.parametrize("error", [AttributeError("Limits"), EOFError(), ModuleNotFoundError()])
def test_what_cannot_be_read_counts_as_nothing(error):
    from dmpcli import compiled

    class Kept:
        flushed = False

        def load_overload(self, signature, target):
            raise error

        def flush(self):
            self.flushed = True

    kept = Kept()
    compiled._forgive(kept)
    assert kept.load_overload(None, None) is None
    assert kept.flushed

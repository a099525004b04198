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


@pytest.mark.parametrize("share", [0.0, 0.5, 0.99])
@pytest.mark.parametrize("kind", ["*.nbi", "*.nbc"])
def test_what_was_cut_short_is_compiled_anew(module, tmp_path, kind, share):
    assert module("Once").doubled.__module__ == "of_theirs"
    once = sys.modules["of_theirs"]
    once.doubled(once.Once(2.0))
    [kept] = tmp_path.rglob(kind)
    whole = kept.read_bytes()
    kept.write_bytes(whole[: int(share * len(whole))])
    again = module("Once")
    assert again.doubled(again.Once(3.0)) == 6.0
    assert len([*tmp_path.rglob(kind)]) == 1


def test_what_another_version_has_kept_of_types_that_are_gone_is_compiled_anew(module, tmp_path):
    theirs = module("Theirs")
    assert theirs.doubled(theirs.Theirs(2.0)) == 4.0
    [index] = kept_in(tmp_path)
    before = index.read_bytes()
    ours = module("WithAnotherName")
    assert ours.doubled(ours.WithAnotherName(3.0)) == 6.0
    assert kept_in(tmp_path) == [index]
    assert index.read_bytes() != before


@pytest.mark.parametrize(
    "error",
    [
        AttributeError("Limits"),
        EOFError(),
        ModuleNotFoundError(),
        RuntimeError("Invalid abbrev number"),
        UnicodeDecodeError("utf-8", b"", 0, 0, ""),
        PermissionError(),
    ],
)
def test_what_cannot_be_read_counts_as_nothing(error):
    from dmpcli import compiled

    class Kept:
        flushed = False

        def load_overload(self, signature, target):
            raise error

        def save_overload(self, signature, data):
            raise OSError(28, "No space left on device")

        def flush(self):
            self.flushed = True

    kept = Kept()
    compiled._forgive(kept)
    assert kept.load_overload(None, None) is None
    assert kept.flushed
    kept.save_overload(None, None)

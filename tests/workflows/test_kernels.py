"""Kernels that an earlier version has left are no defect: they are compiled anew."""

import pytest

from dmpcli.workflows import kernels


@pytest.fixture
def ready():
    from dmpcli.surfaces.kernels import ready

    return ready


@pytest.mark.parametrize("error", [AttributeError("Limits"), EOFError(), ModuleNotFoundError()])
def test_what_another_version_has_kept_is_removed_and_compiled_anew(
    ready, tmp_path, monkeypatch, error
):
    theirs, other = tmp_path / "stepping.start-1.py311.nbi", tmp_path / "other.nbi"
    for file in (theirs, tmp_path / "stepping.start-1.py311.1.nbc", other):
        file.write_bytes(b"")
    monkeypatch.setattr(ready, "files", lambda: [(str(tmp_path), ".start-"), ("", "")])

    def load():
        if theirs.exists():
            raise error

    monkeypatch.setattr(ready, "load", load)
    kernels.get_ready()
    assert list(tmp_path.iterdir()) == [other]


def test_what_fails_all_the_same_is_a_defect(ready, tmp_path, monkeypatch):
    def load():
        raise AttributeError("ours")

    monkeypatch.setattr(ready, "files", lambda: [(str(tmp_path), ".start-")])
    monkeypatch.setattr(ready, "load", load)
    with pytest.raises(AttributeError, match="ours"):
        kernels.get_ready()

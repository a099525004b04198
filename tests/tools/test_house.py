"""The figures of what the code costs to read, on packages whose figures are known."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import house  # noqa: E402

sys.path.pop(0)

TEXT = '''"""A module
of two lines."""

import os
from x import (
    y,
)

# A comment.
class One:
    """Doc."""

    a = 1


def f(x):
    return [
        x,
    ]
'''


def test_code_lines_are_neither_words_nor_imports():
    assert house.code_lines(TEXT) == 6


def test_names_that_stand_for_two_things_are_listed(tmp_path):
    (tmp_path / "a.py").write_text(TEXT)
    (tmp_path / "b.py").write_text("class One:\n    pass\n\n\nclass Two:\n    pass\n")
    found = house.counted(tmp_path)
    assert found["class names defined twice"] == ["One"]
    assert (found["files"], found["code lines"], found["classes"]) == (2, 10, 3)
    assert found["docstring lines a definition"] == 0.25


def test_a_parameter_is_followed_through_calls_and_fields_and_not_beyond(tmp_path, monkeypatch):
    root = tmp_path / "dmpcli"
    for folder in ("top", "low"):
        (root / folder).mkdir(parents=True)
    (tmp_path / "pyproject.toml").write_text(
        '[[tool.importlinter.contracts]]\nlayers = ["dmpcli.top", "dmpcli.low"]\n'
    )
    (root / "top" / "a.py").write_text(
        "from dmpcli.low import b\nfrom dmpcli.low.c import Held, take, leave\n\n"
        "def begin(path, other):\n    held = Held(other, path)\n    leave(other)\n    take(held)\n"
        "    read = b.read(held.path)\n    b.write(read)\n    b.free(held.other)\n"
    )
    (root / "low" / "b.py").write_text(
        "def read(path):\n    return path\n\ndef write(x):\n    pass\n\ndef free(x):\n    pass\n"
    )
    (root / "low" / "c.py").write_text(
        "class Held:\n    other: str\n    path: str\n\ndef take(held):\n    pass\n\n"
        "def leave(other):\n    pass\n"
    )
    monkeypatch.setattr(house, "ROOT", root)
    walk = house.Walk()
    walk.follow(root / "top" / "a.py", "begin", "path")
    assert [path.stem for path in walk.files] == ["a", "c", "b"]
    assert {function for _, function, _ in walk._seen} == {"begin", "take", "read", "write"}
    assert walk.climbs == 3


def test_a_run_is_counted_while_it_runs():
    kept = ROOT / "tests" / "records" / "version_0_1" / "trajectory.parquet"
    found = house.executed(str(kept))
    assert 10 < found["modules entered"] < 120
    assert 1 < found["calls on the stack at a set-point"] < 20
    assert sys.getprofile() is None
    with pytest.raises(SystemExit):
        house.executed("none.parquet")
    assert sys.getprofile() is None

"""The mutants of a text whose mutants are known, and a trial of tests that notice and do not."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tools.mutants import choice, operators, reach, warm

ROOT = Path(__file__).parents[2]


def changed(line):
    """What becomes of one statement of a function."""
    text = f"def f(x, y):\n    {line}\n"
    inner = [m for m in operators.mutants("f.py", text) if m.scope == "f"]
    return {m.after for m in inner if m.line == 2}


@pytest.mark.parametrize(
    ("line", "after"),
    [
        ("z = x - y", {"z = x + y"}),
        ("z = x @ y", {"z = y @ x"}),
        ("z = -x", {"z = x"}),
        ("z = x < y", {"z = x <= y", "z = x >= y"}),
        ("z = x and not y", {"z = x or not y", "z = x and y"}),
        ("z = 3", {"z = 4", "z = 2"}),
        ("z = 1.5", {"z = 2.5"}),
        ("z = True", {"z = False"}),
        ("z = x[1:]", {"z = x[:]", "z = x[1 + 1:]", "z = x[2:]", "z = x[0:]"}),
        ("z = f(x, y)", {"z = f(x)"}),
        ("z = min(x)", {"z = max(x)"}),
        ("z = x.any(axis=-1)", {"z = x.all(axis=-1)", "z = x.any()", "z = x.any(axis=0)",
                                "z = x.any(axis=1)", "z = x.any(axis=-2)", "z = x.any(axis=-0)"}),
        ("z = x if y else f", {"z = f if y else x"}),
        ("return x", {"return None"}),
        ("x += y", {"x -= y", "x = y", "pass"}),
        ("x[y] = f", {"pass"}),
        ("f(x)", {"pass"}),
        ("raise ValueError('a' + 'b')", {"pass"}),
        ("'A text with 1.'", set()),
    ],
)  # fmt: skip
def test_what_becomes_of_a_statement(line, after):
    assert changed(line) == after


@pytest.mark.slow
def test_every_mutant_of_a_module_compiles_and_differs_from_it():
    path = ROOT / "dmpcli/metrics/wave_height.py"
    text = path.read_text()
    plain = ast.dump(ast.parse(text))
    count = len(operators.mutants(str(path), text))
    assert count > 300
    for number in range(0, count, 40):
        tree = operators.mutants(str(path), text)[number].placed()
        compile(tree, str(path), "exec")
        assert ast.dump(tree) != plain


def test_what_is_loaded_at_once_is_judged_by_the_tests_that_use_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = "p/room/a.py"
    Path(file).parent.mkdir(parents=True)
    Path(file).write_text("A = 3\nB = 4\n\n\ndef f():\n    return A\n\n\ndef g():\n    return B\n")
    a, b = "tests/room/test_a.py::a", "tests/room/test_a.py::b"
    known = reach.Reach({a: 0.1, b: 0.2}, {file: {1: set(), 2: set(), 6: {a}, 10: {b}}}, [])
    of = {m.line: m for m in operators.mutants(file, Path(file).read_text())}
    assert choice.reached(of[1], known) == {a}
    assert choice.reached(of[2], known) == {b}
    assert choice.reached(of[6], known) == {a}
    # The others of its file come last: what it makes may have been kept for them.
    assert choice.stages(of[6], known, 9.0) == [[a], [b]]
    assert choice.stages(of[6], known, 0.25) == [[a]]


def test_kept_results_judge_first_with_half_of_what_a_mutant_is_worth():
    file = "p/room/a.py"
    [mutant] = [
        m for m in operators.mutants(file, "def f(x):\n    return -x\n") if m.after[-2:] == " x"
    ]
    kept = [f"tests/room/test_kept.py::{n}" for n in "abc"]
    a = "tests/room/test_a.py::a"
    seconds = dict(zip([*kept, a], (0.3, 0.4, 0.5, 0.2), strict=True))
    known = reach.Reach(seconds, {file: {2: set(seconds)}}, [])
    assert choice.stages(mutant, known, 1.6) == [kept[:2], [a]]


def test_nothing_of_the_repository_may_be_loaded_before_a_mutant():
    """These tests are, here."""
    with pytest.raises(RuntimeError, match="loaded before any mutant: tests"):
        reach.load([])


def test_a_changed_function_is_put_in_place_in_every_name_that_holds_it(monkeypatch):
    text = "def f(x):\n    return x + 1\n\n\ndef g(x):\n    return x\n"
    held = {}
    exec(compile(text, "f.py", "exec"), held)
    known = {warm._key(held[name].__code__): [held[name]] for name in "fg"}
    monkeypatch.setattr(warm, "_functions", known)
    taken = [held["f"]]
    [mutant] = [m for m in operators.mutants("f.py", text) if m.after == "return x - 1"]
    assert warm.put(compile(mutant.placed(), "f.py", "exec"))
    assert taken[0](3) == 2
    assert held["g"](3) == 3
    # What changes nothing that is loaded has to be tried elsewhere.
    assert not warm.put(compile("A = 4", "f.py", "exec"))


MODULE = '''
"""What a test looks at and what none does."""

LIMIT = 3


def seen(x):
    while x < 0:
        pass
    return x + LIMIT


def unseen(x):
    return x - 1
'''
TEST = """
from package.room.a import seen


def test_it():
    assert seen(2) == 5
"""


PROGRAM = """
import json, sys
from pathlib import Path
from tools.mutants import operators, reach
from tools.mutants.__main__ import judged
if sys.argv[1:]:
    raise SystemExit(reach.measure("tests/room", [Path.cwd() / "package"], Path("reach.json")))
file = "package/room/a.py"
known = reach.read([Path("reach.json")])
reach.load(["hypothesis", "numpy"])
for mutant in operators.mutants(file, Path(file).read_text()):
    if mutant.name.partition(": ")[2] in WANTED:
        print(json.dumps(judged(mutant, known, 9.0)))
"""
WANTED = (
    "LIMIT = 3 -> LIMIT = 4",
    "return x + LIMIT -> return x - LIMIT",
    "while x < 0: ... -> while x >= 0: ...",
    "return x - 1 -> return x + 1",
)


@pytest.mark.thorough
def test_a_mutant_is_killed_by_the_test_that_is_named_and_survives_where_none_reaches(tmp_path):
    for folder in ("package/room", "tests/room"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "__init__.py").touch()
    (tmp_path / "package/room/a.py").write_text(MODULE)
    (tmp_path / "tests/room/test_a.py").write_text(TEST)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    for options in (["measure"], []):
        done = subprocess.run(
            [sys.executable, "-c", f"WANTED = {WANTED}\n{PROGRAM}", *options],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": f"{tmp_path}:{ROOT}", "PYTEST_ADDOPTS": ""},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr + done.stdout
    by = {row["name"].partition(": ")[2]: row for row in map(json.loads, done.stdout.splitlines())}
    assert set(by) == set(WANTED)
    for name in WANTED[:2]:
        assert by[name]["killed"]
        assert by[name]["by"] == "tests/room/test_a.py::test_it"
    assert by[WANTED[2]]["how"] == "time limit"
    unseen = by[WANTED[3]]
    assert (unseen["killed"], unseen["tests"]) == (False, 0)

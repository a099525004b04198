"""The page that tells where each equation is computed tells the truth."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILE = re.compile(r"`([a-z_]+/[a-z_]+\.py)`")
NAME = re.compile(r"`([A-Za-z_][\w.]*)`")


def rows():
    """Yield each function that the table names: its equations, file and name."""
    for line in (ROOT / "docs" / "equations.md").read_text().splitlines():
        if not line.startswith("| ("):
            continue
        equations, where, _ = line.strip("| ").split(" | ")
        file = None
        for word in re.findall(r"`[^`]+`", where):
            if FILE.fullmatch(word):
                file = word.strip("`")
            elif NAME.fullmatch(word) and word != "`paper`":
                yield equations, file, word.strip("`")


def source_of(file, name):
    text = (ROOT / "dmpcli" / file).read_text()
    node = ast.parse(text)
    for part in name.split("."):
        node = next(
            child
            for child in node.body
            if isinstance(child, ast.FunctionDef | ast.ClassDef) and child.name == part
        )
    return text.splitlines()[node.lineno - 1 : node.end_lineno]


ROWS = list(rows())


def test_every_equation_has_a_row():
    told = {number for equations, _, _ in ROWS for number in re.findall(r"\(\d+\)", equations)}
    assert told == {f"({number})" for number in range(1, 12)}
    assert any("alpha_f" in equations for equations, _, _ in ROWS)


@pytest.mark.parametrize(("equations", "file", "name"), ROWS, ids=lambda value: str(value))
def test_the_function_that_is_named_has_the_number_beside_its_arithmetic(equations, file, name):
    comments = [line.partition("#")[2] for line in source_of(file, name) if "#" in line]
    said = [comment for comment in comments if re.search(r"eq\. \(", comment)]
    for number in re.findall(r"\((\d+)\)", equations):
        assert any(_covers(comment, int(number)) for comment in said), (number, said)
    if "alpha_f" in equations:
        assert any("alpha_f" in comment for comment in said)


def _covers(comment, number):
    """Tell whether a comment names the number, or a range that holds it."""
    for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", comment):
        if int(first) <= number <= int(last or first):
            return True
    return False


def test_the_readme_names_for_each_equation_what_the_page_names():
    readme = (ROOT / "README.md").read_text()
    told = re.search(r"Where they are computed.*?\n\n", readme, re.DOTALL)[0].partition(":")[2]
    named = []
    for part in told.split(";"):
        file, *names = re.findall(r"`([^`]+)`", part)
        numbers = [int(number) for number in re.findall(r"\((\d+)\)", part.partition("`")[0])]
        named += numbers
        for name in names:
            page = " ".join(e for e, f, n in ROWS if (f"dmpcli/{f}", n) == (file, name))
            assert page, (file, name)
            comments = " ".join(
                line.partition("#")[2] for line in source_of(file.removeprefix("dmpcli/"), name)
            )
            assert all(_covers(comments, number) for number in numbers), part
            assert "alpha_f" not in part or "alpha_f" in comments
    assert named == [1, 3, 4, 5, 6, 7, 8, 9, 10]

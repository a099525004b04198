"""Which tests judge a mutant, and in which order: those that run its lines, nearest first."""

import ast
from pathlib import Path

from tools.mutants.operators import Mutant
from tools.mutants.reach import Reach

LONGEST = 4.0
"""A test of more seconds judges nothing here: a score may be too low for it, never too high."""


def room(file: str) -> str:
    """The room of a module or test."""
    return Path(file).parts[1]


def mirrored(file: str) -> str:
    """The file that a module's own tests have by the house's rule."""
    return f"tests/{room(file)}/test_{Path(file).stem}.py"


def is_kept(test: str) -> bool:
    """Whether a test holds results against those of an earlier day, whatever is right."""
    return test.partition("::")[0].endswith("/test_kept.py")


def named_by(statement: ast.stmt) -> set[str]:
    """Names that a statement of a module or a class defines."""
    match statement:
        case ast.FunctionDef(name) | ast.ClassDef(name):
            return {name}
        case ast.Assign(targets):
            return {n.id for target in targets for n in ast.walk(target) if isinstance(n, ast.Name)}
        case ast.AnnAssign(ast.Name(name)):
            return {name}
    return set()


def users(file: str, names: set[str]) -> set[int]:
    """The lines of a file that speak of any of the names."""
    return {
        node.lineno
        for node in ast.walk(ast.parse(Path(file).read_text(encoding="utf-8")))
        if (isinstance(node, ast.Name) and node.id in names)
        or (isinstance(node, ast.Attribute) and node.attr in names)
    }


def reached(mutant: Mutant, reach: Reach) -> set[str]:
    """The tests that run a mutant, or for what is run on loading, those that run what uses it.

    A line that runs before the first test only (a constant, or what tests make while they are
    collected) may matter to every test of the module: those that run any of its lines.
    """
    direct = reach.of(mutant.file, mutant.lines)
    if direct or (
        mutant.in_function and not (mutant.lines & set(reach.lines.get(mutant.file, {})))
    ):
        return direct
    using = users(mutant.file, named_by(mutant.statement))
    using |= mutant.lines if mutant.in_function else set()
    return reach.of(mutant.file, using) or reach.of(mutant.file, set(reach.lines[mutant.file]))


def stages(mutant: Mutant, reach: Reach, budget: float) -> list[list[str]]:
    """Tests in the order of use, in processes of their own: the quickest to tell, then all others.

    Kept results come first, then the mirrored file's tests, the room's, and those of the other
    rooms. Those of the mirrored file that do not reach the mutant themselves come last: what it
    makes may have been made, and kept, for a test before them. ``budget`` is how many seconds of
    tests, as measured under coverage, one mutant is worth, half of them for kept results: what is
    left out can only lower the score.
    """
    found = reached(mutant, reach)
    mirror = mirrored(mutant.file)
    kept = {test for test in found if is_kept(test)}
    own = {test for test in found if room(test) == room(mutant.file)} - kept
    near = {test for test in own if test.startswith(mirror + "::")}
    beside = {test for test in reach.seconds if test.startswith(mirror + "::")} - found
    left, result = budget, []
    for group in (kept, near, own - near, found - own - kept, beside if found else set()):
        rest, spare = (left, 0.0) if group is not kept else (0.5 * left, 0.5 * left)
        taken: list[str] = []
        for test in sorted(group, key=lambda name: (reach.seconds[name], name)):
            if reach.seconds[test] <= min(LONGEST, rest):
                taken.append(test)
                rest -= reach.seconds[test]
        left = rest + spare
        if taken:
            result.append(taken)
    others = [test for group in result[1:] for test in group]
    return [*result[:1], *([others] if others else [])]

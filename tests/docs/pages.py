"""The pages that people read, and the lines in them that they type."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]

PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "sample_runs" / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
]
"""Without the reference, which is made from the program, with examples that run elsewhere."""

ELSEWHERE = {
    "make ": "the Makefile's targets: tests/tools, tests/docs/test_makefiles.py, .ci/run; that "
    "each is one, test_commands_of_pages_that_take_long_are_understood",
    ".venv/bin/python -m tools.mutants": "tests/tools/test_mutants.py; its words as above",
    "python3 -m venv": "the set-up: tests/tools/test_set_up.py, make dist",
    "dmpcli-env/bin/": "the set-up without make: make dist tries the wheel",
    ". .venv/bin/activate": "the reader's own shell",
    "xdg-open ": "the reader's own browser",
}
"""Lines that these tests do not run, by how they begin, and what does."""


def name_of(page):
    return str(page.relative_to(ROOT))


def blocks(page, language):
    """The contents of the fences of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.S | re.M)


def lines(block):
    """What a shell would take as one line each, without comments."""
    found = []
    for line in block.replace("\\\n", " ").splitlines():
        bare = re.sub(r"\s+#(?=\s).*$|^#.*$", "", line).strip()
        if found and found[-1].endswith("|"):
            found[-1] += f" {bare}"
        elif bare:
            found.append(bare)
    return found

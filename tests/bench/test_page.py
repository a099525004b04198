"""docs/bench.md: its example runs, and its options are those that are read."""

import re
from pathlib import Path

from dmpcli.bench import options
from dmpcli.errors import InputError
from dmpcli.extras import BENCH
from dmpcli.instruments.address import in_provenance
from tests.extras_here import needs

pytestmark = needs(BENCH)

PAGE = (Path(__file__).parents[2] / "docs" / "bench.md").read_text(encoding="utf-8")


def test_the_example_runs():
    (example,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(compile(example, "docs/bench.md", "exec"), {})


def test_the_table_names_every_option_and_no_other():
    table = PAGE.split("## Options")[1].split("\n\n")[0]
    told = {
        name
        for line in table.splitlines()
        if line.startswith("| `")
        for name in re.findall(r"`(\w+)`", line.split("|")[1])
    }
    try:
        options.parameters("ec66", {"nonsense": "1"})
    except InputError as error:
        read = set(str(error).split("bench has ")[1].split(", "))
    assert told == read


def test_a_file_says_all_of_the_url():
    assert in_provenance("bench://ec66?seed=3") == "bench://ec66?seed=3"
    assert in_provenance("elite://10.0.0.1?tool=1") == "elite"

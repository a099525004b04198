"""Everything that the package defines is used by it, or by those that a list names."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import unreached  # noqa: E402

sys.path.pop(0)

FILES = {
    "__init__.py": '_HOMES = {"told": "low.a"}\n',
    "low/__init__.py": "",
    "low/a.py": """
import logging
SIZE, LEFT = 1, 2
def told():
    return SIZE
def calls_itself(n):
    return calls_itself(n - 1)
def given():
    pass
def imported():
    pass
class Base:
    def overridden(self):
        return self.overridden()
    def asked(self):
        pass
class Heard(logging.Handler, Base):
    def emit(self, record):
        pass
""",
    "low/whole.py": "def read():\n    pass\n",
    "low/twin.py": "def imported():\n    pass\n",
    "top.py": """
from dmpcli.low import a, whole
from dmpcli.low.a import imported
KINDS = (whole,)
def go(one):
    a.given()
    one.asked()
    imported()
    return KINDS, a.Heard
go(None)
""",
}


def test_what_nothing_uses_is_found_by_its_module_and_what_is_used_is_not(tmp_path):
    root = tmp_path / "dmpcli"
    for name, text in FILES.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    found = [name for name, _ in unreached.Package(root).unreached()]
    assert found == [
        "dmpcli._HOMES",
        "dmpcli.low.a.LEFT",
        "dmpcli.low.a.calls_itself",
        "dmpcli.low.a.Base.overridden",
        "dmpcli.low.twin.imported",
    ]


@pytest.mark.thorough
def test_nothing_of_the_package_is_unreached():
    package = unreached.Package(unreached.ROOT)
    found = {name for name, _ in package.unreached()}
    assert found - unreached.known() == set()
    assert set(unreached.CALLED_BY_OTHERS) <= found

"""Importers take a damaged file or refuse it: no traceback, no hang.

benchmarks/mutated_imports.py has 20,000 of each.
"""

import pytest

from dmpcli.extras import ROS, SVG
from tests.extras_here import needs
from tests.formats.importers import FOLDERS, IMPORTERS
from tests.formats.mutations import survived

pytestmark = [
    pytest.mark.slow,
    needs(ROS),
    needs(SVG),
    # A quaternion or a number that mutation made huge overflows on its way to being refused.
    pytest.mark.filterwarnings("ignore::RuntimeWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.mark.parametrize("name", IMPORTERS)
def test_damaged_bytes_are_read_or_refused(name):
    read, content = IMPORTERS[name]
    read(content)
    taken, refused = survived(read, content, 80, seed=1)
    assert taken + refused == 80
    assert refused > 5


@pytest.mark.parametrize("name", FOLDERS)
def test_damaged_files_of_folders_are_read_or_refused(tmp_path, name):
    make, which = FOLDERS[name]
    read, content = make(tmp_path, which)
    taken, refused = survived(read, content, 40, seed=1)
    assert taken + refused == 40
    assert refused > 3

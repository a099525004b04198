"""Importers take a damaged file or refuse it: no traceback, no warning, no hang.

`python -m benchmarks.mutations importers` tries thousands of each.
"""

import warnings

import pytest

from benchmarks.mutations.importers import MAKES
from benchmarks.mutations.worker import Asked, run
from dmpcli.extras import ROS, SVG
from tests.extras_here import needs

pytestmark = [pytest.mark.slow, needs(ROS), needs(SVG)]
COUNT = 60


@pytest.mark.sweep(kept=5)
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", MAKES)
def test_damaged_bytes_are_read_or_refused(tmp_path, name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        reader = MAKES[name](tmp_path)
    found = run(reader, Asked(COUNT, seed=1))
    assert found.held == []
    assert found.read + found.refused == COUNT
    assert min(found.read, found.refused) > 0

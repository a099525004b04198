"""Programs of others that judge our files: ``make judges`` brings them and runs these tests.

Each takes long to install beside what the tests need: evo brings seaborn and its kin, pymeshlab
MeshLab itself, lerobot-doctor the hub's client. `make test` passes over a test that needs one, with
its name; `make judges` passes over none.
"""

import importlib.util
import os

import pytest


def judge(module: str, package: str) -> pytest.MarkDecorator:
    """Pass over a test where a judge is not installed and need not be, and say which one."""
    absent = importlib.util.find_spec(module) is None and not os.environ.get("DMPCLI_JUDGES")
    return pytest.mark.skipif(absent, reason=f"outside judge {package} is not installed")

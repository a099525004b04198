"""Programs of others that judge our files where they are installed; the set-up brings none.

Each takes long to install beside what the tests need: evo brings seaborn and its kin, pymeshlab
MeshLab itself, lerobot-doctor the hub's client. A test that needs one is passed over with its name.
"""

import importlib.util

import pytest


def judge(module: str, package: str) -> pytest.MarkDecorator:
    """Pass over a test where a judge is not installed, and say which one."""
    absent = importlib.util.find_spec(module) is None
    return pytest.mark.skipif(absent, reason=f"outside judge {package} is not installed")

"""A mark for tests that need an extra: passed over only where it has no wheel."""

import importlib.metadata
import importlib.util

import pytest

from dmpcli import extras

MODULES = {
    "ur": "rtde_receive",
    "dask": "distributed",
    "svg": "svgelements",
    "ros": "rosbags",
    "bench": "mujoco",
    "menagerie": "mujoco_menagerie",
    "view": "k3d",
    "fast": "numba",
}


def needs(extra: extras.Extra) -> pytest.MarkDecorator:
    """Pass over tests where an extra can't be had; where it can and is absent, they fail."""
    there = importlib.util.find_spec(MODULES[extra.name]) is not None
    absent = not there and not extra.has_wheel(*extras.here())
    reason = f"{extra.packages[0]} has no wheel for {extras.python_here()}"
    return pytest.mark.skipif(absent, reason=reason)

"""Settings of all tests."""

import functools

import typer.testing
from hypothesis import settings

# The machine may be busy: no test of ours asserts a time, and neither shall hypothesis.
settings.register_profile("dmpcli", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("dmpcli")

# Typer's runner builds all commands anew for each call, which takes longer than most calls do.
typer.testing._get_command = functools.cache(typer.testing._get_command)

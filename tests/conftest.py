"""Settings of all tests."""

from hypothesis import settings

# The machine may be busy: no test of ours asserts a time, and neither shall hypothesis.
settings.register_profile("dmpcli", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("dmpcli")

"""Mutants of the package, and which tests tell them: see `python -m tools.mutants --help`."""

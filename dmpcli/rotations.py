"""Deprecated: where version 0.1 had `dmpcli.spatial.rotations`; import from there."""

from dmpcli.moved import names_of

__getattr__ = names_of("dmpcli.rotations", "dmpcli.spatial.rotations")

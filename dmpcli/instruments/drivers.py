"""Deprecated: where version 0.1 had `dmpcli.instruments.driver_protocol`; import from there."""

import warnings

from dmpcli.instruments.driver_protocol import *  # noqa: F403
from dmpcli.instruments.driver_protocol import DriverInfo as Declaration  # noqa: F401

warnings.warn(
    "dmpcli.instruments.drivers is dmpcli.instruments.driver_protocol now, and its Declaration "
    "DriverInfo; the old names will go",
    DeprecationWarning,
    stacklevel=2,
)

"""Deprecated: where version 0.1 had `dmpcli.instruments.driver_protocol`; import from there."""

import warnings

from dmpcli.instruments.driver_protocol import (
    AngleUnit,
    DriverInfo,
    DriverState,
    HaltingDriver,
    InverseDriver,
    LengthUnit,
    Orientation,
    PlanDriver,
    ServoDriver,
    Space,
)

__all__ = [
    "AngleUnit",
    "Declaration",
    "DriverState",
    "HaltingDriver",
    "InverseDriver",
    "LengthUnit",
    "Orientation",
    "PlanDriver",
    "ServoDriver",
    "Space",
]

Declaration = DriverInfo

warnings.warn(
    "dmpcli.instruments.drivers is dmpcli.instruments.driver_protocol now, and its Declaration "
    "DriverInfo; the old names will go",
    DeprecationWarning,
    stacklevel=2,
)

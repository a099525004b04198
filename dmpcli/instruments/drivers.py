"""Deprecated: where version 0.1 had `dmpcli.instruments.driver_protocol`; import from there."""

from typing import Literal

from dmpcli.moved import names_of

Pacing = Literal["client", "controller"]
"""What a driver had to declare, and nobody reads any more."""

__getattr__ = names_of(
    "dmpcli.instruments.drivers",
    "dmpcli.instruments.driver_protocol",
    {"Declaration": "DriverInfo"},
)

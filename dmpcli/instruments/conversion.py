"""Deprecated: where version 0.1 had `dmpcli.instruments.servo_adapter`; import from there."""

from dmpcli.moved import names_of

__getattr__ = names_of("dmpcli.instruments.conversion", "dmpcli.instruments.servo_adapter")

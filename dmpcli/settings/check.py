"""The options of ``check``."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le

from dmpcli.settings.model import Option, Settings


@dataclass(frozen=True, kw_only=True)
class CheckSettings(Settings):
    """How long the instruments are read, and how often."""

    seconds: Annotated[float, Ge(0.1), Le(60), Option("How long to read.", "s")] = 1.0
    sensor_rate: Annotated[
        float, Ge(1), Le(7000), Option("Readings of the sensor per second.", "Hz")
    ] = 100.0

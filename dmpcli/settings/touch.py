"""The options of ``touch``."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Gt, Le

from dmpcli.settings.model import Option, Settings


@dataclass(frozen=True, kw_only=True)
class TouchOptions(Settings):
    """When points are taken, and how many."""

    every: Annotated[
        float | None,
        Gt(0),
        Le(3600),
        Option("Take a point in even times, not at Enter.", "s", unset="at Enter"),
    ] = None
    count: Annotated[
        int | None, Ge(1), Le(100_000), Option("End after so many points.", unset="at q")
    ] = None

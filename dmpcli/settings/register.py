"""The options of ``register``."""

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Gt

from dmpcli.settings.model import Option, Settings
from dmpcli.settings.recording import LENGTHS


@dataclass(frozen=True, kw_only=True)
class RegisterOptions(Settings):
    """Where to search, in which unit, and how sure to be."""

    guess: Annotated[
        Literal["near", "none"],
        Option("Search near the rough pose, or with none in all orientations."),
    ] = "near"
    unit: Annotated[
        str, Option("Of the part's file and of px py pz.", metavar="UNIT", choices=LENGTHS)
    ] = "mm"
    max_residual: Annotated[
        float, Gt(0), Option("Largest distance of a touched point from the part.", "mm")
    ] = 1.0
    max_error: Annotated[
        float,
        Gt(0),
        Option("Largest error left at any point of the part, with 95 %.", "mm"),
    ] = 1.5

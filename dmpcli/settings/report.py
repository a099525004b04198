"""The options of ``report`` that are no files."""

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Le

from dmpcli.settings.model import Option, Settings


@dataclass(frozen=True, kw_only=True)
class ReportOptions(Settings):
    """How large batches are measured."""

    jobs: Annotated[int, Ge(1), Le(1024), Option("Processes that measure large batches.")] = 1
    kernels: Annotated[
        Literal["auto", "compiled", "pure"],
        Option("Measure by compiled kernels, or numpy; auto: large batches, if they are here."),
    ] = "auto"

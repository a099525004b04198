"""The settings of ``fit``, with the ranges that make sense."""

from typing import Annotated

from pydantic import Field

from dmpcli.primitives.phase import WidthRule
from dmpcli.primitives.preparation import Choices
from dmpcli.primitives.regression import Method
from dmpcli.primitives.skill import ForcingScale, Model
from dmpcli.records.settings import Settings

Positive = Annotated[float, Field(gt=0)]


class FitSettings(Settings):
    """How to learn; see `Choices` for what each means."""

    model: Model = "modified"
    forcing_scale: ForcingScale = "axis"
    regression: Method = "lwr"
    basis: Annotated[int, Field(ge=1, le=10_000)] = 80
    damping: Positive = 20.0
    tau: Positive = 0.5
    alpha_1: Positive = 1.0
    widths: WidthRule = "spacing"
    cutoff: Positive | None = None
    trim: bool = True

    def choices(self) -> Choices:
        """Return the settings as the mathematics takes them."""
        return Choices(**self.model_dump())

"""The settings of ``fit``, with the ranges that make sense."""

from typing import Annotated

from pydantic import Field, model_validator

from dmpcli.primitives.phase import WidthRule
from dmpcli.primitives.preparation import Choices
from dmpcli.primitives.regression import Method
from dmpcli.primitives.skill import ForcingScale, Model
from dmpcli.records.settings import Settings


class FitSettings(Settings):
    """How to learn; see `Choices` for what each means."""

    model: Model = "modified"
    forcing_scale: ForcingScale = "axis"
    regression: Method = "lwr"
    basis: Annotated[int, Field(ge=1, le=1000)] = 80
    damping: Annotated[float, Field(ge=0.01, le=1000)] = 20.0
    tau: Annotated[float, Field(ge=0.01, le=100)] = 0.5
    alpha_1: Annotated[float, Field(ge=0.01, le=100)] = 1.0
    widths: WidthRule = "spacing"
    cutoff: Annotated[float, Field(ge=0.01, le=100_000)] | None = None
    trim: bool = True

    @model_validator(mode="after")
    def _phase_lasts(self) -> "FitSettings":
        if not 0.01 <= self.alpha_1 / self.tau <= 20.0:
            raise ValueError(
                f"alpha_1 / tau = {self.alpha_1 / self.tau:g}: must lie between 0.01 and 20, since "
                "the phase ends at exp(-alpha_1 / tau)"
            )
        return self

    def choices(self) -> Choices:
        """Return the settings as the mathematics takes them."""
        return Choices(**self.model_dump())

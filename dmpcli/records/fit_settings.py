"""The settings of ``fit``, with the ranges that make sense."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from dmpcli.primitives.basis_search import MOST
from dmpcli.primitives.choices import Align, Choices
from dmpcli.primitives.phase import WidthRule
from dmpcli.primitives.regression import Method
from dmpcli.primitives.skill import ForcingScale, Learning, Model
from dmpcli.records.settings import Settings


class FitSettings(Settings):
    """How to learn; see `Choices` for what each means."""

    model: Model = "modified"
    forcing_scale: ForcingScale = "axis"
    regression: Method = "lwr"
    learning: Learning = "tolerance"
    basis: Annotated[int, Field(ge=1, le=MOST)] | Literal["auto"] = "auto"
    tolerance: Annotated[float, Field(gt=0, le=1000)] | None = None
    passes: Annotated[int, Field(ge=1, le=10)] | None = None
    align: Align = "path"
    normal: tuple[float, float, float] | None = None
    damping: Annotated[float, Field(ge=0.01, le=1000)] = 20.0
    tau: Annotated[float, Field(ge=0.01, le=100)] = 0.5
    alpha_1: Annotated[float, Field(ge=0.01, le=100)] = 1.0
    widths: WidthRule = "spacing"
    cutoff: Annotated[float, Field(ge=0.01, le=100_000)] | None = None
    trim: bool = True
    start: Annotated[float, Field(ge=0)] | None = None
    until: Annotated[float, Field(gt=0)] | None = None
    cut_pauses: bool = False

    @model_validator(mode="after")
    def _phase_lasts(self) -> "FitSettings":
        if not 0.01 <= self.alpha_1 / self.tau <= 20.0:
            raise ValueError(
                f"alpha_1 / tau = {self.alpha_1 / self.tau:g}: must lie between 0.01 and 20, since "
                "the phase ends at exp(-alpha_1 / tau)"
            )
        return self

    @model_validator(mode="after")
    def _points_somewhere(self) -> "FitSettings":
        if self.normal is not None and not any(self.normal):
            raise ValueError("normal is zero; it must point off the plane, to the tool's side")
        return self

    @model_validator(mode="after")
    def _some_is_left(self) -> "FitSettings":
        if self.start is not None and self.until is not None and self.until <= self.start:
            raise ValueError(f"until {self.until:g} s is not after from {self.start:g} s")
        return self

    def choices(self) -> Choices:
        """Return the settings as the mathematics takes them."""
        said = self.model_dump()
        if said["basis"] == "auto":
            said["basis"] = None
        return Choices(**said)

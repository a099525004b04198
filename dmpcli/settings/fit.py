"""The settings of ``fit``, with the ranges that make sense."""

from dataclasses import asdict, dataclass
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Ge, Gt, Le

from dmpcli.dmp.options import (
    MOST,
    PAPER_BASIS,
    TOLERANCE,
    TOLERANCE_SHARE,
    Align,
    FitOptions,
    ForcingScale,
    Learning,
    Method,
    Model,
    WidthRule,
)
from dmpcli.settings.model import Option, Settings
from dmpcli.settings.ranges import XYZ

_FORCE = "force_profile"


class Count:
    """Of N: what is said of words that are neither ``auto`` nor a number."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Check the word before the type is."""
        from pydantic_core import core_schema

        return core_schema.no_info_before_validator_function(_count, handler(source))


def _count(value: Any) -> Any:
    if value == "auto" or not isinstance(value, str):
        return value
    try:
        return int(value)
    except ValueError:
        raise ValueError("must be auto, or a number of functions") from None


@dataclass(frozen=True, kw_only=True)
class FitSettings(Settings):
    """How to learn; see `FitOptions` for what each means, and for the defaults."""

    section: ClassVar[str] = "fit"
    preset: ClassVar[str | None] = "default"

    model: Annotated[Model, Option("By eq. (9)-(11), or by eq. (4)-(8).")] = FitOptions.model
    forcing_scale: Annotated[
        ForcingScale,
        Option("Original model: scale by (g - x0) per axis, or by the start-goal distance."),
    ] = FitOptions.forcing_scale
    regression: Annotated[Method, Option("How the weights are found.")] = FitOptions.regression
    learning: Learning = FitOptions.learning
    basis: Annotated[
        Annotated[int, Ge(1), Le(MOST)] | Literal["auto"],
        Count(),
        Option(f"Number of Gaussian functions; auto: {PAPER_BASIS}, or as the tolerance asks."),
    ] = "auto"
    tolerance: Annotated[
        float | None,
        Gt(0),
        Le(1000),
        Option(
            "RMS deviation to keep.",
            "mm",
            unset=f"{TOLERANCE:g}, or {100 * TOLERANCE_SHARE:g} % of the stroke's diagonal",
        ),
    ] = FitOptions.tolerance
    passes: Annotated[int | None, Ge(1), Le(10)] = FitOptions.passes
    align: Annotated[
        Align, Option("How several demonstrations are laid on one another: by path, by time.")
    ] = FitOptions.align
    normal: Annotated[
        tuple[float, float, float] | None,
        Option("Normal of the plane it was taught on, to the tool.", metavar=XYZ, unset="fitted"),
    ] = FitOptions.normal
    damping: Annotated[float, Ge(0.01), Le(1000), Option("d; k = d²/4.")] = FitOptions.damping
    tau: Annotated[
        float, Ge(0.01), Le(100), Option("Time constant in units of the stroke's duration.")
    ] = FitOptions.tau
    alpha_1: Annotated[float, Ge(0.01), Le(100), Option("Phase constant.")] = FitOptions.alpha_1
    widths: Annotated[WidthRule, Option("Width rule of the Gaussians.")] = FitOptions.widths
    cutoff: Annotated[
        float | None,
        Ge(0.01),
        Le(100_000),
        Option("Low-pass before learning.", "Hz", unset="by the recording's noise"),
    ] = FitOptions.cutoff
    trim: Annotated[bool, Option("Cut off idle ends.")] = FitOptions.trim
    start: Annotated[
        float | None,
        Ge(0),
        Option("Learn the recording from here on.", "s", flag="--from", unset="its beginning"),
    ] = FitOptions.start
    until: Annotated[
        float | None, Gt(0), Option("Learn the recording up to here.", "s", unset="its end")
    ] = FitOptions.until
    cut_pauses: Annotated[bool, Option("Take pauses out.")] = FitOptions.cut_pauses
    force_profile: Annotated[
        bool, Option("Learn the force along the normal too, of a recording in contact.")
    ] = FitOptions.force_profile

    def __post_init__(self) -> None:
        """Refuse settings that fit their ranges but not each other."""
        if not 0.01 <= self.alpha_1 / self.tau <= 20.0:
            raise ValueError(
                f"alpha_1 / tau = {self.alpha_1 / self.tau:g}: must lie between 0.01 and 20, since "
                "the phase ends at exp(-alpha_1 / tau)"
            )
        if self.normal is not None and not any(self.normal):
            raise ValueError("normal is zero; it must point off the plane, to the tool's side")
        if self.start is not None and self.until is not None and self.until <= self.start:
            raise ValueError(f"until {self.until:g} s is not after from {self.start:g} s")

    def as_options(self) -> dict[str, Any]:
        """Return the settings as JSON values; a force that nobody asked for leaves no trace."""
        said = super().as_options()
        return said if self.force_profile else {k: v for k, v in said.items() if k != _FORCE}

    def choices(self) -> FitOptions:
        """Return the settings as the mathematics takes them."""
        return FitOptions(**asdict(self) | {"basis": None if self.basis == "auto" else self.basis})

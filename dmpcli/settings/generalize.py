"""The settings of ``generalize``, with the ranges that make sense."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from annotated_types import Ge, Gt, Le

from dmpcli.dmp.options import Amplitude, Kernels, OnBorder, Orientation
from dmpcli.settings.model import Option, Settings
from dmpcli.settings.process import ProcessSettings

if TYPE_CHECKING:
    from dmpcli.dmp.drawn_strokes import GeneralizeOptions

_FORCE = "force_setpoint"

NotNegative = Annotated[float, Ge(0), Le(86_400)]


@dataclass(frozen=True, kw_only=True)
class GeneralizeSettings(ProcessSettings):
    """How to draw a skill at new pairs; what a process asks for beside is in `ProcessSettings`.

    Of amplitude and orientation see `roll_out`, of contact and offset `contact_heights`.
    """

    section: ClassVar[str] = "generalize"

    duration: Annotated[
        float | None,
        Ge(0.001),
        Le(86_400),
        Option("Of the stroke without easing.", "s", unset="as demonstrated"),
    ] = None
    rate: Annotated[float, Ge(0.001), Le(10_000), Option("Samples per second.", "Hz")] = 50.0
    amplitude: Annotated[
        Amplitude, Option("Keep the wave height, or scale it with the distance.")
    ] = "keep"
    orientation: Annotated[
        Orientation, Option("Keep the tool's turn in base axes, or turn with the surface.")
    ] = "keep"
    ease_in: Annotated[NotNegative, Option("Soft start.", "s")] = 0.0
    ease_out: Annotated[NotNegative, Option("Soft end.", "s")] = 0.0
    snap_tol: Annotated[
        NotNegative, Option("How far start and goal may lie off the surface.", "mm")
    ] = 1.0
    contact: Annotated[
        NotNegative | None,
        Option(
            "How near to the surface the pen touches; drawn on it, deeper is refused.",
            "mm",
            unset="1",
        ),
    ] = None
    offset: Annotated[
        float,
        Ge(-1000),
        Le(1000),
        Option("Off the surface: stand-off, or negative, engraving.", "mm"),
    ] = 0.0
    scale: Annotated[float, Ge(0.001), Le(1000), Option("Size of a closed stroke.")] = 1.0
    turn: Annotated[
        float, Ge(-360), Le(360), Option("Turn of a closed stroke about the normal.", "°")
    ] = 0.0
    force_setpoint: Annotated[
        float | None,
        Gt(0),
        Le(1e4),
        Option("Force to press with in contact, 0 where the pen is lifted.", "N", unset="none"),
    ] = None
    allow_stretch: Annotated[
        bool, Option("Start and goal at any distance, however it distorts.")
    ] = False
    kernels: Annotated[
        Kernels,
        Option("Draw with compiled kernels, or with numpy; auto: large tables, if they are here."),
    ] = "auto"

    def as_options(self) -> dict[str, Any]:
        """Return the settings as JSON values.

        A force that nobody asked for leaves no trace, nor do kernels that nothing is drawn with.
        """
        absent = set() if self.force_setpoint else {_FORCE}
        absent |= set() if self.compiled else {"kernels"}
        return {k: v for k, v in super().as_options().items() if k not in absent}

    @property
    def compiled(self) -> bool:
        """Whether strokes are drawn by compiled kernels; `auto` has to be decided by then."""
        return self.kernels == "compiled"

    def style(self) -> "GeneralizeOptions":
        """Return the settings as the mathematics takes them; heights are for the skill to tell."""
        from dmpcli.dmp.drawn_strokes import GeneralizeOptions

        return GeneralizeOptions(
            self.rate,
            self.amplitude,
            self.orientation,
            self.ease_in,
            self.ease_out,
            size=self.scale,
            turn=math.radians(self.turn),
            allow_stretch=self.allow_stretch,
            force=self.force_setpoint,
            compiled=self.compiled,
        )


@dataclass(frozen=True, kw_only=True)
class PlaceOptions(Settings):
    """Where the strokes lie: what only the command line says."""

    in_: Annotated[
        Literal["base", "part"],
        Option("Axes of start, goal and pairs: the base's, or the surface's own.", flag="--in"),
    ] = "base"
    on_border: Annotated[
        OnBorder,
        Option("A stroke that leaves the surface: refuse it, clip it there, skip or split it."),
    ] = "fail"

"""What one may choose of how a skill is learned and drawn, and how it is learned by default.

Nothing else is loaded here: the command line completes and explains these words.
"""

from dataclasses import dataclass
from typing import Literal

Model = Literal["modified", "original"]
Learning = Literal["tolerance", "paper"]
ForcingScale = Literal["axis", "distance"]
Method = Literal["lwr", "ridge"]
WidthRule = Literal["spacing", "power"]
Align = Literal["none", "time", "path"]
Amplitude = Literal["keep", "scale"]
Orientation = Literal["keep", "surface"]
Kernels = Literal["auto", "compiled", "pure"]
Means = Literal["compiled", "pure"]
OnBorder = Literal["fail", "clip", "skip", "split"]

MOST = 2000
"""Largest N."""

ACCELERATION = 1000.0
"""Default of a tool's largest acceleration, mm/s²: less than half of what `execute` lets an arm
have."""

CONDITION = 10.0
"""Condition number above which a set of poses is refused; 12 well spread ones have about 2."""

TOLERANCE = 0.1
"""Largest RMS deviation of a skill from what was demonstrated, mm ..."""

TOLERANCE_SHARE = 0.002
"""... and as a share of the diagonal of the stroke's bounding box; the smaller one counts."""

LARGEST = 4.0
"""Largest deviation anywhere, in tolerances."""

PAPER_BASIS = 80
"""N of the paper."""


@dataclass(frozen=True)
class FitOptions:
    """How to learn; the presets name these.

    Attributes
    ----------
    model, forcing_scale, regression
        See `Skill` and `regression`.
    basis : int or None
        N; None takes as many as the tolerance asks for (the paper's learning: 80).
    damping : float
        d; k = d²/4.
    tau : float
        In units of the demonstration's duration.
    alpha_1 : float
    widths : {'spacing', 'power'}
    cutoff : float or None
        Low-pass, Hz; None takes the highest frequency that the basis can carry, N / (2 T_d).
    trim : bool
        Whether idle ends are cut off.
    learning : {'tolerance', 'paper'}
        By a tolerance; or as the paper has it, which also serves the original model: one pass, N,
        a low-pass at N / (2 T_d), the best-fitting plane, and ends as they come.
    tolerance : float or None
        mm; None takes the smaller of `TOLERANCE` and `TOLERANCE_SHARE` of the stroke's diagonal.
    passes : int or None
        Of LWR; None takes as few as the tolerance asks for.
    align : {'none', 'time', 'path'}
        How several demonstrations are laid upon each other; see `alignment`.
    normal : tuple of float, or None
        Normal of the plane of demonstration, on the tool's side.
    start, until : float or None
        Part of the recordings to learn, s from their beginning.
    cut_pauses : bool
        Whether pauses are taken out.
    force_profile : bool
        Whether the force along the normal is learned too.
    """

    model: Model = "modified"
    forcing_scale: ForcingScale = "axis"
    regression: Method = "lwr"
    basis: int | None = None
    damping: float = 20.0
    tau: float = 0.5
    alpha_1: float = 1.0
    widths: WidthRule = "spacing"
    cutoff: float | None = None
    trim: bool = True
    learning: Learning = "tolerance"
    tolerance: float | None = None
    passes: int | None = None
    align: Align = "path"
    normal: tuple[float, float, float] | None = None
    start: float | None = None
    until: float | None = None
    cut_pauses: bool = False
    force_profile: bool = False

    @property
    def as_paper(self) -> bool:
        """Whether the demonstrations are learned as the paper has it."""
        return self.learning == "paper" or self.model == "original"

"""What learning gives: the skill, and how well it gives back what was demonstrated."""

from dataclasses import dataclass

from dmpcli.arrays import Floats
from dmpcli.dmp.alignment import Alignment
from dmpcli.dmp.paper_preprocessing import Prepared
from dmpcli.dmp.skill import Skill
from dmpcli.dmp.stroke_plane import StrokePlane


@dataclass(frozen=True)
class ReproductionMeasures:
    """A demonstration beside what the skill makes of it.

    Attributes
    ----------
    demonstrated, reproduced : array, shape (T, 3)
        Chart coordinates u, v, w, mm.
    rms, largest : float
        Of the paper's learning, the deviation at equal times from the smoothed demonstration; else
        the distance of the recording's samples to the nearest point of the reproduction, beyond
        what their noise explains. mm.
    end : float
        Deviation at the last sample, mm.
    wave : tuple of float, or None
        Wave height across the start-goal line, demonstrated and reproduced, mm.
    angle : float
        Largest deviation of the tool's orientation at equal times, rad.
    """

    demonstrated: Floats
    reproduced: Floats
    rms: float
    largest: float
    end: float
    wave: tuple[float, float] | None = None
    angle: float = 0.0


@dataclass(frozen=True)
class Fit:
    """A skill, and how well it gives back each demonstration.

    Attributes
    ----------
    skill : Skill
    prepared : list of Prepared
        The demonstrations as they were learned from.
    reproductions : list of ReproductionMeasures
    plane : StrokePlane or None
        How the plane was found; None where a surface was named, and for the paper's learning.
    alignment : Alignment or None
        How several demonstrations were laid upon each other.
    alternative : tuple of (int, float), or None
        Where LWR misses the tolerance: N and RMS, mm, that ridge regression reaches.
    lost : float
        RMS that smoothing took off the recordings beyond their noise, mm.
    """

    skill: Skill
    prepared: list[Prepared]
    reproductions: list[ReproductionMeasures]
    plane: StrokePlane | None = None
    alignment: Alignment | None = None
    alternative: tuple[int, float] | None = None
    lost: float = 0.0

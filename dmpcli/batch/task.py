"""What is drawn, where and how: the part of a job that mathematics needs."""

from dataclasses import dataclass

from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.skill import Skill
from dmpcli.kinematics.reachability import Reach
from dmpcli.spatial.output_events import AskedEvent
from dmpcli.surfaces.surface import Surface


@dataclass(frozen=True)
class Task:
    """What to draw, where and how.

    Attributes
    ----------
    skill : Skill
    surface : Surface or None
    style : GeneralizeOptions
    reach : Reach, optional
        The arm that is to draw, which must be able to follow.
    events : tuple of AskedEvent
        What is switched along each stroke.
    """

    skill: Skill
    surface: Surface | None
    style: GeneralizeOptions
    reach: Reach | None = None
    events: tuple[AskedEvent, ...] = ()

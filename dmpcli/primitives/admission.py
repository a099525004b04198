"""Which pairs a skill can be carried to, before anything is rolled out."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.primitives.drawing import Style
from dmpcli.primitives.generalization import Pairs
from dmpcli.primitives.skill import Skill
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.protocol import Surface

# Start and goal of an open stroke this near to each other have no direction, mm.
COINCIDENT = 1e-6
# Cosine beyond which a start-goal line stands upright on the plane.
UPRIGHT = 1.0 - 1e-6
# Samples of one trajectory: more than two hours at 100 Hz.
MOST_SAMPLES = 1_000_000


@dataclass(frozen=True)
class Admission:
    """What stands against each pair; the masks have shape (B,).

    Attributes
    ----------
    coincident : array of bool
        An open stroke's start and goal are one point.
    far : array of bool
        Start or goal is further from the given surface than the tolerance.
    upright : array of bool
        The start-goal line stands upright on the plane, so that no chart follows.
    short : array of bool
        The stroke is too short for the soft start and end.
    endless : array of bool
        The trajectory would have more than `MOST_SAMPLES` samples.
    distance : array, shape (B,)
        The larger distance of start and goal from the given surface, mm; 0 without one.
    """

    coincident: Booleans
    far: Booleans
    upright: Booleans
    short: Booleans
    endless: Booleans
    distance: Floats

    @property
    def admitted(self) -> Booleans:
        """Pairs that nothing stands against."""
        return ~(self.coincident | self.far | self.upright | self.short | self.endless)


def admit(
    skill: Skill,
    pairs: Pairs,
    duration: Floats,
    style: Style,
    given: Surface | None,
    tolerance: float,
) -> Admission:
    """Check pairs against a skill and, where there is one, the surface to draw on.

    Parameters
    ----------
    skill : Skill
    pairs : Pairs
        B pairs of finite coordinates.
    duration : array, shape (B,)
        Of each stroke without easing, s.
    style : Style
    given : Surface, optional
    tolerance : float
        Largest distance from the surface, mm.

    Returns
    -------
    Admission
    """
    difference = pairs.goal - pairs.start
    length = np.linalg.norm(difference, axis=1)
    coincident = np.zeros(len(pairs), dtype=bool) if skill.closed else length < COINCIDENT
    distance = np.zeros(len(pairs))
    if given is not None:
        ends = (given.closest(pairs.start).distance, given.closest(pairs.goal).distance)
        distance = np.maximum(*ends)
    upright = np.zeros(len(pairs), dtype=bool)
    # Only planes can be missed: on a curved surface the geodesic tells the direction.
    flat = given is None or isinstance(given, Plane)
    if flat and not skill.closed and skill.model == "modified":
        normal = given.normal if isinstance(given, Plane) else skill.frame.normal
        along = np.abs(difference @ normal) / np.where(coincident, 1.0, length)
        upright = ~coincident & (along > UPRIGHT)
    short = 2.0 * duration < style.ease_in + style.ease_out
    endless = (duration + 0.5 * (style.ease_in + style.ease_out)) * style.rate > MOST_SAMPLES
    return Admission(coincident, distance > tolerance, upright, short, endless, distance)


def snapped(pairs: Pairs, given: Surface) -> Pairs:
    """Return the pairs with start and goal moved to their closest points of the surface."""
    start, goal = given.closest(pairs.start).position, given.closest(pairs.goal).position
    return Pairs(start, goal, pairs.start_rotation, pairs.goal_rotation)


def tool_axis(skill: Skill, pairs: Pairs) -> Floats | None:
    """Unit vector along the tool into the work, R e_z: the one asked for, else the demonstrated.

    Returns
    -------
    array, shape (3,), or None
        The mean over the pairs' starts where they ask for orientations; None without any.
    """
    if pairs.start_rotation is not None and len(pairs):
        axis = pairs.start_rotation[:, :, 2].mean(axis=0)
        length = np.linalg.norm(axis)
        return axis / length if length > 0 else None
    R = skill.frame.rotation
    return None if R is None else R[:, 2]

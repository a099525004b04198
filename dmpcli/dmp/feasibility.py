"""Which pairs a skill can be carried to, before anything is rolled out."""

from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.dmp.contact_heights import demonstrated_scale
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.sides import turned_over
from dmpcli.dmp.skill import Skill
from dmpcli.surfaces.plane import Plane, extent
from dmpcli.surfaces.surface import Surface

# Start and goal of an open stroke this near to each other have no direction, mm.
COINCIDENT = 1e-6
# Cosine beyond which a start-goal line stands upright on the plane.
UPRIGHT = 1.0 - 1e-6
# A start-goal distance below this part of the stroke's extent is rather a gap ...
NEARLY_CLOSED = 0.25
# ... whose stretch by this much or more makes another stroke of it.
MOST_NEARLY_CLOSED = 2.0
# A closed stroke's gap counts as this part of its extent at least.
CLOSED_GAP = 0.02
# Of other strokes a stretch by this is told, and by this it is likely another unit.
LONG_STRETCH = 3.0
MOST_STRETCH = 20.0
_SAMPLES = 400
# Samples of one trajectory: more than two hours at 100 Hz.
MOST_SAMPLES = 1_000_000


@dataclass(frozen=True)
class Feasibility:
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
    deep : array of bool
        The stroke would dig into the named surface.
    stretched : array of bool
        The stroke would be stretched beyond all likeness, and that was not asked for.
    off : array, shape (B, 2)
        Distances of start and goal from the given surface, mm; 0 without one.
    depth : array, shape (B,)
        How far the stroke would go into the named surface, mm.
    stretch : array, shape (B,)
        Start-goal distance by the demonstrated one.
    """

    coincident: Booleans
    far: Booleans
    upright: Booleans
    short: Booleans
    endless: Booleans
    deep: Booleans
    stretched: Booleans
    off: Floats
    depth: Floats
    stretch: Floats

    @property
    def distance(self) -> Floats:
        """The larger distance of start and goal from the given surface, mm, shape (B,)."""
        return np.asarray(self.off.max(axis=1, initial=0.0))

    @property
    def admitted(self) -> Booleans:
        """Pairs that nothing stands against."""
        against = self.coincident | self.far | self.upright | self.short | self.endless
        return ~(against | self.deep | self.stretched)


def admit(
    skill: Skill,
    pairs: Pairs,
    duration: Floats,
    style: GeneralizeOptions,
    given: Surface | None,
    tolerance: float,
) -> Feasibility:
    """Check pairs against a skill and, where there is one, the surface to draw on.

    Parameters
    ----------
    skill : Skill
    pairs : Pairs
        B pairs of finite coordinates.
    duration : array, shape (B,)
        Of each stroke without easing, s.
    style : GeneralizeOptions
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
    off = np.zeros((len(pairs), 2))
    if given is not None:
        ends = (given.closest(pairs.start).distance, given.closest(pairs.goal).distance)
        off = np.stack(ends, axis=1)
    upright = np.zeros(len(pairs), dtype=bool)
    # Only planes can be missed: on a curved surface the geodesic tells the direction.
    flat = given is None or isinstance(given, Plane)
    if flat and not skill.closed and skill.model == "modified":
        normal = given.normal if isinstance(given, Plane) else skill.frame.normal
        along = np.abs(difference @ normal) / np.where(coincident, 1.0, length)
        upright = ~coincident & (along > UPRIGHT)
    short = 2.0 * duration < style.ease_in + style.ease_out
    endless = (duration + 0.5 * (style.ease_in + style.ease_out)) * style.rate > MOST_SAMPLES
    depth, deep = np.zeros(len(pairs)), np.zeros(len(pairs), dtype=bool)
    if given is not None:
        over = turned_over(skill, pairs, given)
        for heights, rows in ((style.heights, ~over), (style.heights_over, over)):
            if heights is not None:
                depth[rows], deep[rows] = heights.depth, heights.deep
    stretch, most = np.ones(len(pairs)), most_stretch(skill)
    if skill.model == "modified":
        stretch = length / (style.size * _gap(skill) if skill.closed else skill.goal[0])
    stretched = (stretch >= most) | (not skill.closed and stretch <= 1.0 / most)
    stretched &= ~coincident & (not style.allow_stretch)
    return Feasibility(
        coincident,
        off.max(axis=1, initial=0.0) > tolerance,
        upright,
        short,
        endless,
        deep,
        stretched,
        off,
        depth,
        stretch,
    )


def nearly_closed(skill: Skill) -> bool:
    """Tell a stroke whose ends are so near to each other that their distance tells little."""
    if skill.learning != "tolerance":
        return False
    return skill.closed or float(skill.goal[0]) < NEARLY_CLOSED * _extent(skill)


def sideways(skill: Skill) -> float:
    """How far the demonstrated stroke leads away from the line from its start to its goal, mm.

    Of a closed one: from its start.
    """
    t = np.linspace(0.0, skill.duration, _SAMPLES)
    off = np.abs(demonstrated_scale(skill, t)[:, :2])
    return float(np.hypot(*off.T).max() if skill.closed else off[:, 1].max())


def _extent(skill: Skill) -> float:
    return extent(demonstrated_scale(skill, np.linspace(0.0, skill.duration, _SAMPLES))[:, :3])


def _gap(skill: Skill) -> float:
    """Distance of a closed stroke's ends that start and goal are held against, mm."""
    return max(float(np.linalg.norm(skill.goal[:3])), CLOSED_GAP * _extent(skill))


def most_stretch(skill: Skill) -> float:
    """Stretch from which on a pair is refused unless it is asked for."""
    if skill.learning != "tolerance":
        return np.inf
    return MOST_NEARLY_CLOSED if nearly_closed(skill) else MOST_STRETCH


def snapped(pairs: Pairs, given: Surface) -> Pairs:
    """Return the pairs with start and goal moved to their closest points of the surface."""
    start, goal = given.closest(pairs.start).position, given.closest(pairs.goal).position
    return replace(pairs, start=start, goal=goal)


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

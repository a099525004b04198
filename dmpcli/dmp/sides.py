"""Which side of a surface a skill is drawn on."""

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.skill import Skill
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.surface import Surface, towards

# A surface that passes so near the taught start, mm, with its normal but for so small an angle
# (cosine), is the one that the skill was taught on.
_SAME_PLACE, _SAME_NORMAL = 0.05, 0.99


def turned_over(skill: Skill, pairs: Pairs, surface: Surface | None) -> Booleans:
    """Tell at which pairs a surface is on the other side than was guessed for the skill.

    Parameters
    ----------
    skill : Skill
    pairs : Pairs
        B of them, whose starts count; base frame, mm.
    surface : Surface or None

    Returns
    -------
    array of bool, shape (B,)
        All false where the skill knows its side, or no surface is named.
    """
    if not skill.side_guessed or surface is None:
        return np.zeros(len(pairs), dtype=bool)
    return np.asarray(normals_at(surface, pairs.start) @ skill.frame.normal < 0.0)


def normals_at(surface: Surface, start: Floats) -> Floats:
    """Normals at starts (B, 3) on the side that a skill without orientation is drawn on."""
    if isinstance(surface, Plane):
        return np.broadcast_to(surface.normal, start.shape)
    normal = surface.closest(start).normal
    return normal * towards(normal, None)


def taught_side(skill: Skill, surface: Surface, start: Floats) -> Floats | None:
    """Vectors to the side that a skill was taught on, at starts or everywhere.

    The way its tool pointed, or without orientation the normal where it was taught; but on the very
    surface that it was taught on, that surface's side: about a cylinder, or on the other face of a
    part, the tool's direction at the taught start may point out of the material.

    Parameters
    ----------
    skill : Skill
    surface : Surface
        That is to be drawn on.
    start : array, shape (B, 3)
        Base frame, mm.

    Returns
    -------
    array, shape (B, 3) or (3,), or None
        Base axes, of length 1; None where the skill does not know its side.
    """
    if skill.surface is not None:
        taught = surface.closest(skill.frame.start[None])
        along = float(taught.normal[0] @ skill.frame.normal)
        if taught.distance[0] < _SAME_PLACE and abs(along) > _SAME_NORMAL:
            return np.asarray(np.sign(along) * surface.closest(start).normal)
    R = skill.frame.rotation
    if R is not None:
        return -R[:, 2]
    return None if skill.surface is None else skill.frame.normal

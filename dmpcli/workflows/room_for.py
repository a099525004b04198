"""Where on a part a skill can be drawn: places at which `generalize` has drawn it, to see."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.contact_heights import demonstrated_scale
from dmpcli.errors import DmpError, InputError
from dmpcli.messages import heard
from dmpcli.records.learned_skill import LearnedSkill
from dmpcli.settings.generalize import GeneralizeSettings
from dmpcli.settings.layers import resolve
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.open_patches import Footprint, Patch, places_for
from dmpcli.workflows.generalize import Order, prepared
from dmpcli.workflows.generalize_inputs import one_pair
from dmpcli.workflows.single import CREASE, draw_one
from dmpcli.workflows.surface_input import SurfaceInput

MOST = 3
"""Places that are told."""

DIGITS = 1
"""Of their coordinates, mm."""

_SAMPLES = 120


def footprint(skill: LearnedSkill) -> Footprint:
    """Return how much room a skill takes at the length that was demonstrated.

    Raises
    ------
    InputError
        It is of the original model, which knows no surface.
    """
    if skill.model != "modified":
        raise InputError(
            f"--for {skill.name}: the original model knows no surface; fit it without "
            "--model original"
        )
    seen = demonstrated_scale(skill, np.linspace(0.0, skill.duration, _SAMPLES))[:, :2]
    length = 0.0 if skill.closed else float(skill.goal[0] - skill.start[0])
    return Footprint(length, seen)


def rooms_for(read: SurfaceInput, skill: LearnedSkill) -> list[Patch]:
    """Return places on a mesh at which the skill was drawn, with nothing said but the ends.

    Parameters
    ----------
    read : SurfaceInput
        Of a mesh.
    skill : LearnedSkill

    Raises
    ------
    InputError
        As `footprint`, or the surface is no mesh.
    """
    mesh = read.surface
    if not isinstance(mesh, Mesh):
        raise InputError(f"{read.path}: --for proposes places on a mesh")
    found: list[Patch] = []
    for ways in places_for(mesh.V, mesh.F, footprint(skill)):
        place = next((one for one in map(_rounded, ways) if _drawn(read, skill, one)), None)
        if place is not None:
            found.append(place)
        if len(found) == MOST:
            break
    return found


def _rounded(place: Patch) -> Patch:
    """Return the place as it is told, and typed."""
    start, goal = (np.round(point, DIGITS) + 0.0 for point in (place.start, place.goal))
    return Patch(place.area, place.normal, start, goal)


def _drawn(read: SurfaceInput, skill: LearnedSkill, place: Patch) -> bool:
    """Draw the skill there as ``generalize`` does; tell whether it is drawn."""
    table = one_pair(_three(place.start), _three(place.goal), None, None)
    settings = resolve(GeneralizeSettings, {}, None)
    try:
        with heard() as told:
            draw_one(prepared(Order(skill, table, settings, read)))
    except DmpError:
        return False
    return all(text != CREASE for _, text in told)


def _three(point: Floats) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z

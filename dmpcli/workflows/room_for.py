"""Where on a part a skill can be drawn: places at which `generalize` has drawn it, to see."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.contact_heights import demonstrated_scale
from dmpcli.errors import DmpError, InputError
from dmpcli.messages import heard
from dmpcli.records import mesh as mesh_file
from dmpcli.records.learned_skill import LearnedSkill
from dmpcli.settings.generalize import GeneralizeSettings
from dmpcli.settings.layers import resolve
from dmpcli.spatial.rotations import to_euler
from dmpcli.spatial.vectors import any_tangent, unit
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.open_patches import Footprint, Patch, places_for
from dmpcli.workflows.generalize import Order, prepared
from dmpcli.workflows.generalize_inputs import one_pair
from dmpcli.workflows.generalize_messages import SQUARE
from dmpcli.workflows.single import CREASE, draw_one
from dmpcli.workflows.surface_input import SurfaceInput

MOST = 3
"""Places that are told."""

DIGITS = 1
"""Of their coordinates, mm."""

SHARES = (1.0, 0.7, 0.5, 0.35, 0.25)
"""Sizes at which a place is looked for: the first at which there is one counts."""

_SAMPLES, _ANGLE_DIGITS, _LEVEL = 120, 4, 0.05


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


@dataclass(frozen=True)
class Room:
    """A place at which a skill was drawn.

    Attributes
    ----------
    patch : Patch
    said : dict
        Settings of ``generalize``, beside the defaults.
    turned : tuple of float, optional
        ``--start-orientation``, rad, where a surface that stands square needs it.
    """

    patch: Patch
    said: Mapping[str, Any]
    turned: tuple[float, float, float] | None = None

    def words(self) -> str:
        """Return what to say to ``generalize``."""
        more = "".join(f" --{key} {value}" for key, value in self.said.items())
        if self.turned is not None:
            more += " --start-orientation " + " ".join(f"{angle:.10g}" for angle in self.turned)
        return f"{mesh_file.ends_as_options(self.patch)}{more}"


def rooms_for(read: SurfaceInput, skill: LearnedSkill) -> list[Room]:
    """Return places on a mesh at which the skill was drawn.

    Nothing is said but the ends where that is enough; where no patch has room for it, it is made
    smaller, and a tool that would be held along the surface is turned with it.

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
    whole = footprint(skill)
    for share in SHARES[:1] if skill.closed else SHARES:
        said = {} if share == 1.0 else {"amplitude": "scale"}
        smaller = Footprint(share * whole.length, share * whole.path)
        found: list[Room] = []
        for ways in places_for(mesh.V, mesh.F, smaller):
            rooms = (_room(read, skill, place, said) for place in map(_rounded, ways))
            found += [room for room in rooms if room is not None][:1]
            if len(found) == MOST:
                break
        if found:
            return found
    return []


def _rounded(place: Patch) -> Patch:
    """Return the place as it is told, and typed."""
    start, goal = (np.round(point, DIGITS) + 0.0 for point in (place.start, place.goal))
    return Patch(place.area, place.normal, start, goal)


def _room(
    read: SurfaceInput, skill: LearnedSkill, place: Patch, said: Mapping[str, Any]
) -> Room | None:
    """Draw the skill there as ``generalize`` does; None where it is not drawn."""
    plain = Room(place, said)
    told = _drawn(read, skill, plain)
    if told is None or CREASE in told:
        return None
    if not (skill.oriented and any(SQUARE in text for text in told)):
        return plain
    turned = Room(place, {**said, "orientation": "surface"}, _against(place.normal))
    told = _drawn(read, skill, turned)
    return None if told is None or CREASE in told else turned


def _drawn(read: SurfaceInput, skill: LearnedSkill, room: Room) -> list[str] | None:
    """Draw the skill there; return what is told of it, None where it cannot be drawn."""
    place = room.patch
    table = one_pair(_three(place.start), _three(place.goal), room.turned, None)
    settings = resolve(GeneralizeSettings, room.said, None)
    try:
        with heard() as told:
            draw_one(prepared(Order(skill, table, settings, read)))
    except DmpError:
        return None
    return [text for _, text in told]


def _against(normal: Floats) -> tuple[float, float, float]:
    """Angles of a tool that points at a surface, with its x as level as may be, rad."""
    z = -unit(normal)
    x = unit(np.cross(np.cross(z, any_tangent(z)), z))
    level = np.cross(np.array([0.0, 0.0, 1.0]), z)
    if np.linalg.norm(level) > _LEVEL:
        x = unit(level)
    angles = to_euler(np.stack([x, np.cross(z, x), z], axis=1)[None])[0]
    return _three(np.round(angles, _ANGLE_DIGITS) + 0.0)


def _three(point: Floats) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z

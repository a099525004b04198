"""How a tool leans: a lead angle along its travel and a tilt angle across the stroke."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial import rotations
from dmpcli.spatial.vectors import cross, dot, length, turned, unit
from dmpcli.surfaces.frame_smoothing import smoothed_vectors

# Where directions along the smoothing's reach cancel to less than this, the stroke turns about on
# the spot: the tool rises to the normal there, and leans over again on the way back.
_TURNING = 0.5
# Half the length of the chords that tell a direction, mm.
_CHORD = 0.5


@dataclass(frozen=True)
class Inclination:
    """How far the tool leans off the surface's normal.

    The tool's axis is the direction from its tip to its holder, -R e_z. It is the direction of
    n + tan(lead) t + tan(tilt) e_v, with n the smoothed normal, t the direction of travel in the
    surface and e_v = n × e_u the chart's axis across the line from start to goal. Seen from the
    side of the travel it leans by `lead`, and where the travel is along that line, seen along
    it, by `tilt`: the order of the two does not matter.

    Attributes
    ----------
    lead : float
        Forward along travel where positive, rad.
    tilt : float
        Towards +v where positive, rad.
    """

    lead: float
    tilt: float


def inclined(euler: Floats, frames: Floats, position: Floats, by: Inclination) -> Floats:
    """Tool orientations that lean as asked, and otherwise turn as they did.

    The tool's axis is put where `Inclination` says, by the smallest rotation: its own turn about
    the axis stays.

    Parameters
    ----------
    euler : array, shape (B, T, 3)
        Unwrapped X-Y-Z Euler angles, rad.
    frames : array, shape (B, 1 or T, 3, 3)
        Smoothed axes e_u, e_v, n as columns.
    position : array, shape (B, T, 3)
        mm.
    by : Inclination

    Returns
    -------
    array, shape (B, T, 3)
        Unwrapped X-Y-Z Euler angles, rad.
    """
    normal = np.broadcast_to(frames[..., 2], position.shape)
    axis = normal + np.tan(by.tilt) * frames[..., 1]
    if by.lead:
        axis = axis + np.tan(by.lead) * travel(position, normal)
    axis = unit(axis)
    R = rotations.from_euler(euler)
    x = turned(R[..., 0], -R[..., 2], axis)
    return rotations.to_euler_continuous(np.stack([x, cross(x, axis), -axis], axis=-1))


def travel(position: Floats, normal: Floats) -> Floats:
    """Directions of travel in the surface, smoothed along the path.

    Parameters
    ----------
    position, normal : array, shape (B, T, 3)
        mm, and unit vectors.

    Returns
    -------
    array, shape (B, T, 3)
        Tangent; unit vectors but where the stroke turns about on the spot, shorter there.
    """
    if position.shape[1] < 2:
        return np.zeros_like(position)
    steps = length(np.diff(position, axis=1))[..., 0]
    arc = np.concatenate([np.zeros((len(steps), 1)), np.cumsum(steps, axis=1)], axis=1)
    ahead = smoothed_vectors(_directions(arc, position), position)
    ahead = ahead - dot(ahead, normal) * normal
    return ahead / np.maximum(length(ahead), _TURNING)


def _directions(arc: Floats, position: Floats) -> Floats:
    """Unit vectors along paths (B, T, 3) at their samples, by chords about them.

    What a hand, or a skill near its rest, does within `_CHORD` is no direction. Nearer to an end
    than half a chord the direction is carried on from inside.
    """
    total = arc[:, -1:]
    half = np.maximum(_CHORD, np.diff(arc, axis=1).max(axis=1, keepdims=True))
    half = np.maximum(np.minimum(half, 0.25 * total), 1e-12)
    centre = np.clip(arc, half, total - half)
    beyond = arc - centre
    along = _chord(arc, position, centre, half)
    inner = _chord(arc, position, centre - np.sign(beyond) * half, half)
    return unit(along + (np.abs(beyond) / half)[..., None] * (along - inner))


def _chord(arc: Floats, position: Floats, centre: Floats, half: Floats) -> Floats:
    return unit(_place(arc, position, centre + half) - _place(arc, position, centre - half))


def _place(arc: Floats, position: Floats, at: Floats) -> Floats:
    """Points (B, T, 3) of paths at arc lengths (B, T), between their samples on straight lines."""
    B, T = arc.shape
    # All paths one after another on one axis, so that one search serves them.
    offset = np.concatenate([[0.0], np.cumsum(arc[:-1, -1] + 1.0)])[:, None]
    at = np.clip(at, 0.0, arc[:, -1:])
    i = np.searchsorted((arc + offset).reshape(-1), (at + offset).reshape(-1), side="right") - 1
    first = np.arange(B)[:, None] * T
    i = np.clip(i.reshape(B, T), first, first + T - 2)
    start, end = arc.reshape(-1)[i], arc.reshape(-1)[i + 1]
    share = (at - start) / np.where(end > start, end - start, 1.0)
    flat = position.reshape(-1, 3)
    return np.asarray(flat[i] + share[..., None] * (flat[i + 1] - flat[i]))

"""Carrying a skill to new start-goal pairs: the roll-out of eq. (9)-(11), all pairs at once."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dmpcli import rotations
from dmpcli.arrays import Floats, Integers
from dmpcli.errors import RefusedError
from dmpcli.primitives.skill import Skill
from dmpcli.surfaces.plane import PlaneCharts

Amplitude = Literal["keep", "scale"]
Orientation = Literal["keep", "surface"]

# Rows of the matrix that every roll-out is a product with: a, b and the six forced responses.
_START, _GOAL, _FORCED = 0, 1, 2


@dataclass(frozen=True)
class Pairs:
    """Start-goal pairs in the base frame.

    Attributes
    ----------
    start, goal : array, shape (B, 3)
        mm.
    start_rotation, goal_rotation : array, shape (B, 3, 3), or None
        Tool orientations where they are asked for; None takes the demonstration's.
    """

    start: Floats
    goal: Floats
    start_rotation: Floats | None = None
    goal_rotation: Floats | None = None

    def __len__(self) -> int:
        return len(self.start)

    def __getitem__(self, rows: slice | Integers) -> "Pairs":
        def part(rotation: Floats | None) -> Floats | None:
            return None if rotation is None else rotation[rows]

        return Pairs(
            self.start[rows],
            self.goal[rows],
            part(self.start_rotation),
            part(self.goal_rotation),
        )


@dataclass(frozen=True)
class Trajectories:
    """Roll-outs of one duration.

    Attributes
    ----------
    position : array, shape (B, T, 3)
        mm.
    euler : array, shape (B, T, 3), or None
        Unwrapped X-Y-Z Euler angles, rad; None for a skill without orientation.
    normal : array, shape (B, 3)
        Unit normal of each pair's surface.
    """

    position: Floats
    euler: Floats | None
    normal: Floats


def curves(skill: Skill, stroke: Floats) -> Floats:
    """Curves that every trajectory of a skill is a linear combination of.

    Parameters
    ----------
    skill : Skill
    stroke : array, shape (T,)
        Times on the demonstration's scale, s.

    Returns
    -------
    array, shape (8, T)
        a, b, and V0 c + alpha_f forced per axis. All six axes share a and b.

    Raises
    ------
    RefusedError
        The axes have different gains.
    """
    if np.ptp(skill.spring.k) or np.ptp(skill.spring.d):
        raise RefusedError("a skill whose six axes have different k or d cannot be generalized")
    r = skill.response(stroke)
    forced = skill.initial_velocity * r.c + skill.alpha_f * r.forced
    return np.concatenate([r.a[:, :1], r.b[:, :1], forced], axis=1).T


def roll_out(
    skill: Skill,
    shared: Floats,
    pairs: Pairs,
    charts: PlaneCharts,
    amplitude: Amplitude = "keep",
    orientation: Orientation = "keep",
) -> Trajectories:
    """Draw a skill at new pairs: modified DMP (9)-(11) in charts, original (4)-(8) in the base.

    Parameters
    ----------
    skill : Skill
    shared : array, shape (8, T)
        Of `curves`.
    pairs : Pairs
        B pairs.
    charts : PlaneCharts
        One per pair; the original model takes only their normals.
    amplitude : {'keep', 'scale'}
        Whether v keeps its size or scales with the start-goal distance, as u does.
    orientation : {'keep', 'surface'}
        Whether the tool turns as demonstrated in base axes, or with the chart.

    Returns
    -------
    Trajectories
    """
    turn = _turn(skill, pairs, charts, orientation) if skill.oriented else None
    start, goal = _ends(skill, pairs, charts)
    scale = _scale(skill, goal - start, None if turn is None else turn.goal, amplitude)
    # Per pair: columns for a, b and the three forced coordinates; an affine chart commutes with
    # the linear roll-out, so that one matrix product gives positions in the base frame.
    coefficients = np.zeros((len(pairs), 3, 5))
    coefficients[:, :, _START] = start
    coefficients[:, :, _GOAL] = goal
    coefficients[:, [0, 1, 2], [2, 3, 4]] = scale[:, :3]
    if skill.model == "modified":
        coefficients = charts.axes @ coefficients
        # a + b = 1 carries the origin.
        coefficients[:, :, [_START, _GOAL]] += charts.origin[:, :, None]
    flat = coefficients.reshape(-1, 5) @ shared[:5]
    position = flat.reshape(len(pairs), 3, -1).transpose(0, 2, 1)
    # Rounding of a product must not leave the start beside the point that was asked for.
    position[:, 0] = pairs.start
    euler = None
    if turn is not None:
        euler = np.broadcast_to(_euler(turn, shared, scale), position.shape)
    return Trajectories(position, euler, charts.normal)


def _ends(skill: Skill, pairs: Pairs, charts: PlaneCharts) -> tuple[Floats, Floats]:
    """x0 and g of the positions in the skill's coordinates, shape (B, 3)."""
    if skill.model == "original":
        return pairs.start, pairs.goal
    goal = charts.coordinates(pairs.goal[:, None])[:, 0]
    if not skill.closed:
        # The chart runs from start to goal: v and w of the goal are rounding only.
        goal[:, 1:] = 0.0
    return np.zeros_like(goal), goal


def _scale(
    skill: Skill, difference: Floats, goal_angles: Floats | None, amplitude: Amplitude
) -> Floats:
    """S per pair and axis (B, 6): how the forcing and V0 scale with g - x0 (B, 3)."""
    scale = np.ones((len(difference), 6))
    if skill.model == "modified":
        if not skill.closed:
            scale[:, 0] = difference[:, 0] / skill.goal[0]
            if amplitude == "scale":
                scale[:, 1] = scale[:, 0]
        return scale
    # Original: the factor of eq. (7) by that of the demonstration.
    factor = np.broadcast_to(skill.forcing_factor, scale.shape).copy()
    if skill.forcing_scale == "distance":
        factor[:, :3] = np.linalg.norm(difference, axis=1)[:, None]
    else:
        factor[:, :3] = difference
        if goal_angles is not None:
            factor[:, 3:] = goal_angles
    return np.where(skill.exempt, 1.0, factor / skill.forcing_factor)


@dataclass(frozen=True)
class _Turn:
    """What the tool's turn E(t) begins with, is about, and ends at; one row serves alike pairs.

    Attributes
    ----------
    frames : array, shape (1 or B, 3, 3)
        C: E is in these axes.
    first : array, shape (1 or B, 3, 3)
        R(0).
    goal : array, shape (1 or B, 3)
        Angles of E at the goal, rad.
    """

    frames: Floats
    first: Floats
    goal: Floats


def _turn(skill: Skill, pairs: Pairs, charts: PlaneCharts, orientation: Orientation) -> _Turn:
    R = skill.frame.rotation
    assert R is not None
    first = R[None]
    if skill.model == "original":
        frames = np.eye(3)[None]
    elif orientation == "keep":
        frames = skill.frame.axes[None]
    else:
        frames = charts.axes
        first = charts.axes @ skill.frame.axes.T @ R
    if pairs.start_rotation is not None:
        first = pairs.start_rotation
    goal = skill.goal[None, 3:]
    if pairs.goal_rotation is not None:
        E = np.swapaxes(frames, -1, -2) @ pairs.goal_rotation @ np.swapaxes(first, -1, -2) @ frames
        goal = rotations.to_euler(E)
    return _Turn(frames, first, goal)


def _euler(turn: _Turn, shared: Floats, scale: Floats) -> Floats:
    """Tool orientations R(t) = C E(t) Cᵀ R(0) as unwrapped angles, shape (1 or B, T, 3).

    C is the demonstration's chart for `keep`, the pair's for `surface`; the original model turns
    about the base axes.
    """
    if len(turn.goal) == 1:
        # Then the angles' S is the same for all pairs too.
        scale = scale[:1]
    angles = turn.goal[:, None] * shared[_GOAL][:, None] + scale[:, None, 3:] * shared[5:].T
    E = rotations.from_euler(angles)
    C = turn.frames[:, None]
    return rotations.to_euler_continuous(C @ E @ np.swapaxes(C, -1, -2) @ turn.first[:, None])

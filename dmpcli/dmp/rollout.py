"""Carrying a skill to new start-goal pairs: the roll-out of eq. (9)-(11), all pairs at once."""

from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.dmp.contact_heights import ContactHeights
from dmpcli.dmp.inclination import Inclination, inclined
from dmpcli.dmp.options import Amplitude, Orientation
from dmpcli.dmp.skill import Skill
from dmpcli.errors import RefusedError
from dmpcli.spatial import rotations
from dmpcli.surfaces.frame_smoothing import smoothed
from dmpcli.surfaces.plane import PlaneCharts
from dmpcli.surfaces.surface import ChartImage, Charts

# Rows of the matrix that every roll-out is a product with: a, b and the six forced responses.
_START, _GOAL = 0, 1


@dataclass(frozen=True)
class Pairs:
    """Start-goal pairs in the base frame.

    Attributes
    ----------
    start, goal : array, shape (B, 3)
        mm.
    start_rotation, goal_rotation : array, shape (B, 3, 3), or None
        Tool orientations where they are asked for; None takes the demonstration's.
    shift : array, shape (B,), optional
        How far each stroke is drawn beside its start and goal, along v of their chart, mm.
    """

    start: Floats
    goal: Floats
    start_rotation: Floats | None = None
    goal_rotation: Floats | None = None
    shift: Floats | None = None

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
            part(self.shift),
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
    lift : ChartImage or None
        Axes, border and status of the strokes on their surface; None for the original model, which
        knows no surface.
    """

    position: Floats
    euler: Floats | None
    lift: ChartImage | None


def curves(skill: Skill, stroke: Floats, heights: ContactHeights | None = None) -> Floats:
    """Curves that every trajectory of a skill is a linear combination of.

    Parameters
    ----------
    skill : Skill
    stroke : array, shape (T,)
        Times on the demonstration's scale, s.
    heights : ContactHeights, optional
        What is drawn of w over the surface; without it w as it was taught.

    Returns
    -------
    array, shape (8, T)
        a, b, and V0 c + alpha_f forced per axis. All six axes share a and b. In a chart w is the
        same at every pair: the fifth curve is all of it, from the skill's own w to its own w.

    Raises
    ------
    RefusedError
        The axes have different gains.
    """
    if np.ptp(skill.spring.k) or np.ptp(skill.spring.d):
        raise RefusedError("a skill whose six axes have different k or d cannot be generalized")
    r = skill.response(stroke)
    forced = skill.initial_velocity * r.c + skill.alpha_f * r.forced  # eq. (9)
    if skill.model == "modified":
        if skill.learning == "tolerance":  # the paper's plane holds both ends: w is 0 there
            forced[:, 2] += skill.start[2] * r.a[:, 2] + skill.goal[2] * r.b[:, 2]
        if heights is not None:
            forced[:, 2] = heights.drawn(forced[:, 2])
    return np.concatenate([r.a[:, :1], r.b[:, :1], forced], axis=1).T


def roll_out(
    skill: Skill,
    shared: Floats,
    pairs: Pairs,
    charts: Charts | None,
    amplitude: Amplitude = "keep",
    orientation: Orientation = "keep",
    size: float = 1.0,
    inclination: Inclination | None = None,
    compiled: bool = False,
) -> Trajectories:
    """Draw a skill at new pairs: modified DMP (9)-(11) in charts, original (4)-(8) in the base.

    Parameters
    ----------
    skill : Skill
    shared : array, shape (8, T)
        Of `curves`.
    pairs : Pairs
        B pairs.
    charts : Charts or None
        One per pair, of any surface; None for the original model.
    amplitude : {'keep', 'scale'}
        Whether v keeps its size or scales with the start-goal distance, as u does.
    orientation : {'keep', 'surface'}
        Whether the tool turns as demonstrated in base axes, or with the chart.
    size : float
        Of a closed stroke, beside the demonstrated one.
    inclination : Inclination, optional
        How the tool leans; without it as it was taught.
    compiled : bool
        Whether orientations are worked out by kernels.

    Returns
    -------
    Trajectories
    """
    if charts is None:
        start, goal = pairs.start, pairs.goal
        scale = _original_scale(skill, pairs)
        position = _combined(_coefficients(start, goal, scale), shared)
        frames = np.eye(3)[None, None]
        lift = None
    else:
        scale = _modified_scale(skill, charts.goals, amplitude, size)
        goal = _reaching(skill, charts.goals, scale[:, :3], shared[:5])
        lift = _lift(charts, goal, scale, shared, pairs.shift)
        position = lift.position
        frames = skill.frame.axes[None, None]
        if orientation == "surface":
            frames = lift.axes
            if frames.shape[1] > 1:
                frames = smoothed(frames, position, compiled=compiled)
    euler = None
    if skill.oriented:
        turn = _turn(skill, pairs, frames, turned=orientation == "surface" and lift is not None)
        turn = _ending(skill, turn, scale, shared)
        euler = np.broadcast_to(_euler(turn, shared, scale, compiled), position.shape)
        if inclination is not None and lift is not None:
            leaning = frames if orientation == "surface" else lift.axes
            euler = inclined(euler, leaning, position, inclination)
    return Trajectories(position, euler, lift)


def _coefficients(start: Floats, goal: Floats, scale: Floats) -> Floats:
    """Factors (B, 3, 5) of the first five shared curves: a, b and the three forced coordinates."""
    coefficients = np.zeros((len(start), 3, 5))
    coefficients[:, :, _START] = start
    coefficients[:, :, _GOAL] = goal
    coefficients[:, [0, 1, 2], [2, 3, 4]] = scale[:, :3]
    return coefficients


def _combined(coefficients: Floats, shared: Floats) -> Floats:
    """Linear combinations of the shared curves, shape (B, T, 3): one matrix product."""
    count = len(coefficients)
    # Axis by axis in memory, so that a file's column is a view of it.
    flat = coefficients.transpose(1, 0, 2).reshape(-1, 5) @ shared[:5]  # eq. (9)-(10), solved
    return flat.reshape(3, count, -1).transpose(1, 2, 0)


def _lift(
    charts: Charts, goal: Floats, scale: Floats, shared: Floats, shift: Floats | None
) -> ChartImage:
    if not isinstance(charts, PlaneCharts):
        coordinates = _combined(_coefficients(np.zeros_like(goal), goal, scale), shared)
        if shift is not None:
            coordinates[..., 1] += shift[:, None]
        return charts.lift(coordinates)
    if shift is not None:
        charts = replace(charts, origin=charts.origin + shift[:, None] * charts.axes[..., 1])
    position = _combined(_in_base(charts, goal, scale), shared)
    position[:, 0] = _first(charts, scale, shared)
    count = len(charts)
    return ChartImage(
        position,
        charts.axes[:, None],
        np.zeros((count, 1), dtype=bool),
        charts.status,
        np.zeros(count, dtype=bool),
    )


def _first(charts: PlaneCharts, scale: Floats, shared: Floats) -> Floats:
    """First positions (B, 3): rounding of a product must not leave them beside what was asked."""
    w = scale[:, 2:3] * shared[4, 0]
    return np.where(w == 0.0, charts.origin, charts.origin + w * charts.normal)


def _reaching(skill: Skill, goal: Floats, scale: Floats, shared: Floats) -> Floats:
    """Goals for the springs (B, 3) at which the strokes end on the goals asked for.

    What a spring leaves at T_d of a start-goal line that is not the demonstrated one, E00(T_d) of
    it, is 4e-8 by default but 4 % at tau = 2: closed strokes and asked orientations would miss by
    that much. Since all is linear, a goal a little beyond the one asked for takes it in.
    """
    if skill.learning != "tolerance":
        return goal
    # w is one curve with its ends in it; its goal on the surface is 0.
    corrected: Floats = (goal - scale * shared[2:, -1]) / shared[_GOAL, -1]
    corrected[:, 2] = goal[:, 2]
    return corrected


def _ending(skill: Skill, turn: "_Turn", scale: Floats, shared: Floats) -> "_Turn":
    """Return the turn whose angles end where they were asked to; see `_reaching`."""
    if skill.learning != "tolerance":
        return turn
    own = scale[: len(turn.goal), 3:] * shared[5:, -1]
    return replace(turn, goal=(turn.goal - own) / shared[_GOAL, -1])


def _in_base(charts: PlaneCharts, goal: Floats, scale: Floats) -> Floats:
    """`_coefficients` of base positions: an affine chart commutes with the linear roll-out."""
    coefficients = charts.axes @ _coefficients(np.zeros_like(goal), goal, scale)
    # a + b = 1 carries the origin.
    coefficients[:, :, [_START, _GOAL]] += charts.origin[:, :, None]
    return coefficients


def _modified_scale(skill: Skill, goal: Floats, amplitude: Amplitude, size: float) -> Floats:
    """S per pair and axis (B, 6): how forcing and V0 scale with the goals (B, 3) in the chart."""
    scale = np.ones((len(goal), 6))
    if skill.closed:
        scale[:, :2] = size
    else:
        scale[:, 0] = goal[:, 0] / skill.goal[0]
        if amplitude == "scale":
            scale[:, 1] = scale[:, 0]
    return scale


def _original_scale(skill: Skill, pairs: Pairs) -> Floats:
    """S per pair and axis (B, 6): the factor of eq. (7) by that of the demonstration."""
    difference = pairs.goal - pairs.start
    factor = np.broadcast_to(skill.forcing_factor, (len(pairs), 6)).copy()
    if skill.forcing_scale == "distance":
        factor[:, :3] = np.linalg.norm(difference, axis=1)[:, None]
    else:
        factor[:, :3] = difference
        if skill.oriented:
            factor[:, 3:] = _turn(skill, pairs, np.eye(3)[None, None]).goal
    return np.where(skill.exempt, 1.0, factor / skill.forcing_factor)


@dataclass(frozen=True)
class _Turn:
    """What the tool's turn E(t) begins with, is about, and ends at; one row serves alike pairs.

    Attributes
    ----------
    frames : array, shape (1 or B, 1 or T, 3, 3)
        C(t): E is in these axes.
    begin : array, shape (1 or B, 3, 3)
        C(0)ᵀ R(0).
    goal : array, shape (1 or B, 3)
        Angles of E at the goal, rad.
    """

    frames: Floats
    begin: Floats
    goal: Floats

    @property
    def alike(self) -> bool:
        """Whether one row serves all pairs."""
        return len(self.frames) == len(self.begin) == len(self.goal) == 1


def _turn(skill: Skill, pairs: Pairs, frames: Floats, turned: bool = False) -> _Turn:
    """Turn of the tool in `frames`; `turned`: R(0) stands to them as R_demo(0) to C_d."""
    R = skill.frame.rotation
    assert R is not None
    if pairs.start_rotation is not None:
        begin = np.swapaxes(frames[:, 0], -1, -2) @ pairs.start_rotation
    elif turned:
        begin = (skill.frame.axes.T @ R)[None]
    else:
        begin = np.swapaxes(frames[:, 0], -1, -2) @ R
    goal = skill.goal[None, 3:]
    if pairs.goal_rotation is not None:
        end = np.swapaxes(frames[:, -1], -1, -2) @ pairs.goal_rotation
        goal = rotations.to_euler(end @ np.swapaxes(begin, -1, -2))
    return _Turn(frames, begin, goal)


def _euler(turn: _Turn, shared: Floats, scale: Floats, compiled: bool = False) -> Floats:
    """Tool orientations R(t) = C(t) E(t) C(0)ᵀ R(0) as unwrapped angles, shape (1 or B, T, 3).

    C is the demonstration's chart for `keep`, the pair's for `surface`; the original model turns
    about the base axes.
    """
    if len(turn.goal) == 1:
        # Then the angles' S is the same for all pairs too.
        scale = scale[:1]
    angles = turn.goal[:, None] * shared[_GOAL][:, None] + scale[:, None, 3:] * shared[5:].T
    E = rotations.from_euler(angles)
    E = E @ turn.begin[:, None]
    if compiled and not turn.alike:
        return rotations.euler_of_paths(turn.frames, E)
    if len(E) == 1 and turn.frames.shape[1] == 1:
        return rotations.euler_of_products(turn.frames[:, 0], E[0])
    return rotations.to_euler_continuous(turn.frames @ E)

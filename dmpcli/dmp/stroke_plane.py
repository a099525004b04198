"""The plane that a stroke was taught on, where no surface is named.

A person draws on something flat, lifts the pen, holds the tool aslant, or draws a line that tells
no plane at all. Least squares tilts by 4° over a pen lift; least *absolute* offsets do not, as long
as the pen is not lifted where the stroke swings out farthest: then the plane that holds most of the
path is the one. The tool's axis tells the side, and decides where the path does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial.vectors import turned
from dmpcli.surfaces import plane

Rule = Literal["fitted", "tool", "base", "given"]

# A stroke whose offsets across its line stay below this part of its extent tells no plane.
STRAIGHT = 0.02
# Beyond this angle between the fitted normal and the tool's axis the tool decides, degrees.
AGREEING = 45.0
# A lean of the tool against the plane's normal beyond this is told, degrees.
LEANING = 5.0
# Demonstrations whose own normals differ by more are not pooled, degrees.
APART = 15.0
# Points within the larger of this, mm, and `NOISE` times the noise lie in the plane.
IN_PLANE = 0.3
NOISE = 5.0
# A lift is one-sided when it reaches so many times as far as anything on the other side.
ONE_SIDED = 3.0
# A plane whose normal rises by less than this sine is upright: base z does not tell its sides.
UPRIGHT = 0.5
# Points of each stroke, even along its path.
_POINTS = 250
# A plane that holds so much more of the path than that of least absolute offsets is the stroke's.
_MORE = 0.1


@dataclass(frozen=True)
class StrokePlane:
    """Normals of the planes of some demonstrations, and how they were found.

    Attributes
    ----------
    normals : array, shape (n, 3)
        Unit vectors, on the tool's side.
    rule : {'fitted', 'tool', 'base', 'given'}
        By the path; across the tool's axis; across base z; or named.
    lean : float or None
        Largest angle between the tool's axis and the normal, degrees; None without orientation.
    inside : float
        Share of the path in the fitted plane, 0 to 1.
    guessed : bool
        Nothing told the side.
    pooled : bool
        Whether one plane serves all demonstrations.
    apart : float
        Largest angle between a demonstration's own normal and the pooled one, degrees.
    """

    normals: Floats
    rule: Rule
    lean: float | None
    inside: float
    guessed: bool
    pooled: bool = True
    apart: float = 0.0


def stroke_planes(
    positions: Sequence[Floats],
    tool_axes: Sequence[Floats | None],
    noise: float,
    closed: bool,
    normal: Floats | None = None,
) -> StrokePlane:
    """Find the planes of demonstrations of one stroke.

    Parameters
    ----------
    positions : sequence of array, shape (T_i, 3)
        Smoothed, mm, base frame.
    tool_axes : sequence of array, shape (3,), or None
        Mean of -R e_z over each path: from the work to the tool; None without orientation.
    noise : float
        Standard deviation of a sample, mm.
    closed : bool
        Whether the strokes end where they began.
    normal : array, shape (3,), optional
        Named by the user, on the tool's side; then nothing is looked for.
    """
    strokes = [_Offsets.of(p, closed) for p in positions]
    tools = [None if axis is None else axis / np.linalg.norm(axis) for axis in tool_axes]
    known = [tool for tool in tools if tool is not None]
    if normal is not None:
        n = normal / np.linalg.norm(normal)
        normals = np.stack([s.across(n) for s in strokes])
        return StrokePlane(normals, "given", _lean(normals, tools), 1.0, False)
    if max(s.spread / s.extent for s in strokes) < STRAIGHT:
        preferred = known if len(known) == len(tools) else [np.eye(3)[2]] * len(strokes)
        normals = np.stack([s.across(p) for s, p in zip(strokes, preferred, strict=True)])
        rule: Rule = "tool" if len(known) == len(tools) else "base"
        return StrokePlane(normals, rule, _lean(normals, tools), 0.0, rule == "base")
    near = max(IN_PLANE, NOISE * noise)
    found = [_through_most(s.q, s.e_u, near) for s in strokes]
    own = np.stack([n for n, _ in found])
    normals, pooled, apart = _fitted(strokes, own, [flat for _, flat in found])
    normals, own = _alike(normals), _alike(own)
    inside = min(
        float(np.mean(np.abs(s.heights(n)) <= near)) for s, n in zip(strokes, own, strict=True)
    )
    if len(known) < len(tools):
        side, guessed = 1.0, True
        if inside >= 0.5:
            heights = [s.heights(n) for s, n in zip(strokes, normals, strict=True)]
            side, guessed = _side_of_lift(np.concatenate(heights), near)
        return StrokePlane(side * normals, "fitted", None, inside, guessed, pooled, apart)
    axes = np.stack(known)
    normals = normals * np.where(np.sum(normals * axes, axis=1) < 0.0, -1.0, 1.0)[:, None]
    lean = _lean(normals, tools)
    assert lean is not None
    if lean <= AGREEING and inside >= 0.5:
        return StrokePlane(normals, "fitted", lean, inside, False, pooled, apart)
    normals = np.stack([s.across(a) for s, a in zip(strokes, axes, strict=True)])
    return StrokePlane(normals, "tool", lean, inside, False, pooled, apart)


@dataclass(frozen=True)
class _Offsets:
    """A stroke's offsets from its start-goal line, or a closed one's from its middle.

    Attributes
    ----------
    q : array, shape (P, 3)
        mm, even along the path.
    e_u : array, shape (3,), or None
        Along the line; None of a closed stroke.
    extent : float
        mm.
    """

    q: Floats
    e_u: Floats | None
    extent: float

    @classmethod
    def of(cls, position: Floats, closed: bool) -> "_Offsets":
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))])
        even = np.linspace(0.0, way[-1], _POINTS)
        points = np.stack([np.interp(even, way, column) for column in position.T], axis=1)
        extent = plane.extent(position)
        if closed:
            return cls(points - np.median(points, axis=0), None, extent)
        chord = position[-1] - position[0]
        e_u = chord / np.linalg.norm(chord)
        offsets = points - position[0]
        return cls(offsets - np.outer(offsets @ e_u, e_u), e_u, extent)

    @property
    def spread(self) -> float:
        """Largest offset across the line; of a closed stroke, across its main direction, mm."""
        if self.e_u is not None:
            return float(np.linalg.norm(self.q, axis=1).max())
        main = np.linalg.svd(self.q, full_matrices=False)[2][0]
        return float(np.linalg.norm(self.q - np.outer(self.q @ main, main), axis=1).max())

    def across(self, preferred: Floats) -> Floats:
        """Unit normal of the plane through the line that is closest to parallel to `preferred`."""
        if self.e_u is None:
            main = np.linalg.svd(self.q, full_matrices=False)[2][0]
            straight = self.spread < STRAIGHT * self.extent
            return plane.across_line(main, preferred) if straight else preferred
        return plane.across_line(self.e_u, preferred)

    def heights(self, normal: Floats) -> Floats:
        """Signed distances from the plane of a normal, shape (P,); a closed stroke's from its own.

        A closed stroke's plane need not pass through the middle of its points.
        """
        h = self.q @ normal
        return h - np.median(h) if self.e_u is None else h


def _ways(lines: Floats) -> Floats:
    """Directions (n, 3) of lines (n, 3) that run alike: there or back, as most of them do."""
    main = np.linalg.eigh(lines.T @ lines)[1][:, 2]
    main = main if np.sum(lines @ main) >= 0.0 else -main
    return np.where((lines @ main < 0.0)[:, None], -lines, lines)


def _fitted(
    strokes: Sequence[_Offsets], own: Floats, flat: Sequence[Floats]
) -> tuple[Floats, bool, float]:
    """Normals (n, 3) of one plane for all, or each its own; and how far apart, degrees."""
    if len(strokes) == 1:
        return own, True, 0.0
    lines = [s.e_u for s in strokes if s.e_u is not None]
    if not lines:
        pooled = _least_absolute(np.concatenate(flat), None)
        normals = np.tile(pooled, (len(strokes), 1))
    else:
        # Each stroke is turned about the smallest angle that lays its line upon the mean one, there
        # or back: a stroke that was drawn the other way lies in the same plane.
        ways = _ways(np.stack(lines))
        common = np.mean(ways, axis=0)
        common /= np.linalg.norm(common)
        laid = [turned(q, way, common) for q, way in zip(flat, ways, strict=True)]
        pooled = _least_absolute(np.concatenate(laid), common)
        normals = np.stack([turned(pooled, common, way) for way in ways])
    # A nearly straight demonstration has no normal of its own to differ.
    told = [s.spread >= STRAIGHT * s.extent for s in strokes]
    cosines = np.abs(np.sum(normals * own, axis=1))[told]
    apart = float(np.degrees(np.arccos(np.clip(cosines.min(initial=1.0), 0.0, 1.0))))
    return (normals, True, apart) if apart <= APART else (own, False, apart)


def _through_most(q: Floats, e_u: Floats | None, near: float) -> tuple[Floats, Floats]:
    """Unit normal of the plane of least absolute offsets, or of one that holds clearly more points.

    A pen that is lifted where the stroke swings out farthest outweighs what lies in the plane: the
    least sum of offsets then leans, though most of the path is flat.

    Parameters
    ----------
    q : array, shape (P, 3)
        mm.
    e_u : array, shape (3,), or None
        As `_least_absolute`.
    near : float
        Points this near to a plane are in it, mm.

    Returns
    -------
    normal : array, shape (3,)
    flat : array, shape (K, 3)
        The points that told it, mm: all, or those in the plane.
    """
    normal = _least_absolute(q, e_u)
    # What lies near the line is in each of its planes.
    telling = q[np.linalg.norm(q, axis=1) > near]
    share = float(np.mean(np.abs(telling @ normal) <= near)) if len(telling) else 1.0
    if e_u is None or share > 1.0 - _MORE:
        # Through a closed curved stroke there are many planes.
        return normal, q
    candidates = np.cross(e_u, telling)
    candidates /= np.linalg.norm(candidates, axis=1, keepdims=True)
    held = np.abs(candidates @ telling.T) <= near
    most = held[int(held.sum(axis=1).argmax())]
    better = most.mean() >= max(0.5, share + _MORE)
    return (_least_absolute(telling[most], e_u), telling[most]) if better else (normal, q)


def _least_absolute(q: Floats, e_u: Floats | None) -> Floats:
    """Unit normal n that minimizes Σ|q·n|: across e_u; without one, of a plane anywhere."""
    if e_u is None:
        return _reweighted(q, np.linalg.svd(q - q.mean(axis=0), full_matrices=False)[2][2])
    # Over the angle about e_u each |q·n| is a sine's absolute value, concave between its zeros: the
    # least sum is where n is square to one of the offsets.
    candidates = np.cross(e_u, q)
    size = np.linalg.norm(candidates, axis=1)
    candidates = candidates[size > 1e-6 * size.max()] / size[size > 1e-6 * size.max(), None]
    sums = np.abs(candidates @ q.T).sum(axis=1)
    # Two strokes on either side of a mean plane are a tie: the mean of the best, in any order.
    best = candidates[sums <= sums.min() * (1.0 + 1e-9) + 1e-12]
    return np.asarray(np.linalg.eigh(best.T @ best)[1][:, 2])


def _reweighted(q: Floats, normal: Floats) -> Floats:
    """Normal of the plane of least absolute offsets by iteratively reweighted least squares.

    Parameters
    ----------
    q : array, shape (P, 3)
        mm.
    normal : array, shape (3,)
        To begin with.
    """
    least = 1e-9 * max(float(np.abs(q).max()), 1e-12)
    for _ in range(60):
        height = q @ normal
        weight = 1.0 / np.maximum(np.abs(height - np.median(height)), least)
        centred = q - (weight @ q) / weight.sum()
        found = np.linalg.eigh((centred * weight[:, None]).T @ centred)[1][:, 0]
        moved = 1.0 - abs(float(found @ normal))
        normal = found
        if moved < 1e-15:
            break
    return np.asarray(normal)


def _alike(normals: Floats) -> Floats:
    """Normals (n, 3) on one side: towards base +z, of an upright plane along its largest component.

    Of all of them together, so that neither their order nor a small lean of one decides.
    """
    main = np.linalg.eigh(normals.T @ normals)[1][:, 2]
    toward = main[2] if abs(main[2]) > UPRIGHT else main[int(np.argmax(np.abs(main)))]
    main = main * np.sign(toward)
    return np.where((normals @ main < 0.0)[:, None], -normals, normals)


def _side_of_lift(heights: Floats, near: float) -> tuple[float, bool]:
    """Sign for the normals, and whether it is a guess: a pen lifts off the work, not into it."""
    up, down = max(float(heights.max()), 0.0), max(float(-heights.min()), 0.0)
    if max(up, down) > near and max(up, down) > ONE_SIDED * min(up, down):
        return (1.0 if up > down else -1.0), False
    return 1.0, True


def _lean(normals: Floats, tools: Sequence[Floats | None]) -> float | None:
    cosines = [float(n @ t) for n, t in zip(normals, tools, strict=True) if t is not None]
    return float(np.degrees(np.arccos(np.clip(min(cosines), -1.0, 1.0)))) if cosines else None

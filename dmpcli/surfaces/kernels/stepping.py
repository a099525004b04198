"""`geodesic_stepping`, compiled: see there for what a step does, and why."""

from typing import NamedTuple

from dmpcli.arrays import Booleans, Floats, Halves, Integers
from dmpcli.compiled import kernel
from dmpcli.surfaces.kernels.tree import (
    FLAGS,
    PART,
    REACH,
    SPLIT,
    Facets,
    beyond_border,
    closest,
    in_doubt,
    nothing_else,
    smooth_normal,
    stack,
)
from dmpcli.surfaces.kernels.vectors import (
    Vector,
    across,
    add,
    at,
    cross,
    dot,
    length,
    put,
    sub,
    times,
    turned,
    unit,
)


class WalkLimits(NamedTuple):
    """What `geodesic_stepping` and `triangle_mesh` call by these names."""

    sharp: float
    back: float
    jump: float
    landing: float
    on_border: float


class Walks(NamedTuple):
    """Where M walks stand, as `geodesic_stepping.Front` says it."""

    position: Floats
    direction: Floats
    normal: Floats
    before: Floats
    step: Floats
    sign: Floats
    part: Integers
    trend: Floats
    away: Floats


class NodeArrays(NamedTuple):
    """Nodes of lines, shapes (lines, count, 3) and (lines, count)."""

    position: Floats
    direction: Floats
    normal: Floats
    away: Floats
    sharp: Booleans
    back: Booleans


@kernel
def _probe(
    facets: Facets,
    limits: WalkLimits,
    p: Vector,
    normal: Vector,
    sign: float,
    part: int,
    nodes: Halves,
    offs: Floats,
) -> tuple[Vector, bool, bool]:
    """Normal at the closest point, whether the surface goes on there, and `in_doubt`.

    Far off the mesh too it is no matter which of the facets that meet at the closest point is
    named, if nothing else is as near: their normals are one there.
    """
    foot, row = closest(facets, p, nodes, offs)
    there = times(sign, smooth_normal(facets.reals, foot, row))
    good = dot(there, normal) > limits.sharp and facets.numbers[row, PART] == part
    good = good and not beyond_border(facets, p, foot, row, limits.on_border)
    unsure = in_doubt(facets, p, foot, row)
    known = facets.reals[row, REACH] >= 0.0
    if unsure and known and not facets.numbers[row, FLAGS] & SPLIT:
        unsure = not nothing_else(facets, p, foot, nodes)
    return there, good, unsure


@kernel
def start(facets: Facets, limits: WalkLimits, ahead: Walks, behind: Walks, doubt: Booleans) -> None:
    """Find curvature ahead and behind of walks that stand at points of the mesh.

    Parameters
    ----------
    facets : Facets
    limits : WalkLimits
    ahead : Walks
        M walks, of which position, direction, normal, step, sign and part are read; `before` and
        `trend` are filled in.
    behind : Walks
        The same walks the other way, of which only `before` and `trend` are filled in.
    doubt : array of bool, shape (M,)
        Filled in: which walks numpy is to decide about.
    """
    nodes, offs = stack()
    for i in range(len(ahead.position)):
        x, t, n = at(ahead.position, i), at(ahead.direction, i), at(ahead.normal, i)
        h, sign, part = ahead.step[i, 0], ahead.sign[i, 0], ahead.part[i]
        reach = times(h, t)
        one, here, unsure = _probe(facets, limits, add(x, reach), n, sign, part, nodes, offs)
        other, there, either = _probe(facets, limits, sub(x, reach), n, sign, part, nodes, offs)
        doubt[i] = unsure or either
        bend_ahead = sub(one, n) if here else sub(n, other)
        bend_behind = sub(n, other) if there else sub(one, n)
        bend, half = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if here or there:
            bend = times(0.5, add(bend_ahead, bend_behind))
            bend = times(1.0 + dot(bend, bend) / 3.0, bend)
        if here and there:
            half = times(0.5, sub(bend_ahead, bend_behind))
        put(ahead.before, i, unit(add(sub(n, bend), half)))
        put(behind.before, i, unit(add(add(n, bend), half)))
        put(ahead.trend, i, (bend[0] / h, bend[1] / h, bend[2] / h))
        put(behind.trend, i, (-bend[0] / h, -bend[1] / h, -bend[2] / h))


@kernel
def _corrected(
    x: Vector, t: Vector, n: Vector, before: Vector, h: float, foot: Vector, after: Vector
) -> tuple[Vector, Vector, Vector]:
    """Position, direction and normal at the point found, corrected for the length walked."""
    chord = sub(after, n)
    last = sub(n, before)
    second = sub(chord, last)
    twist = dot(n, cross(chord, second)) / 12.0
    there = turned(t, n, after)
    there = unit(add(there, times(twist, cross(after, there))))
    bend_before = dot(times(0.5, add(chord, last)), t)
    bend_after = dot(add(chord, times(0.5, second)), there)
    along = add(x, times(0.5 * h, add(t, there)))
    ends = sub(times(bend_after, after), times(bend_before, n))
    shift = sub(add(along, times(h / 12.0, ends)), foot)
    shift = sub(shift, times(dot(shift, after), after))
    size = length(shift)
    shift = times(min(1.0, 0.25 * h / max(size, 1e-300)), shift)
    turn = times(dot(shift, there) / h, add(chord, times(0.5, second)))
    after = unit(add(after, turn))
    return add(foot, shift), across(there, after), after


@kernel
def _step(
    facets: Facets,
    limits: WalkLimits,
    x: Vector,
    t: Vector,
    n: Vector,
    before: Vector,
    trend: Vector,
    away: float,
    h: float,
    sign: float,
    part: int,
    nodes: Halves,
    offs: Floats,
) -> tuple[Vector, Vector, Vector, Vector, float, bool, bool, bool, bool]:
    """Position, direction, normal, trend and away after a step.

    And whether it is off, sharp, back, and `in_doubt`.
    """
    was_off = away > 0.0
    last = sub(n, before)
    slope = trend if was_off else (last[0] / h, last[1] / h, last[2] / h)
    slope = sub(slope, times(dot(slope, n), n))
    kappa = dot(slope, t)
    guess = sub(add(x, times(h, t)), times(0.5 * h * h * kappa, n))
    guess = sub(guess, times((h * h * h / 6.0) * kappa, slope))
    foot, row = closest(facets, guess, nodes, offs)
    doubt = in_doubt(facets, guess, foot, row)
    after = times(sign, smooth_normal(facets.reals, foot, row))
    turn = dot(after, n)
    gap = length(sub(foot, guess))
    back = turn < limits.back
    other = facets.numbers[row, PART] != part or back
    sharp = not other and turn < limits.sharp
    allowed = limits.landing * away if was_off else limits.jump * h
    off = other or (not sharp and gap > max(allowed, facets.reals[row, REACH]))
    off = off or beyond_border(facets, guess, foot, row, limits.on_border)
    if off:
        foot = guess
        after = unit(add(n, times(h, trend)))
        slope = turned(trend, n, after)
        away += h
    else:
        away = 0.0
    position, direction, normal = _corrected(x, t, n, before, h, foot, after)
    return position, direction, normal, slope, away, off, sharp, back, doubt


@kernel
def ends(
    facets: Facets,
    limits: WalkLimits,
    walks: Walks,
    steps: Integers,
    sharp: Booleans,
    off: Booleans,
    doubt: Booleans,
) -> None:
    """Walk each walk's steps in place; note which met a crease, and which were ever off.

    Parameters
    ----------
    facets : Facets
    limits : WalkLimits
    walks : Walks
        M of them; position, direction and normal are overwritten.
    steps : array of int, shape (M,)
    sharp, off : array of bool, shape (M,)
        Set where it is so, else left.
    doubt : array of bool, shape (M,)
        Set for walks that are not walked to their end, and stay where they were.
    """
    nodes, offs = stack()
    for i in range(len(steps)):
        x, t, n = at(walks.position, i), at(walks.direction, i), at(walks.normal, i)
        before, trend, away = at(walks.before, i), at(walks.trend, i), walks.away[i]
        h, sign, part = walks.step[i, 0], walks.sign[i, 0], walks.part[i]
        for _ in range(steps[i]):
            last = n
            x, t, n, trend, away, left, crease, _, unsure = _step(
                facets, limits, x, t, n, before, trend, away, h, sign, part, nodes, offs
            )
            before = last
            sharp[i] |= crease
            off[i] |= left
            if unsure:
                doubt[i] = True
                break
        if not doubt[i]:
            put(walks.position, i, x)
            put(walks.direction, i, t)
            put(walks.normal, i, n)


@kernel
def lines(
    facets: Facets,
    limits: WalkLimits,
    walks: Walks,
    rows: Integers,
    counts: Integers,
    first: int,
    way: int,
    out: NodeArrays,
    doubt: Booleans,
) -> None:
    """Walk `counts` nodes of each walk, and put them beside node `first` of its row of `out`.

    Parameters
    ----------
    facets : Facets
    limits : WalkLimits
    walks : Walks
        M of them, at node `first`; they stay as they are.
    rows : array of int, shape (M,)
        The row of `out` that each walk fills.
    counts : array of int, shape (rows of `out`,)
    first : int
    way : int
        1 or -1: to larger nodes or to smaller; directions in `out` point to larger ones.
    out : NodeArrays
    doubt : array of bool, shape (M,)
        Set for walks that are not walked to their end.
    """
    nodes, offs = stack()
    for i in range(len(rows)):
        row = rows[i]
        x, t, n = at(walks.position, i), at(walks.direction, i), at(walks.normal, i)
        before, trend, away = at(walks.before, i), at(walks.trend, i), walks.away[i]
        h, sign, part = walks.step[i, 0], walks.sign[i, 0], walks.part[i]
        for k in range(1, counts[row] + 1):
            last = n
            x, t, n, trend, away, _, crease, back, unsure = _step(
                facets, limits, x, t, n, before, trend, away, h, sign, part, nodes, offs
            )
            before = last
            node = first + way * k
            put(out.position[row], node, x)
            put(out.direction[row], node, times(float(way), t))
            put(out.normal[row], node, n)
            out.away[row, node] = away
            out.sharp[row, node], out.back[row, node] = crease, back
            if unsure:
                doubt[i] = True
                break

"""Demonstrations in the skill's coordinates: which chart they are in, and their curves in it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.curve import Curve, dense_count
from dmpcli.dmp.force_profile import unsprung
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.preprocessing import Preprocessed
from dmpcli.dmp.skill import TaskFrame
from dmpcli.dmp.stroke_plane import StrokePlane, stroke_planes
from dmpcli.errors import InputError, RefusedError
from dmpcli.spatial import rotations
from dmpcli.surfaces import plane
from dmpcli.surfaces.frame_smoothing import smoothed
from dmpcli.surfaces.surface import Status, Surface

# A recording that lies farther off the surface everywhere was not taught on it, mm.
FARTHEST = 100.0
# A gap that is so many times smaller or larger than that of a closed stroke leaves no doubt.
CLEARLY = 3.0
# Samples of a stroke whose coordinates on a curved surface are sought.
_SOUGHT = 2000


@dataclass(frozen=True)
class TaughtStroke:
    """One demonstration in the skill's coordinates.

    Attributes
    ----------
    seen : Preprocessed
    frame : TaskFrame
        Its own: start and goal, on a named surface their feet; C at the start; R(0).
    length : float
        Start-goal distance along the chart, mm; 0 of a closed stroke.
    curve : Curve
        u, v, w, mm, and the angles of E, rad, over its own time.
    force : array, shape (M,), or None
        Along the normal, N, positive where the work pushes, at as many even times as the curve was
        laid through; None where none is learned. w is 0 where it presses.
    """

    seen: Preprocessed
    frame: TaskFrame
    length: float
    curve: Curve
    force: Floats | None = None


def taught_strokes(
    seen: Sequence[Preprocessed],
    choices: FitOptions,
    surface: Surface | None,
    closed: bool | None = None,
) -> tuple[list[TaughtStroke], StrokePlane | None, bool]:
    """Bring demonstrations of one stroke into their charts.

    Parameters
    ----------
    seen : sequence of Preprocessed
        All with orientation or all without.
    choices : FitOptions
    surface : Surface or None
        What they were taught on, in the base frame; None looks for a plane.
    closed : bool, optional
        Whether they end where they began, where that is known already.

    Returns
    -------
    demonstrations : list of TaughtStroke
    plane : StrokePlane or None
        How the planes were found; None on a named surface.
    closed : bool
        Whether the strokes end where they began: on average.

    Raises
    ------
    RefusedError
        A recording does not lie on the surface, or its chart does not reach all of it.
    """
    samples = [p.position(_times(p, _count(p))) for p in seen]
    if closed is None:
        closed = _closed(samples)
    if surface is not None:
        found = [_on_surface(i, p, surface, closed) for i, p in enumerate(seen, start=1)]
        return found, None, closed
    tools = [_mean_tool_axis(p) for p in seen]
    normal = None if choices.normal is None else np.array(choices.normal)
    if normal is not None:
        samples = [
            without_spring(p, _times(p, len(x)), normal / np.linalg.norm(normal))
            for p, x in zip(seen, samples, strict=True)
        ]
    noise = max(p.sigma for p in seen)
    planes = stroke_planes(samples, tools, noise, closed, normal)
    found = [
        _on_plane(p, x, n, closed) for p, x, n in zip(seen, samples, planes.normals, strict=True)
    ]
    return found, planes, closed


def mean_frame(found: Sequence[TaughtStroke], closed: bool) -> TaskFrame:
    """Return the frame of all demonstrations: means that do not depend on their order.

    The goal lies along the mean chart's u axis at the mean length.
    """
    start = np.mean([d.frame.start for d in found], axis=0)
    axes = _mean_rotation([d.frame.axes for d in found])
    if axes is None:
        # Demonstrations that face in opposite directions have no mean: the first in space.
        first = min(found, key=lambda d: tuple(d.frame.start))
        axes, start = first.frame.axes, first.frame.start
    if len(found) == 1:
        goal = found[0].frame.goal
    elif closed:
        goal = start + axes @ np.mean(
            [d.frame.axes.T @ (d.frame.goal - d.frame.start) for d in found], axis=0
        )
    else:
        length = np.mean([np.linalg.norm(d.frame.goal - d.frame.start) for d in found])
        goal = start + axes[:, 0] * length
    rotation = None
    in_chart = [d.frame.axes.T @ d.frame.rotation for d in found if d.frame.rotation is not None]
    if in_chart:
        mean = _mean_rotation(in_chart)
        rotation = axes @ (in_chart[0] if mean is None else mean)
    return TaskFrame(start, goal, axes, rotation)


def _closed(samples: Sequence[Floats]) -> bool:
    """Tell whether strokes (T_i, 3) end where they began: by their mean gap.

    Raises
    ------
    InputError
        Some clearly do and others clearly do not.
    """
    share = np.array([np.linalg.norm(x[-1] - x[0]) / plane.extent(x) for x in samples])
    closed = bool(np.mean(share) < plane.CLOSED)
    odd = share > CLEARLY * plane.CLOSED if closed else share < plane.CLOSED / CLEARLY
    if odd.any():
        i, kinds = int(np.argmax(odd)), ("open", "closed")
        others = "the first is" if i else "the others are"
        raise InputError(
            f"demonstration {i + 1} is {kinds[not closed]}, {others} {kinds[closed]}; "
            "fit them apart"
        )
    return closed


def _count(seen: Preprocessed) -> int:
    return dense_count(len(seen.raw.position))


def _on_plane(seen: Preprocessed, position: Floats, normal: Floats, closed: bool) -> TaughtStroke:
    chord = position[-1] - position[0]
    length = float(np.linalg.norm(chord))
    axes = plane.closed_axes(normal) if closed else plane.open_axes(chord / length, normal)
    rotation = None if seen.rotation is None else seen.rotation(_times(seen, len(position)))
    x = np.zeros((len(position), 6))
    x[:, :3] = (position - position[0]) @ axes
    first = None
    if rotation is not None:
        first = rotation[0]
        x[:, 3:] = rotations.to_euler_continuous(axes.T @ rotation @ first.T @ axes)
    frame = TaskFrame(position[0], position[-1], axes, first)
    force = None
    if seen.force is not None:
        force = seen.force(_times(seen, len(position))) @ normal
        x[:, 2] = unsprung(x[:, 2], force)
    curve = Curve.through(x, seen.duration, seen.intervals)
    return TaughtStroke(seen, frame, 0.0 if closed else length, curve, force)


def without_spring(seen: Preprocessed, t: Floats, normal: Floats) -> Floats:
    """Positions of a recording on a plane, without what the pen's own spring gives way.

    A pen that is pressed harder towards the goal would else lean the chart, which holds both ends.

    Parameters
    ----------
    seen : Preprocessed
    t : array, shape (T,)
        s.
    normal : array, shape (3,)
        Of the plane, on the tool's side.

    Returns
    -------
    array, shape (T, 3)
        mm; as recorded where no force is known.
    """
    position = seen.position(t)
    if seen.force is None:
        return position
    height = (position - position[0]) @ normal
    force = seen.force(t) @ normal
    return np.asarray(position + (unsprung(height, force) - height)[:, None] * normal)


def _on_surface(number: int, seen: Preprocessed, surface: Surface, closed: bool) -> TaughtStroke:
    times = _times(seen, min(_count(seen), max(_SOUGHT, 4 * seen.intervals) + 1))
    position = seen.position(times)
    rotation = None if seen.rotation is None else seen.rotation(times)
    side = None if rotation is None else -rotation[0, :, 2]
    closed_axes = None
    if closed:
        tools = None if rotation is None else -rotation[:, :, 2].mean(axis=0)
        closed_axes = plane.closed_axes(stroke_planes([position], [tools], 0.0, True).normals[0])
    ends = surface.closest(position[[0, -1]])
    if ends.distance.min() > FARTHEST:
        raise RefusedError(
            f"demonstration {number} begins {ends.distance[0]:.1f} mm and ends "
            f"{ends.distance[1]:.1f} mm off the surface; check --surface-pose and --surface-unit"
        )
    from dmpcli.surfaces.inverse_chart import invert  # loads all of meshes

    charts = surface.charts(position[:1], position[-1:], side, closed_axes)
    inverse = invert(charts, position[None])
    if not inverse.complete[0]:
        missing = float(1.0 - inverse.reached[0].mean())
        raise RefusedError(
            f"demonstration {number} cannot be brought onto the surface: "
            f"{Status(int(inverse.status[0])).reason} ({100.0 * missing:.1f} % of it); check "
            "--surface-pose, or cut the recording with --from and --until"
        )
    x = np.zeros((len(times), 6))
    x[:, :3] = _pinned(inverse.coordinates[0], charts.goals[0])
    axes = smoothed(inverse.axes, position[None])[0]
    first = None
    if rotation is not None:
        first = rotation[0]
        E = np.swapaxes(axes, -1, -2) @ rotation @ first.T @ axes[0]
        x[:, 3:] = rotations.to_euler_continuous(E)
    feet = charts.lift(x[None, [0, -1], :3] * [1.0, 1.0, 0.0]).position[0]
    frame = TaskFrame(feet[0], feet[1], axes[0], first)
    force = None
    if seen.force is not None:
        force = np.sum(seen.force(times) * axes[..., 2], axis=1)
        x[:, 2] = unsprung(x[:, 2], force)
    # A mesh's facets ripple at any frequency.
    curve = Curve.through(x, seen.duration, len(times) - 1)
    return TaughtStroke(seen, frame, float(charts.lengths[0]), curve, force)


def _pinned(uvw: Floats, goal: Floats) -> Floats:
    """Coordinates (T, 3) whose feet begin in the chart's origin and end in its goal.

    Off a curved surface the closest point, where the chart begins, is not quite the foot.
    """
    share = np.linspace(0.0, 1.0, len(uvw))[:, None]
    missing = (1.0 - share) * -uvw[0] + share * (goal - uvw[-1])
    missing[:, 2] = 0.0
    pinned: Floats = uvw + missing
    return pinned


def _times(seen: Preprocessed, samples: int) -> Floats:
    return np.linspace(0.0, seen.duration, samples)


def _mean_tool_axis(seen: Preprocessed) -> Floats | None:
    """Mean over the path of -R e_z, from the work to the tool; None without orientation."""
    if seen.rotation is None:
        return None
    return np.asarray(-seen.rotation(_times(seen, 200))[:, :, 2].mean(axis=0))


def _mean_rotation(matrices: Sequence[Floats]) -> Floats | None:
    """Chordal mean of rotations (3, 3); None where they are too far apart to have one."""
    if len(matrices) == 1:
        return matrices[0]
    U, size, Vt = np.linalg.svd(np.mean(matrices, axis=0))
    if size[1] < 0.1:
        return None
    U[:, 2] *= np.linalg.det(U @ Vt)
    return np.asarray(U @ Vt)

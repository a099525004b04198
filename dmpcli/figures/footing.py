"""How a stroke lies on the surface that a report was given, beside what the demonstration says."""

from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.figures.stroke import Stroke
from dmpcli.measures import surface as measure
from dmpcli.measures.wave import WaveHeights
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.protocol import Status, Surface, towards


@dataclass(frozen=True)
class Ground:
    """The surface of a report.

    Attributes
    ----------
    label : str
        What tables call it.
    surface : Surface
        In the base frame.
    V, F : arrays, optional
        Of a mesh, for its picture.
    """

    label: str
    surface: Surface
    V: Floats | None = None
    F: Integers | None = None

    @property
    def curved(self) -> bool:
        """Whether it may be other than a plane."""
        return not isinstance(self.surface, Plane)


@dataclass(frozen=True)
class Footing:
    """A stroke on a surface, measured from its points.

    Attributes
    ----------
    foot, normal : array, shape (n, 3)
        Closest points, mm, and the surface's normals there, on the tool's side.
    height : array, shape (n,)
        Signed distance to the surface as drawn, mm.
    distance : array, shape (n,)
        Distance after taking off the demonstration's own height w over its plane, mm.
    lifted : float or None
        Largest |w| taken off, mm; None where there is no demonstration to take it from.
    start, goal : array, shape (3,)
        Ends of the stroke as planned, snapped to the surface, mm.
    length : float or None
        Of the geodesic between them, mm; None where none was found, and for closed strokes.
    uv : array, shape (n, 2), or None
        Chart coordinates of the feet, mm; None where there is no chart, or it does not reach.
    wave : WaveHeights or None
        Along the surface; None where there is no chart.
    tilt : array, shape (n,), or None
        Angle between tool and normal, rad.
    demonstrated : array, shape (m, 3), or None
        The demonstration's u, v, w, its u stretched to this stroke's start-goal distance, mm.
    remark : str or None
        Why there are no chart coordinates.
    """

    foot: Floats
    normal: Floats
    height: Floats
    distance: Floats
    lifted: float | None
    start: Floats
    goal: Floats
    length: float | None
    uv: Floats | None
    wave: WaveHeights | None
    tilt: Floats | None
    demonstrated: Floats | None
    remark: str | None

    @property
    def place(self) -> Floats | None:
        """Chart coordinates u, v and height of the samples, shape (n, 3), mm."""
        return None if self.uv is None else np.column_stack([self.uv, self.height])


def placed(stroke: Stroke, ground: Ground, reference: Stroke | None) -> Stroke:
    """Return a trajectory or run with its footing on the surface; a demonstration as it is.

    Parameters
    ----------
    stroke : Stroke
    ground : Ground
    reference : Stroke, optional
        The demonstration.
    """
    if stroke.kind == "demonstration":
        return stroke
    # A run's best-fitting plane says nothing where the surface is curved.
    axes = None if ground.curved and stroke.bound else stroke.axes
    return replace(stroke, axes=axes, footing=footing_of(stroke, ground.surface, reference))


def footing_of(stroke: Stroke, surface: Surface, reference: Stroke | None) -> Footing:
    """Measure how a stroke lies on a surface; see `Footing`."""
    ends = surface.closest(np.stack([stroke.start, stroke.goal]))
    side = None if stroke.side is None else stroke.side[None]
    sign = towards(ends.normal[:1], side)

    def closest(points: Floats) -> tuple[Floats, Floats]:
        hits = surface.closest(points)
        return hits.position, sign * hits.normal

    foot, normal = closest(stroke.position)
    upward = (sign * ends.normal)[0]
    length, uv, remark = _coordinates(stroke, surface, ends.position, foot, upward)
    demonstrated = None if length is None else _stretched(reference, length)
    off = None
    # The original model has no w: it does not know what off the surface means.
    if demonstrated is not None and uv is not None and stroke.bound:
        off = measure.height_there(uv, demonstrated)
    return Footing(
        foot,
        normal,
        measure.height(stroke.position, closest),
        measure.distance(stroke.position, closest, 0.0 if off is None else off),
        None if off is None else float(np.abs(off).max()),
        ends.position[0],
        ends.position[1],
        length,
        uv,
        None if uv is None or length is None else measure.wave_along(uv, length),
        None if stroke.rotation is None else measure.tilt(stroke.rotation, normal),
        demonstrated,
        remark,
    )


def _stretched(reference: Stroke | None, length: float) -> Floats | None:
    """Demonstration in its own chart, u stretched to a new start-goal distance, shape (m, 3)."""
    if reference is None or reference.axes is None or reference.closed:
        return None
    place = (reference.position - reference.start) @ reference.axes
    return np.asarray(place * [length / reference.length, 1.0, 1.0])


def _coordinates(
    stroke: Stroke, surface: Surface, ends: Floats, foot: Floats, normal: Floats
) -> tuple[float | None, Floats | None, str | None]:
    """Geodesic distance of the ends, chart coordinates of the feet, and why there are none."""
    if stroke.closed:
        return None, None, "closed, so there is no line to measure waves from"
    charts = surface.charts(ends[:1], ends[1:], normal)
    status = Status(charts.status[0])
    if status != Status.DRAWN:
        return None, None, status.reason
    length = float(charts.lengths[0])
    last = Status.DRAWN

    def lift(uv: Floats) -> tuple[Floats, Floats, Floats]:
        nonlocal last
        lifted = charts.lift(np.column_stack([uv, np.zeros(len(uv))])[None])
        last = Status(lifted.status[0])
        reached = last in (Status.DRAWN, Status.BORDER)
        gone = np.broadcast_to(lifted.outside[0] | (not reached), len(uv))
        point = np.where(gone[:, None], np.nan, lifted.position[0])
        return point, lifted.axes[0, :, :, 0], lifted.axes[0, :, :, 1]

    uv = measure.coordinates(foot, lift, _guess(foot, ends, normal, length))
    if np.isfinite(uv).all():
        return length, uv, None
    return length, None, (Status.BORDER if last == Status.DRAWN else last).reason


def _guess(foot: Floats, ends: Floats, normal: Floats, length: float) -> Floats:
    """Coordinates as on a plane through both ends."""
    way = ends[1] - ends[0]
    chord = float(np.linalg.norm(way))
    aside = np.cross(normal, way)
    offset = foot - ends[0]
    u = offset @ way * (length / chord**2)
    return np.stack([u, offset @ aside / np.linalg.norm(aside)], axis=1)

"""How a stroke lies on the surface that a report was given, beside what the demonstration says."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.figures.stroke import Stroke
from dmpcli.measures import surface as measure
from dmpcli.measures.wave import WaveHeights
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.protocol import Hits, Status, Surface, towards

AT_ONCE = 64
"""Strokes measured together; the charts have as many in hand."""


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
    start_off, goal_off : float
        How far the planned ends lie off the surface, mm.
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
    start_off: float
    goal_off: float
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


def placed(strokes: Sequence[Stroke], ground: Ground, reference: Stroke | None) -> list[Stroke]:
    """Return trajectories and runs with their footing on the surface; demonstrations as they are.

    Parameters
    ----------
    strokes : sequence of Stroke
        `AT_ONCE` or so, and alike in length, are quickest; the result does not depend on it.
    ground : Ground
    reference : Stroke, optional
        The demonstration.
    """
    found = [stroke for stroke in strokes if stroke.kind != "demonstration"]
    footings = iter(_footings(found, ground.surface, reference))
    done = []
    for stroke in strokes:
        if stroke.kind == "demonstration":
            done.append(stroke)
            continue
        # A run's best-fitting plane says nothing where the surface is curved.
        axes = None if ground.curved and stroke.bound else stroke.axes
        done.append(replace(stroke, axes=axes, footing=next(footings)))
    return done


def _footings(
    strokes: Sequence[Stroke], surface: Surface, reference: Stroke | None
) -> list[Footing]:
    """Measure how strokes lie on a surface; see `Footing`."""
    if not strokes:
        return []
    ends = surface.closest(np.array([[stroke.start, stroke.goal] for stroke in strokes]))
    up = np.array([0.0, 0.0, 1.0])
    side = np.array([up if stroke.side is None else stroke.side for stroke in strokes])
    signs = towards(ends.normal[:, 0], side)
    hits = [surface.closest(stroke.position) for stroke in strokes]
    charted = [i for i, stroke in enumerate(strokes) if not stroke.closed]
    feet = [hits[i].position for i in charted]
    upward = (signs * ends.normal[:, 0])[charted]
    places = dict(zip(charted, _places(surface, ends.position[charted], feet, upward), strict=True))
    return [
        _footing(
            stroke,
            surface,
            reference,
            Hits(ends.position[i], ends.normal[i], ends.distance[i], ends.face[i]),
            hits[i],
            float(signs[i, 0]),
            places.get(i, _CLOSED),
        )
        for i, stroke in enumerate(strokes)
    ]


def _footing(
    stroke: Stroke,
    surface: Surface,
    reference: Stroke | None,
    ends: Hits,
    hits: Hits,
    sign: float,
    place: "_Place",
) -> Footing:
    foot, normal = hits.position, sign * hits.normal

    def closest(points: Floats) -> tuple[Floats, Floats]:
        if points is stroke.position:
            return foot, normal
        there = surface.closest(points)
        return there.position, sign * there.normal

    length, uv = place.length, place.uv
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
        float(ends.distance[0]),
        float(ends.distance[1]),
        length,
        uv,
        None if uv is None or length is None else measure.wave_along(uv, length),
        None if stroke.rotation is None else measure.tilt(stroke.rotation, normal),
        demonstrated,
        place.remark,
    )


def _stretched(reference: Stroke | None, length: float) -> Floats | None:
    """Demonstration in its own chart, u stretched to a new start-goal distance, shape (m, 3)."""
    if reference is None or reference.axes is None or reference.closed:
        return None
    place = (reference.position - reference.start) @ reference.axes
    return np.asarray(place * [length / reference.length, 1.0, 1.0])


@dataclass(frozen=True)
class _Place:
    """Geodesic distance of the ends, chart coordinates of the feet, and why there are none."""

    length: float | None
    uv: Floats | None
    remark: str | None


_CLOSED = _Place(None, None, "closed, so there is no line to measure waves from")


def _places(surface: Surface, ends: Floats, feet: Sequence[Floats], normal: Floats) -> list[_Place]:
    """Places of b strokes with ends (b, 2, 3), feet (n, 3) each and normals (b, 3) at the starts.

    Shorter strokes are filled up with their last foot.
    """
    if not feet:
        return []
    charts = surface.charts(ends[:, 0], ends[:, 1], normal)
    most = max(len(foot) for foot in feet)
    foot = np.stack([np.pad(f, ((0, most - len(f)), (0, 0)), mode="edge") for f in feet])
    status = charts.status

    def lift(uv: Floats) -> tuple[Floats, Floats, Floats]:
        nonlocal status
        lifted = charts.lift(np.concatenate([uv, np.zeros((*uv.shape[:2], 1))], axis=-1))
        status = lifted.status
        reached = np.isin(status, (Status.DRAWN, Status.BORDER))
        gone: Booleans = lifted.outside | ~reached[:, None]
        point = np.where(gone[..., None], np.nan, lifted.position)
        return point, lifted.axes[..., 0], lifted.axes[..., 1]

    guess = [
        _guess(f, e, n, length)
        for f, e, n, length in zip(foot, ends, normal, charts.lengths, strict=True)
    ]
    uv = measure.coordinates(foot, lift, np.stack(guess))
    places = []
    for i, first in enumerate(charts.status):
        if first != Status.DRAWN:
            places.append(_Place(None, None, Status(first).reason))
            continue
        length, here = float(charts.lengths[i]), uv[i, : len(feet[i])]
        if np.isfinite(here).all():
            places.append(_Place(length, here, None))
            continue
        last = Status.BORDER if status[i] == Status.DRAWN else Status(status[i])
        places.append(_Place(length, None, last.reason))
    return places


def _guess(foot: Floats, ends: Floats, normal: Floats, length: float) -> Floats:
    """Coordinates as on a plane through both ends."""
    way = ends[1] - ends[0]
    chord = max(float(np.linalg.norm(way)), 1e-9)  # one point: such a pair has no chart anyway
    aside = np.cross(normal, way)
    offset = foot - ends[0]
    u = offset @ way * (length / chord**2)
    return np.stack([u, offset @ aside / max(float(np.linalg.norm(aside)), 1e-9)], axis=1)

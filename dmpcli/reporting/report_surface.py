"""How a stroke lies on the surface that a report was given, beside what the demonstration says."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.dmp.contact_heights import CONTACT
from dmpcli.metrics import on_surface as measure
from dmpcli.reporting.stroke import ReportedStroke, as_drawn
from dmpcli.reporting.surface_placement import SurfacePlacement
from dmpcli.surfaces.inverse_chart import invert
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.surface import ClosestPoints, Status, Surface, towards

ON = 0.05
"""Nearer than this to a surface a stroke is on it, mm, where no height at all was flattened."""

AT_ONCE = 128
"""Strokes measured together: what they need fits the processor's outer cache."""


@dataclass(frozen=True)
class ReportSurface:
    """The surface of a report.

    Attributes
    ----------
    label : str
        What tables call it.
    surface : Surface
        In the base frame.
    V, F : arrays, optional
        Of a mesh, for its picture.
    key : str
        Its file, unit and pose, as skills tell what they were taught on.
    """

    label: str
    surface: Surface
    V: Floats | None = None
    F: Integers | None = None
    key: str = ""

    @property
    def curved(self) -> bool:
        """Whether it may be other than a plane."""
        return not isinstance(self.surface, Plane)


class Grounds(Protocol):
    """The surfaces of a batch whose strokes lie on many."""

    def of(self, ids: Sequence[str]) -> Integers:
        """Return the number of the surface of each stroke, shape (k,)."""

    def ground(self, number: int) -> ReportSurface:
        """Return a surface; several threads may ask at once."""


def placed(
    strokes: Sequence[ReportedStroke], ground: ReportSurface, reference: ReportedStroke | None
) -> list[ReportedStroke]:
    """Return trajectories and runs with their footing on the surface; demonstrations as they are.

    Parameters
    ----------
    strokes : sequence of ReportedStroke
        `AT_ONCE` or so, and alike in length, are quickest; the result does not depend on it.
    ground : ReportSurface
    reference : ReportedStroke, optional
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
    strokes: Sequence[ReportedStroke], surface: Surface, reference: ReportedStroke | None
) -> list[SurfacePlacement]:
    """Measure how strokes lie on a surface; see `SurfacePlacement`."""
    if not strokes:
        return []
    ends = surface.closest(np.array([[stroke.start, stroke.goal] for stroke in strokes]))
    up = np.array([0.0, 0.0, 1.0])
    side = np.array([up if stroke.side is None else stroke.side for stroke in strokes])
    signs = towards(ends.normal[:, 0], side)
    hits = [surface.closest(stroke.position) for stroke in strokes]
    charted = [i for i, stroke in enumerate(strokes) if not stroke.closed]
    # A stroke that knows no surface may be anywhere: the closest points say where it is over.
    at = [strokes[i].position if strokes[i].bound else hits[i].position for i in charted]
    upward = (signs * ends.normal[:, 0])[charted]
    places = dict(zip(charted, _places(surface, ends.position[charted], at, upward), strict=True))
    return [
        _footing(
            stroke,
            surface,
            reference,
            ClosestPoints(ends.position[i], ends.normal[i], ends.distance[i], ends.face[i]),
            hits[i],
            float(signs[i, 0]),
            places.get(i, _CLOSED),
        )
        for i, stroke in enumerate(strokes)
    ]


def _footing(
    stroke: ReportedStroke,
    surface: Surface,
    reference: ReportedStroke | None,
    ends: ClosestPoints,
    hits: ClosestPoints,
    sign: float,
    place: "_Place",
) -> SurfacePlacement:
    foot, normal = hits.position, sign * hits.normal

    def closest(points: Floats) -> tuple[Floats, Floats]:
        if points is stroke.position:
            return foot, normal
        there = surface.closest(points)
        return there.position, sign * there.normal

    length, uv = place.length, place.uv
    demonstrated = None if length is None else _as_drawn(reference, stroke, length)
    off = None
    # The original model has no w: it does not know what off the surface means.
    if demonstrated is not None and uv is not None and stroke.bound:
        off = measure.height_there(uv, demonstrated)
    height = measure.height(stroke.position, closest)
    offset = 0.0 if stroke.over is None else stroke.over.offset
    band = CONTACT if stroke.over is None else max(stroke.over.band, ON)
    touching, lift = measure.contact(stroke.position, height - offset, band)
    return SurfacePlacement(
        foot,
        normal,
        height,
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
        band,
        touching,
        lift,
        sign * ends.normal,
        place.remark,
    )


def _as_drawn(
    reference: ReportedStroke | None, stroke: ReportedStroke, length: float
) -> Floats | None:
    """Demonstration in its chart as a stroke of this length draws it, shape (m, 3)."""
    if reference is None:
        return None
    reference = reference.seen_for(stroke)
    if reference.chart is None or reference.closed or reference.elsewhere:
        return None
    place = np.asarray(reference.chart * [length / reference.length, 1.0, 1.0])
    return as_drawn(place, stroke.over)


@dataclass(frozen=True)
class _Place:
    """Geodesic distance of the ends, chart coordinates of the feet, and why there are none."""

    length: float | None
    uv: Floats | None
    remark: str | None


_OF_THE_STRIP = (Status.FOLDED, Status.LOST, Status.TORN, Status.MISSED, Status.TILTED)

_CLOSED = _Place(None, None, "closed, so there is no line to measure waves from")


def _places(surface: Surface, ends: Floats, at: Sequence[Floats], normal: Floats) -> list[_Place]:
    """Places of b strokes with ends (b, 2, 3), points (n, 3) each and normals (b, 3) at the starts.

    Shorter strokes are filled up with their last point.
    """
    if not at:
        return []
    charts = surface.charts(ends[:, 0], ends[:, 1], normal)
    most = max(len(points) for points in at)
    found = invert(charts, np.stack([np.pad(p, ((0, most - len(p)), (0, 0)), "edge") for p in at]))
    places = []
    for i, first in enumerate(charts.status):
        if first != Status.DRAWN:
            places.append(_Place(None, None, Status(first).reason))
            continue
        length, count = float(charts.lengths[i]), len(at[i])
        if found.reached[i, :count].all():
            places.append(_Place(length, found.coordinates[i, :count, :2], None))
            continue
        places.append(_Place(length, None, _why(Status(found.status[i]))))
    return places


def _why(status: Status) -> str:
    """Say why places were not found; what was drawn facet by facet need not lie in one strip."""
    if status not in _OF_THE_STRIP:
        return status.reason
    return (
        f"it is read in the smooth strip chart, and there {status.reason}; a stroke that was drawn "
        "facet by facet may be right all the same"
    )

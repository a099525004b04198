"""A stroke: one curve of a file, with what is needed to measure and to draw it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.contact_heights import ContactHeights
from dmpcli.metrics.on_surface import wave_along
from dmpcli.metrics.wave_height import WaveHeights, stroke_wave
from dmpcli.records.learning_record import Lesson
from dmpcli.reporting.surface_placement import SurfacePlacement
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces import plane

NEAR = 1.0
"""Strokes whose starts and goals are this near to each other lie at the same place, mm."""

LEAST = 5
"""Fewer samples than this have no third derivative to speak of."""

_NONE = WaveHeights(np.empty(0), np.empty(0))


@dataclass(frozen=True)
class ReportedStroke:
    """One curve of a demonstration, a trajectory or a run.

    Attributes
    ----------
    label : str
        What tables and legends call it.
    kind : str
        The file's schema: ``demonstration``, ``trajectory`` or ``run``.
    role : str
        ``demonstration``, ``builtin``, ``reference``, ``original axis``, ``original distance``,
        ``modified``, ``run``: the key of its style and of the paper's tables.
    t : array, shape (n,)
        s, from 0.
    position : array, shape (n, 3)
        mm, base frame; of a demonstration as `fit` sees it: idle ends cut off, smoothed.
    raw : array, shape (n, 3)
        The same samples before smoothing.
    start, goal : array, shape (3,)
        Where it should begin and end, mm.
    axes : array, shape (3, 3), or None
        Chart axes along, across and off its plane as columns; None on a curved surface.
    closed : bool
    intended : bool
        Whether the file says where the stroke should begin and end.
    simulated : bool
        No arm was there.
    guide : array, shape (m, 3), optional
        The curve that a demonstration was dragged along, where the file tells it, mm.
    rotation : array, shape (n, 3, 3), optional
        Of the tool, of trajectories and runs that hold it.
    side : array, shape (3,), optional
        Normal on the tool's side where the stroke begins, as far as the file tells it.
    bound : bool
        Whether it was meant to lie on a surface: the original model knows none.
    staged : bool
        False for a recording of which nobody knows what was to be drawn: a person dragged.
    footing : SurfacePlacement, optional
        How the stroke lies on a surface that it was measured on.
    lesson : Lesson, optional
        How the skill that drew it saw its recordings; of a demonstration, how it is seen.
    seen_by : callable, optional
        A demonstration as another skill saw it.
    place : array, shape (n, 3), optional
        u, v, w of a demonstration on the surface that it was taught on, mm; else its plane's axes
        tell them.
    geodesic : float, optional
        Start-goal distance along that surface, mm.
    lost : tuple of float
        RMS and largest of what smoothing took off a demonstration beyond its noise, mm.
    noise : float
        Of a demonstration, standard deviation per axis, mm.
    elsewhere : bool
        Whether a demonstration was taught on a surface that is not at hand, so that nothing can be
        compared with it.
    by_skill : bool
        Whether its skill's own curve stands for a demonstration whose taught surface is not at
        hand; `lost` is by how much that curve strays from the recording.
    end_heights : tuple of float
        How far above start and goal it should begin and end, mm.
    aims : array, shape (2, 3), optional
        Those points, mm; None where the normals there are not known.
    over : ContactHeights, optional
        What was drawn of the skill's heights over a surface.
    size, turn : float
        Of a closed stroke, beside the demonstration's; rad.
    mark : dict, optional
        By how much the skill that drew it misses its tolerance; see `records.tolerance_mark`.
    """

    label: str
    kind: str
    role: str
    t: Floats
    position: Floats
    raw: Floats
    start: Floats
    goal: Floats
    axes: Floats | None
    closed: bool
    intended: bool
    simulated: bool
    guide: Floats | None = None
    rotation: Floats | None = None
    side: Floats | None = None
    bound: bool = True
    staged: bool = True
    footing: SurfacePlacement | None = None
    lesson: Lesson | None = None
    seen_by: "Callable[[Lesson], ReportedStroke] | None" = None
    place: Floats | None = None
    geodesic: float | None = None
    lost: tuple[float, float] = (0.0, 0.0)
    noise: float = 0.0
    elsewhere: bool = False
    by_skill: bool = False
    end_heights: tuple[float, float] = (0.0, 0.0)
    aims: Floats | None = None
    over: ContactHeights | None = None
    size: float = 1.0
    turn: float = 0.0
    mark: dict[str, float] | None = None

    @cached_property
    def wave(self) -> WaveHeights:
        """Its wave heights; on a curved surface along it. None for a line or a closed stroke."""
        if self.closed:
            return _NONE
        if self.place is not None:
            return wave_along(self.place[:, :2], self.length) or _NONE
        if self.axes is None:
            return (self.footing and self.footing.wave) or _NONE
        return stroke_wave(self.position, self.start, self.goal, self.axes[:, 2])

    @property
    def length(self) -> float:
        """Start-goal distance, along the surface that it was taught on, mm."""
        if self.geodesic is not None:
            return self.geodesic
        return float(np.linalg.norm(self.goal - self.start))

    @property
    def poses(self) -> Trajectory:
        """Where the tool is at each sample."""
        return Trajectory(self.t, self.position, self.rotation)

    def at_place_of(self, other: "ReportedStroke") -> bool:
        """Tell whether both strokes begin and end within 1 mm of each other."""
        apart = np.linalg.norm([self.start - other.start, self.goal - other.goal], axis=1)
        return bool(apart.max() <= NEAR)

    @cached_property
    def chart(self) -> Floats | None:
        """u, v, w in its own chart, shape (n, 3), mm; None where it has none."""
        return self.flat if self.place is None else self.place

    @cached_property
    def flat(self) -> Floats | None:
        """u, v, w on its plane, shape (n, 3), mm; None where it has none."""
        return None if self.axes is None else (self.position - self.start) @ self.axes

    def seen_for(self, other: "ReportedStroke") -> "ReportedStroke":
        """Return this demonstration as the skill saw it that drew another stroke."""
        if self.seen_by is None or other.lesson is None:
            return self
        return self.seen_by(other.lesson)

    def as_drawn_by(self, other: "ReportedStroke") -> Floats | None:
        """u, v, w of this demonstration as another stroke should have them, shape (n, 3), mm."""
        if self.chart is None or other.axes is None:
            return None
        stretch = 1.0 if self.closed or other.closed else other.length / self.length
        return as_drawn(self.chart * [stretch, 1.0, 1.0], other.over, other.size, other.turn)

    def carried_to(self, other: "ReportedStroke") -> Floats | None:
        """Positions with start, goal and plane laid upon another stroke's, shape (n, 3), mm."""
        place = self.as_drawn_by(other)
        if place is None or other.axes is None:
            return None
        return np.asarray(other.start + place @ other.axes.T)


def as_drawn(
    place: Floats, over: ContactHeights | None, size: float = 1.0, turn: float = 0.0
) -> Floats:
    """Chart coordinates of a demonstration as a stroke was to have them.

    Flat where it touches the surface; if closed, larger, and turned about the normal.

    Parameters
    ----------
    place : array, shape (n, 3)
        u, v, w, mm.
    over : ContactHeights or None
        What is drawn of its heights; None draws all of them.
    size : float
        Factor of u and v.
    turn : float
        From e_u towards e_v, rad.

    Returns
    -------
    array, shape (n, 3)
        mm.
    """
    if over is None and (size, turn) == (1.0, 0.0):
        return place
    c, s = np.cos(turn), np.sin(turn)
    u, v, w = place.T
    w = w if over is None else over.drawn(w)
    return np.column_stack([size * (c * u - s * v), size * (s * u + c * v), w])


def chart_axes(start: Floats, goal: Floats, normal: Floats, closed: bool) -> Floats:
    """Axes (3, 3) of a stroke's chart as columns: along, across and off the plane of a normal.

    Parameters
    ----------
    start, goal : array, shape (3,)
        mm; of a closed stroke they do not count.
    normal : array, shape (3,)
        On the tool's side, of any length.
    closed : bool
    """
    n = normal / np.linalg.norm(normal)
    if closed:
        return plane.closed_axes(n)
    return plane.open_axes((goal - start) / np.linalg.norm(goal - start), n)

"""What every surface offers, exact or meshed, and what a chart gives back.

A chart's coordinates are u along the geodesic from start to goal, v along the geodesic that
leaves it at a right angle, w off the surface, mm; its axes are C = [e_u e_v n] as columns, with
e_v = n × e_u (geodesic strip or Fermi coordinates: A. Gray, Tubes, 2nd ed., Birkhäuser 2004,
ch. 2).
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers


class Status(IntEnum):
    """Why a stroke cannot be drawn at a pair; `reason` and `remedy` put it in words."""

    DRAWN = 0
    COINCIDENT = 1
    OTHER_COMPONENT = 2
    OTHER_SIDE = 3
    NO_GEODESIC = 4
    BORDER = 5
    FOLDED = 6
    LOST = 7
    NOISY = 8
    TORN = 9
    MISSED = 10
    TILTED = 11
    OPPOSITE = 12
    FACES_AWAY = 13
    NEAR_BORDER = 20
    KEPT_OUT = 21

    @property
    def reason(self) -> str:
        """One clause for messages: what happened."""
        return _WORDS[self][0]

    @property
    def remedy(self) -> str:
        """One clause for messages: what to do."""
        return _WORDS[self][1]

    @property
    def said(self) -> str:
        """Reason and remedy."""
        return f"{self.reason}; {self.remedy}"


_WORDS = {
    Status.DRAWN: ("drawn", "nothing is to be done"),
    Status.COINCIDENT: ("start and goal are one point", "set them apart"),
    Status.OTHER_COMPONENT: (
        "start and goal are on parts of the mesh that are not joined",
        "give both on one part, or join the parts in the mesh",
    ),
    Status.OTHER_SIDE: (
        "start, goal or the stroke between is nearest to the other side of a thin wall",
        "move start and goal towards the tool, and keep the stroke off the wall's rim",
    ),
    Status.FACES_AWAY: (
        "the surface at the start faces away from the tool, which would stand inside the part",
        "turn the tool there with --start-orientation RX RY RZ, or begin where the part faces it",
    ),
    Status.NO_GEODESIC: (
        "no geodesic from start to goal was found in any heading: a corner, hole or gap is between",
        "move start or goal so that the way is clear",
    ),
    Status.BORDER: (
        "the stroke leaves the mesh or crosses a hole, or an edge where sheets touch",
        "move start and goal inwards, or draw until there with --on-border clip",
    ),
    Status.FOLDED: (
        "the chart folds: the stroke swings wider than the surface's curvature allows",
        "move start and goal to where the surface is flatter, or off its rounded rims",
    ),
    Status.LOST: (
        "the surface has a gap or a step beside the stroke",
        "keep the stroke off there, or mend the mesh",
    ),
    Status.NOISY: ("the stroke crosses a crease of a noisy scan", "smooth the scan first"),
    Status.TORN: (
        "the stroke is torn at a corner or a step of the mesh, on whose sides it goes on apart",
        "move start and goal so that it keeps off there",
    ),
    Status.MISSED: (
        "the stroke misses its start or goal by over 0.01 mm",
        "move them a little, off the edges of the mesh",
    ),
    Status.TILTED: (
        "normals lean off their facets by over 25°",
        "mesh the part more finely there",
    ),
    Status.OPPOSITE: (
        "start and goal are opposite points of the sphere, so that every heading leads there",
        "move one of them a little, to where the stroke is to run",
    ),
    Status.NEAR_BORDER: (
        "the stroke comes nearer to the border than --border-margin allows",
        "lower the margin, move start and goal inwards, or draw the rest with --on-border split",
    ),
    Status.KEPT_OUT: (
        "the stroke enters a region of --keep-out",
        "move start and goal, or draw around it with --on-border split",
    ),
}


LEAVES = (Status.BORDER, Status.NEAR_BORDER, Status.KEPT_OUT)
"""Of strokes that are drawable where they are not outside."""


@dataclass(frozen=True)
class ClosestPoints:
    """Closest points of a surface.

    Attributes
    ----------
    position : array, shape (..., 3)
        mm.
    normal : array, shape (..., 3)
        Unit normals, smooth across the facets of a mesh; the surface's own side.
    distance : array, shape (...,)
        mm.
    face : array of int, shape (...,)
        -1 on exact surfaces.
    """

    position: Floats
    normal: Floats
    distance: Floats
    face: Integers


@dataclass(frozen=True)
class Geodesics:
    """Ends of geodesics.

    Attributes
    ----------
    position, direction, normal : array, shape (..., 3)
        mm, and unit vectors there: the walk's own direction and the surface's normal.
    arrived : array of bool, shape (...,)
        False where the walk left the surface.
    """

    position: Floats
    direction: Floats
    normal: Floats
    arrived: Booleans


@dataclass(frozen=True)
class Connections:
    """Geodesics from A to B.

    Attributes
    ----------
    direction : array, shape (B, 3)
        Unit vectors at A.
    length : array, shape (B,)
        mm.
    status : array of int, shape (B,)
        `Status`.
    """

    direction: Floats
    length: Floats
    status: Integers


@dataclass(frozen=True)
class ChartImage:
    """Chart coordinates carried to the surface.

    Attributes
    ----------
    position : array, shape (B, T, 3)
        On the surface plus w n, mm.
    axes : array, shape (B, T, 3, 3)
        C at each point, columns e_u, e_v, n.
    outside : array of bool, shape (B, T)
        Points beyond the border of the surface; the positions there mean nothing.
    status : array of int, shape (B,)
        `Status`; positions of pairs other than DRAWN are not to be used, those of BORDER only
        where not `outside`.
    unfolded : array of bool, shape (B,)
        Pairs that cross a sharp crease and were walked from face to face.
    unsound : array of bool, shape (B, T), optional
        Of strokes that left the surface and came back: points that are not where they should be.
    """

    position: Floats
    axes: Floats
    outside: Booleans
    status: Integers
    unfolded: Booleans
    unsound: Booleans | None = None

    @property
    def normal(self) -> Floats:
        """Unit normals on the tool's side, shape (B, T, 3)."""
        return self.axes[..., 2]


class Charts(Protocol):
    """Charts of B start-goal pairs."""

    @property
    def lengths(self) -> Floats:
        """Geodesic distances from start to goal, mm, shape (B,); 0 for closed strokes."""
        ...

    @property
    def goals(self) -> Floats:
        """Chart coordinates of the goals, shape (B, 3): (length, 0, 0) for open strokes."""
        ...

    @property
    def status(self) -> Integers:
        """`Status` before any stroke is lifted, shape (B,)."""
        ...

    def __len__(self) -> int: ...

    def rows(self, rows: Integers) -> "Charts":
        """Return the charts of some of the pairs."""
        ...

    def over(self, points: Floats) -> Booleans:
        """Tell which points (B, T, 3) are over the charts' surface, not beside its border."""
        ...

    def lift(self, coordinates: Floats) -> ChartImage:
        """Carry chart coordinates (B, T, 3), mm, to the surface."""
        ...


class Surface(Protocol):
    """A surface to draw on, in the robot's base frame."""

    def closest(self, points: Floats) -> ClosestPoints:
        """Return the closest points to points (..., 3), mm."""
        ...

    def walk(self, origin: Floats, direction: Floats, length: Floats) -> Geodesics:
        """Walk geodesics from points on the surface.

        Parameters
        ----------
        origin : array, shape (..., 3)
            mm.
        direction : array, shape (..., 3)
            Tangent there, of any length; only its part square to the normal counts.
        length : array, shape (...,)
            mm; negative walks backwards, the direction keeps pointing forward.
        """
        ...

    def connect(self, start: Floats, goal: Floats) -> Connections:
        """Find geodesics between points on the surface.

        Parameters
        ----------
        start, goal : array, shape (B, 3)
            mm; each start with the goal of its row.
        """
        ...

    def charts(
        self,
        start: Floats,
        goal: Floats,
        side: Floats | None = None,
        closed: Floats | None = None,
    ) -> Charts:
        """Lay charts along the geodesics from start to goal.

        Parameters
        ----------
        start, goal : array, shape (B, 3)
            Near the surface; the closest points of it are taken, mm.
        side : array, shape (3,) or (B, 3), optional
            Towards the tool, from the work: the normal at the start has a positive part along it.
            None is base +z.
        closed : array, shape (3, 3), optional
            For closed strokes: the axes C of the plane they are in; e_u is turned to the tangent
            plane at the start by the smallest rotation.
        """
        ...


def towards(normal: Floats, side: Floats | None) -> Floats:
    """Signs (±1), shape (B, 1), that turn normals to the tool's side.

    Where that does not decide, the largest component is made positive, as on planes.

    Parameters
    ----------
    normal : array, shape (B, 3)
        Of length 1, base axes.
    side : array, shape (3,) or (B, 3), or None
        From the work to the tool; None is base +z.
    """
    wanted = np.array([0.0, 0.0, 1.0]) if side is None else side
    along = np.sum(normal * wanted, axis=-1, keepdims=True)
    largest = np.take_along_axis(normal, np.argmax(np.abs(normal), axis=-1)[..., None], axis=-1)
    return np.where(np.where(np.abs(along) < 1e-6, largest, along) > 0.0, 1.0, -1.0)


def first_refusal(*refusals: Integers) -> Integers:
    """Return the first status other than DRAWN of each pair."""
    result = refusals[0].copy()
    for status in refusals[1:]:
        result = np.where(result == Status.DRAWN, status, result)
    return result

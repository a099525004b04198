"""The true surface, as MuJoCo collides it.

A workpiece has a frame of its own: z is its normal at its origin, which lies on the surface, and x
leads along what is drawn. MuJoCo has planes, cylinders, boxes, convex bodies and height fields; a
mesh it takes for its convex hull. Any other surface is given by its closest point (`Traced`): the
pen then meets the plane that touches the surface there, step by step.
"""

import math
from dataclasses import dataclass, field
from typing import Protocol, TypeAlias

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp_one
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.surface import Surface

FAR = 2000.0
"""Further than an arm reaches, mm."""
_DEEP = 100.0  # mm, of a block's lower side

Element: TypeAlias = dict[str, str]
"""Attributes of an element of MuJoCo's model, in the workpiece's frame, m."""


def upright() -> Pose:
    """A frame at the base's origin, z up."""
    return Pose(np.zeros(3), np.eye(3))


class Workpiece(Protocol):
    """Something to draw on."""

    @property
    def pose(self) -> Pose:
        """Where its frame lies in the base frame, mm."""

    def geoms(self) -> list[Element]:
        """Return MuJoCo's geoms."""

    def assets(self) -> list[Element]:
        """Return the assets that they name, each with its kind as ``tag``."""


@dataclass(frozen=True)
class Nothing:
    """An empty bench."""

    pose: Pose = field(default_factory=upright)

    def geoms(self) -> list[Element]:
        """There are none."""
        return []

    def assets(self) -> list[Element]:
        """There are none."""
        return []


@dataclass(frozen=True)
class Flat(Nothing):
    """An endless plane."""

    def geoms(self) -> list[Element]:
        """One plane."""
        return [_ground()]

    @property
    def surface(self) -> Plane:
        """The same as geometry, in the base frame."""
        return Plane(self.pose.position, self.pose.rotation[:, 2])


@dataclass(frozen=True)
class Round(Nothing):
    """A cylinder, touched from outside; its axis is the frame's y.

    Attributes
    ----------
    radius : float
        mm.
    """

    radius: float = 60.0

    def geoms(self) -> list[Element]:
        """One cylinder."""
        return [
            {
                "type": "cylinder",
                "size": _metres(self.radius, FAR),
                "pos": _metres(0.0, 0.0, -self.radius),
                "euler": f"{math.pi / 2!r} 0 0",
            }
        ]

    @property
    def surface(self) -> Cylinder:
        """The same as geometry, in the base frame."""
        R = self.pose.rotation
        return Cylinder(self.pose.position - self.radius * R[:, 2], R[:, 1], self.radius)


@dataclass(frozen=True)
class Edge(Nothing):
    """A flat part that ends.

    Attributes
    ----------
    at : float
        Where, mm along x.
    """

    at: float = 50.0

    def geoms(self) -> list[Element]:
        """One block."""
        return [_block(-FAR, self.at, 0.0)]


@dataclass(frozen=True)
class Step(Edge):
    """A flat part that goes on higher, behind a wall, or lower.

    Attributes
    ----------
    height : float
        mm; below 0 it goes down.
    """

    height: float = -3.0

    def geoms(self) -> list[Element]:
        """Two blocks."""
        return [_block(-FAR, self.at, 0.0), _block(self.at, FAR, self.height)]


@dataclass(frozen=True)
class Slot(Edge):
    """A flat part with a slot across x.

    Attributes
    ----------
    width, depth : float
        mm.
    """

    width: float = 10.0
    depth: float = 20.0

    def geoms(self) -> list[Element]:
        """Both sides, and the ground between."""
        far = self.at + self.width
        return [
            _block(-FAR, self.at, 0.0),
            _block(far, FAR, 0.0),
            _block(self.at, far, -self.depth),
        ]


@dataclass(frozen=True)
class Ramp(Step):
    """A flat part that goes on higher, behind a ramp.

    Attributes
    ----------
    slope : float
        Of the ramp, rad.
    """

    height: float = 3.0
    slope: float = math.radians(30.0)

    def geoms(self) -> list[Element]:
        """The ground, the ramp and what is behind it."""
        end = self.at + self.height / math.tan(self.slope)
        ramp = {"type": "mesh", "mesh": "ramp"}
        return [_ground(), ramp, _block(end, FAR, self.height)]

    def assets(self) -> list[Element]:
        """The ramp, a prism."""
        end = self.at + self.height / math.tan(self.slope)
        profile = [(self.at, 0.0), (end, self.height), (end, -1.0), (self.at, -1.0)]
        corners = [value for x, z in profile for y in (-FAR, FAR) for value in (x, y, z)]
        return [{"tag": "mesh", "name": "ramp", "vertex": _metres(*corners)}]


@dataclass(frozen=True)
class HeightField(Nothing):
    """Heights on an even grid around the origin; each cell is two triangles.

    Attributes
    ----------
    heights : array, shape (rows, columns)
        mm; rows lie along y, columns along x.
    half : tuple of float
        Half of the grid's extent along x and y, mm.
    """

    heights: Floats = field(default_factory=lambda: np.zeros((2, 2)))
    half: tuple[float, float] = (100.0, 100.0)

    def geoms(self) -> list[Element]:
        """One height field; MuJoCo's begins at its lowest point."""
        return [{"type": "hfield", "hfield": "field", "pos": _metres(0.0, 0.0, self._lowest)}]

    def assets(self) -> list[Element]:
        """Its heights, as shares of their span."""
        span = max(float(np.ptp(self.heights)), 1e-3)
        rows, columns = self.heights.shape
        # MuJoCo's first row is the last one written.
        shares = ((self.heights - self._lowest) / span)[::-1]
        return [
            {
                "tag": "hfield",
                "name": "field",
                "nrow": str(rows),
                "ncol": str(columns),
                "size": _metres(*self.half, span, _DEEP),
                "elevation": " ".join(repr(float(share)) for share in shares.ravel()),
            }
        ]

    @property
    def _lowest(self) -> float:
        return float(self.heights.min())


@dataclass(frozen=True)
class DistanceField(Nothing):
    """A closed mesh by MuJoCo's own signed distance, an interpolated octree.

    Attributes
    ----------
    V : array, shape (n, 3)
        In the workpiece's frame, mm.
    F : array of int, shape (m, 3)
    """

    V: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    F: Integers = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))

    def geoms(self) -> list[Element]:
        """One geom; MuJoCo moves a mesh's origin to its centre, and the geom with it."""
        return [{"type": "sdf", "mesh": "part"}]

    def assets(self) -> list[Element]:
        """The mesh."""
        return [
            {
                "tag": "mesh",
                "name": "part",
                "vertex": _metres(*self.V.ravel()),
                "face": " ".join(map(str, self.F.ravel().tolist())),
            }
        ]


@dataclass(frozen=True)
class Traced(Nothing):
    """Any surface, by the closest point to the pen's tip.

    Attributes
    ----------
    shape : Surface, optional
        In the workpiece's frame; its normals are on the pen's side.
    """

    shape: Surface | None = None

    def under(self, point: Floats) -> Pose | None:
        """Return the frame that touches the surface below a point, z outwards; both in base axes.

        Parameters
        ----------
        point : array, shape (3,)
            mm, base frame.

        Returns
        -------
        Pose or None
            None where there is no surface: beyond the border of a mesh.
        """
        assert self.shape is not None
        inside = np.ascontiguousarray(self.pose.apply_inverse(point[None]))
        hit = self.shape.closest(inside)
        beyond = getattr(self.shape, "beyond_border", None)
        if beyond is not None and bool(beyond(inside, hit.position, hit.face)[0]):
            return None
        across = np.array([1.0, 0.0, 0.0]) if abs(hit.normal[0, 0]) < 0.9 else np.eye(3)[1]
        return self.pose @ placed(hit.position[0], hit.normal[0], across)


def placed(point: Floats, normal: Floats, along: Floats) -> Pose:
    """Return the frame at a point whose z is a normal and whose x is nearest to a direction.

    Parameters
    ----------
    point : array, shape (3,)
        mm.
    normal, along : array, shape (3,)
        Unit vector; any length.
    """
    x = along - (along @ normal) * normal
    x = x / np.linalg.norm(x)
    return Pose(point.copy(), np.column_stack([x, np.cross(normal, x), normal]))


def moved(pose: Pose, offset: float, tilt: float, about: float) -> Pose:
    """Displace a workpiece along its normal, and tilt it about a line in its surface.

    Parameters
    ----------
    pose : Pose
    offset : float
        mm, outwards.
    tilt, about : float
        rad; direction of the line, from the frame's x.
    """
    R = pose.rotation
    axis = R @ np.array([math.cos(about), math.sin(about), 0.0])
    return Pose(pose.position + offset * R[:, 2], exp_one(tilt * axis) @ R)


def _ground() -> Element:
    return {"type": "plane", "size": _metres(FAR, FAR, _DEEP)}


def _block(begin: float, end: float, top: float) -> Element:
    """A block from one x to another, as wide as the arm reaches."""
    return {
        "type": "box",
        "size": _metres(0.5 * (end - begin), FAR, 0.5 * (_DEEP + top)),
        "pos": _metres(0.5 * (begin + end), 0.0, 0.5 * (top - _DEEP)),
    }


def _metres(*lengths: float) -> str:
    return " ".join(repr(float(length) / 1e3) for length in lengths)

"""A surface of any shape as something solid to touch."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.surface import Surface, towards

_DEEPEST = 20.0
"""mm: whatever lies deeper is not in this surface but behind another one."""


@dataclass(frozen=True)
class SpringWorkpiece:
    """A workpiece whose surface pushes back like a spring; a `mock.contact.Solid`.

    Attributes
    ----------
    surface : Surface
        In the base frame.
    sign : float
        1 where the surface's normals are on the tool's side, -1 where they are not.
    stiffness, damping, friction, sliding : float
        N/mm, N·s/mm, 1 and mm/s; as of `dmpcli.simulation.mock.Plate`.
    """

    surface: Surface
    sign: float = 1.0
    stiffness: float = 5.0
    damping: float = 0.01
    friction: float = 0.2
    sliding: float = 5.0

    def under(self, position: Floats) -> tuple[float, Floats]:
        """Return the depth of a point in the part, mm, and the normal there."""
        point = np.ascontiguousarray(position[None])
        hit = self.surface.closest(point)
        normal = self.sign * hit.normal[0]
        depth = float((hit.position[0] - position) @ normal)
        beside = isinstance(self.surface, Mesh) and bool(
            self.surface.beyond_border(point, hit.position, hit.face)[0]
        )
        return (-1.0 if beside or depth > _DEEPEST else depth), normal


def facing(surface: Surface, position: Floats, tool_axis: Floats) -> SpringWorkpiece:
    """Return a part whose normals are on the side of a tool.

    Parameters
    ----------
    surface : Surface
    position, tool_axis : array, shape (3,)
        Where the tool is, mm, and its axis into the work.
    """
    normal = surface.closest(position[None]).normal
    return SpringWorkpiece(surface, sign=float(towards(normal, -tool_axis)[0, 0]))

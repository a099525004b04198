"""Triangle meshes as surfaces: geodesics and charts on their geometry."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.surfaces import mesh_charts as charts
from dmpcli.surfaces.strip_grid import Centre
from dmpcli.surfaces.surface import Connections, Geodesics, Status
from dmpcli.surfaces.triangle_mesh import TriangleMesh


class Mesh(TriangleMesh):
    """A triangle mesh in the robot's base frame, to draw on; see `TriangleMesh` and `Surface`."""

    def walk(self, origin: Floats, direction: Floats, length: Floats) -> Geodesics:
        """Walk geodesics, see `Surface`."""
        return charts.walk(self, origin, direction, length)

    def connect(self, start: Floats, goal: Floats) -> Connections:
        """Find geodesics, see `Surface`; not always the shortest of several."""
        a, b = self.closest(start), self.closest(goal)
        part = self.components[a.face]
        apart = np.where(part == self.components[b.face], Status.DRAWN, Status.OTHER_COMPONENT)
        ones = np.ones((len(part), 1))
        centre = Centre(a.position, a.normal, a.normal, ones, ones, part)
        link = charts.connect(self, centre, b.position, apart)
        return Connections(link.direction, link.length, link.status)

    def charts(
        self, start: Floats, goal: Floats, side: Floats | None = None, closed: Floats | None = None
    ) -> charts.MeshCharts:
        """Lay charts, see `Surface`."""
        return charts.mesh_charts(self, start, goal, side, closed)

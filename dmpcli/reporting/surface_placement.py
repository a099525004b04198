"""How a stroke lies on a surface, as measured from its points."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.metrics.wave_height import WaveHeights


@dataclass(frozen=True)
class SurfacePlacement:
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
        Chart coordinates, see `invert`, mm; of strokes that know no surface those of their feet.
        None where there is no chart, or it does not reach.
    wave : WaveHeights or None
        Along the surface; None where there is no chart.
    tilt : array, shape (n,), or None
        Angle between tool and normal, rad.
    demonstrated : array, shape (m, 3), or None
        The demonstration's u, v, w as drawn here: its u stretched to this stroke's start-goal
        distance, its w 0 where it was in contact, mm.
    band, touching, lift : float
        Within which height over what was drawn on purpose it is in contact, mm; share of the path
        that is; largest height of the rest, mm, 0 where there is none.
    ends : array, shape (2, 3)
        Normals on the tool's side where it should begin and end.
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
    band: float
    touching: float
    lift: float
    ends: Floats
    remark: str | None

    def aims(self, heights: tuple[float, float]) -> Floats:
        """Points so far above start and goal, shape (2, 3), mm."""
        above = np.asarray(heights)[:, None] * self.ends
        return np.asarray(np.stack([self.start, self.goal]) + above)

    @property
    def place(self) -> Floats | None:
        """Chart coordinates u, v and height of the samples, shape (n, 3), mm."""
        return None if self.uv is None else np.column_stack([self.uv, self.height])

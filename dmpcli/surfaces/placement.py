"""Where a surface lies, and which slip of unit or frame would explain points that miss it."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial import rotations
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.sphere import Sphere
from dmpcli.surfaces.surface import Surface


@dataclass(frozen=True)
class Slip:
    """What may have been meant otherwise, and how far off the points are if it was.

    Attributes
    ----------
    kind : {'points in m', 'other frame', 'pose in m', 'pose in degrees', 'pose in both', 'part'}
    distance : float
        mm, of the farthest point.
    scale : float
        Of the part, where that is what is wrong; else 1.
    """

    kind: str
    distance: float
    scale: float = 1.0


def box(surface: Surface) -> tuple[Floats, Floats] | None:
    """Least and largest coordinates of a bounded surface, (3,) each, mm; None of an endless one."""
    if isinstance(surface, Mesh):
        return surface.V.min(axis=0), surface.V.max(axis=0)
    if isinstance(surface, Sphere):
        return surface.centre - surface.radius, surface.centre + surface.radius
    return None


def slips(
    surface: Surface,
    given: Floats,
    in_part: bool,
    position: Floats,
    angles: Floats,
    scales: tuple[float, ...],
    tolerance: float,
) -> list[Slip]:
    """Find the slips that would bring points which miss a surface onto it, the best first.

    Parameters
    ----------
    surface : Surface
        As placed, base frame.
    given : array, shape (k, 3)
        Points as given, mm.
    in_part : bool
        Whether in the part's own axes, else in the base frame.
    position, angles : array, shape (3,)
        Of the pose that placed the surface, mm, and X-Y-Z Euler angles, rad.
    scales : tuple of float
        By which the part may be larger than was assumed.
    tolerance : float
        How near to the surface the points then must be, mm.

    Returns
    -------
    list of Slip
    """
    R = rotations.from_euler(angles)
    degrees = rotations.from_euler(np.radians(angles))

    def off(own: Floats, scale: float = 1.0) -> float:
        """Distance of points of the part's own frame, after all, from a part so much larger."""
        at = own / scale @ R.T + position
        return scale * float(surface.closest(at).distance.max())

    def seen(points: Floats, rotation: Floats, moved: Floats) -> Floats:
        return np.asarray((points - moved) @ rotation)

    own = given if in_part else seen(given, R, position)
    other = seen(given, R, position) if in_part else given
    thousand = 1000.0 * given
    found = [
        Slip("points in m", off(thousand if in_part else seen(thousand, R, position))),
        Slip("other frame", off(other)),
        *(Slip("part", off(own, scale), scale) for scale in scales),
    ]
    if not in_part:
        found += [
            Slip("pose in m", off(seen(given, R, 1000.0 * position))),
            Slip("pose in degrees", off(seen(given, degrees, position))),
            Slip("pose in both", off(seen(given, degrees, 1000.0 * position))),
        ]
    return sorted(
        (slip for slip in found if slip.distance <= tolerance), key=lambda slip: slip.distance
    )

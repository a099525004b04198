"""What is said of a start or goal off the surface: how far, the nearest point, the likely slip."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.workflows.surface_input import SurfaceInput

_NEAR = 1.0
"""Points within this many mm of the surface after all are taken for meant so."""


def distances(off: Mapping[str, float]) -> str:
    """Say which of some points lie how far off the surface, the farthest last: it is judged.

    Parameters
    ----------
    off : mapping
        mm by what messages call the point.
    """
    order = sorted(off, key=lambda name: round(off[name], 3))
    first = f"{order[0]} lies {off[order[0]]:.3f}"
    return f"{' and '.join([first, *(f'{name} {off[name]:.3f}' for name in order[1:])])} mm off"


def remedy(
    points: Mapping[str, "Floats"], read: "SurfaceInput", in_part: bool = False, form: str = "{}"
) -> str:
    """Say where the surface is instead, ready to paste, and what may have been mistaken.

    Parameters
    ----------
    points : mapping
        Points (3,) that lie off it, base frame, mm, by what messages call them.
    read : SurfaceInput
    in_part : bool
        Whether the points were given in the part's axes.
    form : str
        Of the name before its coordinates: ``--{}`` where they are options.
    """
    import numpy as np

    from dmpcli.surfaces.placement import box

    at = np.stack(list(points.values()))
    nearest = read.surface.closest(at).position
    shown = " ".join(
        f"{form.format(name)} {_shown(point)}" for name, point in zip(points, nearest, strict=True)
    )
    said = f"nearest on it (base): {shown}"
    if in_part and read.pose is not None:
        own = (nearest - read.pose.position) @ read.pose.rotation
        said += f", in the part {', '.join(_shown(point) for point in own)}"
    around = box(read.surface)
    if around is not None:
        spans = zip("xyz", *around, strict=True)
        said += "; its box there: " + ", ".join(
            f"{axis} {low:.1f} to {high:.1f}" for axis, low, high in spans
        )
    hint = _hint(at, read, in_part)
    return said if hint is None else f"{said}; {hint}"


def _hint(at: "Floats", read: "SurfaceInput", in_part: bool) -> str | None:
    import numpy as np

    from dmpcli.records.mesh import UNITS
    from dmpcli.spatial import rotations
    from dmpcli.surfaces.placement import slips

    position, angles = np.reshape(read.said_pose or np.zeros(6), (2, 3))
    others = {u: UNITS[u] / UNITS[read.unit] for u in UNITS if read.kind == "mesh"}
    scales = tuple(scale for scale in others.values() if scale != 1.0)
    given = (at - position) @ rotations.from_euler(angles) if in_part else at
    found = slips(read.surface, given, in_part, position, angles, scales, _NEAR)
    if not found:
        return None
    best = found[0]
    if best.kind == "part":
        unit = next(u for u, scale in others.items() if scale == best.scale)
        return (
            f"with the part in {unit} they lie on it: give --surface-unit {unit}, or surface_unit "
            "in a table of pairs?"
        )
    return {
        "points in m": "times 1000 they lie on it: are they in m? Lengths are in mm",
        "other frame": "as points of the base they lie on it: leave --in part out?"
        if in_part
        else "as points of the part they lie on it: give --in part?",
        "pose in m": "with X Y Z of the pose times 1000 they lie on it: is it in m, not mm?",
        "pose in degrees": "with RX RY RZ of the pose as degrees they lie on it: give rad "
        f"({_shown(np.radians(angles), 5)})?",
        "pose in both": "with the pose in m and degrees they lie on it: give mm and rad "
        f"({_shown(1000.0 * position)} {_shown(np.radians(angles), 5)})?",
    }[best.kind]


def _shown(values: "Floats", digits: int = 3) -> str:
    import numpy as np

    return " ".join(f"{value:.{digits}f}" for value in np.round(values, digits) + 0.0)

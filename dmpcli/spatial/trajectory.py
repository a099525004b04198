"""A trajectory: where a tool is, or shall be, at which time."""

from dataclasses import dataclass, field

import numpy as np

from dmpcli.arrays import Floats


@dataclass(frozen=True)
class Trajectory:
    """Poses of a tool along time; a batch that shares its times has a leading axis, B.

    Attributes
    ----------
    t : array, shape (T,)
        Increasing, s.
    position : array, shape (T, 3) or (B, T, 3)
        Of the TCP, mm, base frame.
    rotation : array, shape (T, 3, 3) or (B, T, 3, 3), or None
        Of the tool, where it is known.
    normal : array, shape (T, 3) or (B, T, 3), or None
        Unit normal of the surface, to the tool's side, where there is one.
    contact_force : array, shape (T, 3), or None
        What the work pushes the tool with at the TCP, base axes, N, where it was asked for.
    """

    t: Floats
    position: Floats
    rotation: Floats | None = None
    normal: Floats | None = None
    contact_force: Floats | None = field(default=None, kw_only=True)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def duration(self) -> float:
        """Seconds from the first to the last sample."""
        return float(self.t[-1] - self.t[0])

    @property
    def plane_normal(self) -> Floats | None:
        """Unit normal, shape (3,), of a trajectory on a plane; None where it turns or is unknown.

        Not for batches.
        """
        if self.normal is None or np.ptp(self.normal, axis=0).max() >= _LEVEL:
            return None
        return np.asarray(self.normal[0])


_LEVEL = 1e-6
"""Normals whose components differ by less than this are one."""

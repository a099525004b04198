"""A trajectory: where a tool is, or shall be, at which time."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.pose import Pose


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


@dataclass(frozen=True)
class StrokeTrajectory(Trajectory):
    """One stroke: a trajectory with its name, what is switched along it, and how hard it presses.

    Attributes
    ----------
    id : str
    first_row : int
        Row of the file that holds the first sample, counted from 1.
    facts : dict
        What the file says beside it; of a batch, with the start, goal and normal of its pair.
    events : tuple of OutputEvent
        What is switched along it, on the time of `t`.
    force : array, shape (T,), or None
        Set-point of the force along the normal, N; 0 where the tool is lifted.
    """

    id: str = ""
    first_row: int = 1
    facts: dict[str, Any] = field(default_factory=dict)
    events: tuple[OutputEvent, ...] = ()
    force: Floats | None = None

    def pose(self, index: int) -> Pose:
        """Pose of a sample; the stroke must state an orientation."""
        if self.rotation is None:
            raise ValueError("this stroke states no orientation")
        return Pose(self.position[index], self.rotation[index])


_LEVEL = 1e-6
"""Normals whose components differ by less than this are one."""

"""Poses: rigid motions of space, SE(3)."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import AnyArray, Floats
from dmpcli.spatial import rotations


@dataclass(frozen=True)
class Pose:
    """Where a frame lies in another: x_there = R x_here + position; many have leading axes.

    Attributes
    ----------
    position : array, shape (..., 3)
        mm.
    rotation : array, shape (..., 3, 3)
        R.
    """

    position: Floats
    rotation: Floats

    @classmethod
    def of(cls, six: Floats) -> "Pose":
        """Return the pose of X Y Z (mm) RX RY RZ (X-Y-Z Euler angles, rad), shape (6,)."""
        return cls(np.array(six[:3], dtype=float), rotations.from_euler(np.array(six[3:])))

    @classmethod
    def joined(cls, *poses: "Pose") -> "Pose":
        """Return several arrays of poses as one."""
        return cls(
            np.concatenate([some.position for some in poses]),
            np.concatenate([some.rotation for some in poses]),
        )

    def __len__(self) -> int:
        return len(self.position) if self.position.ndim > 1 else 1

    def __getitem__(self, rows: "AnyArray | slice") -> "Pose":
        return Pose(self.position[rows], self.rotation[rows])

    def __matmul__(self, other: "Pose") -> "Pose":
        """Return the pose of a frame that lies so in this one."""
        moved = (self.rotation @ other.position[..., None])[..., 0] + self.position
        return Pose(np.asarray(moved), np.asarray(self.rotation @ other.rotation))

    def inverse(self) -> "Pose":
        """Return where the other frame lies in this one."""
        back = np.swapaxes(self.rotation, -1, -2)
        return Pose(np.asarray(-(back @ self.position[..., None])[..., 0]), back)

    def apart(self, other: "Pose") -> tuple[float, float]:
        """Distance and angle from another pose, mm and rad; of single poses."""
        turn = rotations.log(other.rotation @ self.rotation.T)
        way = other.position - self.position
        return float(np.linalg.norm(way)), float(np.linalg.norm(turn))

    def apply(self, points: Floats) -> Floats:
        """Carry points (n, 3) of the frame, mm, out of it, shape (n, 3) or (B, n, 3)."""
        return np.asarray(points @ np.swapaxes(self.rotation, -1, -2) + self._beside)

    def apply_inverse(self, points: Floats) -> Floats:
        """Carry points (n, 3), mm, into the frame, shape (n, 3) or (B, n, 3)."""
        return np.asarray((points - self._beside) @ self.rotation)

    @property
    def _beside(self) -> Floats:
        return self.position if self.position.ndim == 1 else self.position[:, None]

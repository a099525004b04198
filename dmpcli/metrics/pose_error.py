"""How two trajectories differ pose by pose: absolute and relative pose error, and alignment.

The figures are those of evo, which compares trajectories of vehicles and cameras: each is the same
to rounding.

References
----------
.. [1] J. Sturm et al.: A benchmark for the evaluation of RGB-D SLAM systems. IROS (2012) 573-580.
.. [2] S. Umeyama: Least-squares estimation of transformation parameters between two point
   patterns. IEEE Trans. Pattern Analysis and Machine Intelligence 13 (1991) 376-380.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.trajectory import Trajectory

MOST_APART = 0.01
"""Samples farther apart in time than this are no pair, s."""

_LEAST = 3


@dataclass(frozen=True)
class PoseErrors:
    """What differs between n pairs of poses.

    Attributes
    ----------
    position : array, shape (n,)
        mm.
    rotation : array, shape (n,), or None
        rad; None where one of the trajectories has no orientation.
    """

    position: Floats
    rotation: Floats | None


@dataclass(frozen=True)
class RigidAlignment:
    """The similarity that brings an estimate nearest to a reference: scale R x + position.

    Attributes
    ----------
    pose : Pose
    scale : float
    """

    pose: Pose
    scale: float = 1.0

    def apply(self, estimate: Trajectory) -> Trajectory:
        """Return the estimate carried to the reference."""
        turned = None if estimate.rotation is None else self.pose.rotation @ estimate.rotation
        return Trajectory(estimate.t, self.pose.apply(self.scale * estimate.position), turned)


def associate(
    reference: Floats, estimate: Floats, most: float = MOST_APART
) -> tuple[Integers, Integers]:
    """Pair samples of two trajectories by time: each of the shorter with the nearest of the other.

    Parameters
    ----------
    reference, estimate : array, shape (n,) and (m,)
        Increasing, s, by one clock.
    most : float
        s.

    Returns
    -------
    tuple of array of int, shape (k,) each
        Rows of the reference and of the estimate.
    """
    if len(estimate) > len(reference):
        few, many = _nearest(reference, estimate, most)
        return few, many
    few, many = _nearest(estimate, reference, most)
    return many, few


def _nearest(few: Floats, many: Floats, most: float) -> tuple[Integers, Integers]:
    """Rows of `few` that have a sample within `most` of `many`, and those samples' rows."""
    after = np.minimum(np.searchsorted(many, few, side="right"), len(many) - 1)
    before = np.maximum(after - 1, 0)
    later = many[after] - few
    earlier = np.where(after > 0, few - many[before], np.inf)
    chosen = np.where((later <= most) & (later < earlier), after, before)
    found = np.flatnonzero(
        np.minimum(np.where(later < earlier, later, earlier), most + 1.0) <= most
    )
    within = (few >= many[0] - most) & (few <= many[-1] + most)
    found = found[within[found]]
    return found, np.asarray(chosen[found])


def alignment(reference: Floats, estimate: Floats, scaled: bool = False) -> RigidAlignment | None:
    """Return the motion of space that brings points nearest to others in the mean square [2].

    Parameters
    ----------
    reference, estimate : array, shape (n, 3)
        Pairs of points, mm.
    scaled : bool
        Whether the estimate may also be made larger or smaller.

    Returns
    -------
    RigidAlignment or None
        None where many are as good: fewer than three points, or points on one line.
    """
    if len(reference) < _LEAST:
        return None
    there, here = reference.mean(axis=0), estimate.mean(axis=0)
    a, b = reference - there, estimate - here
    U, size, V = np.linalg.svd(a.T @ b / len(a))
    if size[1] <= 1e-9 * max(size[0], np.finfo(float).tiny):
        return None
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(U) * np.linalg.det(V))])
    R = (U * sign) @ V
    scale = float((size * sign).sum() / np.mean((b * b).sum(axis=1))) if scaled else 1.0
    return RigidAlignment(Pose(there - scale * (R @ here), R), scale)


def absolute(reference: Trajectory, estimate: Trajectory) -> PoseErrors:
    """Absolute pose error (APE): how far each pose of n pairs is from its like.

    Parameters
    ----------
    reference, estimate : Trajectory
        Of n samples each, paired.
    """
    apart = np.linalg.norm(estimate.position - reference.position, axis=1)
    if reference.rotation is None or estimate.rotation is None:
        return PoseErrors(apart, None)
    return PoseErrors(apart, _angle(_transposed(reference.rotation) @ estimate.rotation))


def relative(reference: Trajectory, estimate: Trajectory) -> PoseErrors:
    """Relative pose error (RPE) from each pose of n pairs to the next [1], n - 1 of them.

    Where one has no orientation its steps are compared in base axes.

    Parameters
    ----------
    reference, estimate : Trajectory
        Of n samples each, paired; n ≥ 2.
    """
    if reference.rotation is None or estimate.rotation is None:
        step = np.diff(estimate.position, axis=0) - np.diff(reference.position, axis=0)
        return PoseErrors(np.linalg.norm(step, axis=1), None)
    there, here = _steps(reference), _steps(estimate)
    # Of the motion from one step to the other, E = Q⁻¹ P: its length does not depend on Q's turn.
    step = np.linalg.norm(here.position - there.position, axis=1)
    return PoseErrors(step, _angle(_transposed(there.rotation) @ here.rotation))


def _steps(one: Trajectory) -> Pose:
    """Motions from each pose to the next, in the frame of the first, n - 1 of them."""
    assert one.rotation is not None
    back = _transposed(one.rotation[:-1])
    moved = (back @ np.diff(one.position, axis=0)[:, :, None])[:, :, 0]
    return Pose(np.asarray(moved), np.asarray(back @ one.rotation[1:]))


def _transposed(R: Floats) -> Floats:
    return np.asarray(np.swapaxes(R, -1, -2))


def _angle(R: Floats) -> Floats:
    """Angles of rotations (n, 3, 3), rad."""
    return np.asarray(np.linalg.norm(rotations.log(R), axis=1))


def summary(errors: Floats) -> dict[str, float]:
    """Describe errors (n,), n ≥ 1, in their unit, and its square for `sse`."""
    return {
        "rmse": float(np.sqrt(np.mean(errors**2))),
        "mean": float(errors.mean()),
        "median": float(np.median(errors)),
        "std": float(errors.std()),
        "min": float(errors.min()),
        "max": float(errors.max()),
        "sse": float((errors**2).sum()),
    }

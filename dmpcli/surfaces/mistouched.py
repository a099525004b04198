"""Mistouched points: each shall show in its own residual, and not in those of all others."""

import numpy as np
from scipy.optimize import least_squares

from dmpcli.arrays import Floats
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.conditioning import radius_of
from dmpcli.surfaces.pose_bound import LEAST_NOISE
from dmpcli.surfaces.pose_search import Closest, signed

_OUTLIER = 6.0
"""Residuals beyond this many robust standard deviations are kept from dominating the pose."""


def steadied(touched: Floats, closest: Closest, best: Pose) -> Pose:
    """Return a pose that mistouched points do not dominate; the same where there are none.

    Parameters
    ----------
    touched : array, shape (n, 3)
        Base frame, mm.
    closest : callable
    best : Pose
        One, of least squares.
    """
    rotation, position = best.rotation[0], best.position[0]
    centre = touched.mean(axis=0)
    arms = touched - centre
    radius = radius_of(arms)

    def offsets(x: Floats) -> tuple[Floats, Floats, Floats]:
        """Signed distances of the points turned by x[3:]/radius about c and moved by x[:3].

        With them their gradients and the turned arms, base axes.
        """
        turned = arms @ rotations.exp(x[3:] / radius).T
        in_part = (turned + centre + x[:3] - position) @ rotation
        distance, gradient = signed(in_part, closest)
        return distance, gradient @ rotation.T, turned

    def distances(x: Floats) -> Floats:
        return offsets(x)[0]

    def jacobian(x: Floats) -> Floats:
        _, gradient, turned = offsets(x)
        turn = np.cross(turned, gradient) @ _left_jacobian(x[3:] / radius) / radius
        return np.concatenate([gradient, turn], axis=1)

    x = np.zeros(6)
    for _ in range(2):
        now = np.abs(distances(x))
        # The median of absolute deviations, as a normal distribution's standard deviation.
        scale = max(1.4826 * float(np.median(now)), LEAST_NOISE)
        if now.max() <= _OUTLIER * scale:
            break
        x = least_squares(
            distances,
            x,
            jac=jacobian,
            loss="soft_l1",
            f_scale=scale,
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
            max_nfev=200,
        ).x
    # The touched points were moved onto the part: the part moves the other way.
    R = rotations.exp(-x[3:] / radius)
    return Pose((R @ (position - x[:3] - centre) + centre)[None], (R @ rotation)[None])


def _left_jacobian(rotvec: Floats) -> Floats:
    """J of Exp(ω + δ) = Exp(J δ) Exp(ω) to first order (G. Chirikjian, 2012, ch. 10)."""
    angle = float(np.linalg.norm(rotvec))
    K = rotations.skew(rotvec)
    if angle < 1e-4:
        return np.asarray(np.eye(3) + K / 2.0 + K @ K / 6.0)
    return np.asarray(
        np.eye(3)
        + (1.0 - np.cos(angle)) / angle**2 * K
        + (angle - np.sin(angle)) / angle**3 * (K @ K)
    )

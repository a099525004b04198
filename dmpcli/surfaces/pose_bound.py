"""How far a found pose may be from the true one, at any point of the part, and what rivals it.

Near the best fit the sum of squares grows with the square of the motion, and the displacement of a
point of the part by the true pose keeps within an ellipsoid with probability 1 - α: its half axes
are those of the point's covariance times √(3 F(3, ν)), ν the degrees of freedom left to the
residuals (G. Seber, C. Wild, Nonlinear Regression, Wiley 1989, ch. 5). Where touches lie by edges
the sum of squares has valleys that its curvature at the best fit does not show: so poses to both
sides of it are tried too, each with the rest of the motion left free, and those that fit as well
count as the ellipsoid does.
"""

import numpy as np
from scipy.special import fdtri

from dmpcli.arrays import Floats
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.conditioning import PointConditioning
from dmpcli.surfaces.pose_search import Closest, descended

LIKELY, SURE = 0.95, 0.999
"""Confidence of the bound, and of a rival's refusal."""

LEAST_NOISE = 0.02
"""mm. A few touched points can fit by luck; no arm touches a part more exactly than this."""

_TRIED = (0.35, 0.7, 1.0, 1.6, 3.0)
"""Displacements to each side at which the fit is tried, in units of the limit."""
_STEPS = 12


def variance(squares: float, spare: int) -> float:
    """Variance of the touched points, mm²: from the residuals, but not below what arms can do."""
    return max(squares / spare, LEAST_NOISE**2)


def likely_rise(squares: float, spare: int) -> float:
    """Rise of the sum of squares, mm², within which a point of the part is with `LIKELY`."""
    return float(3.0 * fdtri(3, spare, LIKELY) * variance(squares, spare))


def sure_rise(squares: float, spare: int) -> float:
    """Rise of the sum of squares, mm², beyond which a pose is out of question with `SURE`."""
    return float(6.0 * fdtri(6, spare, SURE) * variance(squares, spare))


def displacement(of: Pose, one: Pose, extreme: Floats) -> Floats:
    """Largest distance, mm, shape (B,), between points of the part in B poses and in one.

    Parameters
    ----------
    of, one : Pose
    extreme : array, shape (m, 3)
        Points of the part that span its convex hull: one of them moves most.
    """
    apart = of.apply(extreme) - one.apply(extreme)
    return np.asarray(np.linalg.norm(apart, axis=2).max(axis=1))


def ellipsoid(
    conditioning: PointConditioning, points: int, squares: float, spare: int, at: Floats
) -> float:
    """Bound on the displacement at any of some points, with the curvature at the best fit.

    Parameters
    ----------
    conditioning : PointConditioning
    points : int
        How many were touched.
    squares : float
        Sum of squared residuals, mm².
    spare : int
        Degrees of freedom that are left to them.
    at : array, shape (m, 3)
        Points of the part, base frame, mm.

    Returns
    -------
    float
        mm.
    """
    gains = np.maximum(conditioning.gains, 1e-12)
    # The motions whose sum of squares rises by 1, as columns.
    unit = conditioning.motions.T / (gains * np.sqrt(points))
    moved = _moved(unit, at, conditioning)
    longest = np.linalg.svd(moved, compute_uv=False)[:, 0].max()
    return float(np.sqrt(likely_rise(squares, spare)) * longest)


def beside(
    touched: Floats,
    closest: Closest,
    best: Pose,
    conditioning: PointConditioning,
    extreme: Floats,
    limit: float,
) -> tuple[Pose, Floats]:
    """Find the best fits at some displacements from a pose, along each of six motions.

    Parameters
    ----------
    touched : array, shape (n, 3)
        Base frame, mm.
    closest : callable
    best : Pose
        One.
    conditioning : PointConditioning
        At it.
    extreme : array, shape (m, 3)
        See `displacement`.
    limit : float
        Of the displacement that matters, mm.

    Returns
    -------
    poses : Pose
    squares : array
        Sums of squared distances, mm².
    """
    motions = np.concatenate([conditioning.motions, -conditioning.motions])
    reach = np.linalg.norm(_moved(motions.T, best.apply(extreme)[0], conditioning), axis=1)
    step = motions * (limit / np.maximum(reach.max(axis=0), 1e-12))[:, None]
    steps = np.concatenate([share * step for share in _TRIED])
    turn = rotations.exp(steps[:, 3:] / conditioning.radius)
    centre = conditioning.centre
    position = (turn @ (best.position[0] - centre)) + centre + steps[:, :3]
    starts = Pose(position, turn @ best.rotation)
    return descended(touched, closest, starts, _STEPS, np.tile(motions, (len(_TRIED), 1)))


def _moved(motions: Floats, at: Floats, conditioning: PointConditioning) -> Floats:
    """Displacements (m, 3, k) of points (m, 3) by motions (v, ω·radius), the columns (6, k)."""
    arms = (at - conditioning.centre)[:, :, None] / conditioning.radius
    turned = np.cross(motions[None, 3:], arms, axis=1)
    return np.asarray(motions[None, :3] + turned)

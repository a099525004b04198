"""Where a part lies: its pose in the base frame from points touched on it.

Point pairs are solved in closed form (W. Kabsch, Acta Crystallographica A32 (1976) 922; scipy's
`Rotation.align_vectors`). Points touched anywhere are laid onto the surface from many starts
(`pose_search`); the best pose stands only with its rival and the bound on its error beside it
(`pose_bound`). docs/registration.md says why no ready ICP was taken.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces import pose_bound, pose_search
from dmpcli.surfaces.conditioning import (
    PointConditioning,
    conditioning_of,
    radius_of,
    refuse_unseen,
)
from dmpcli.surfaces.mistouched import steadied
from dmpcli.surfaces.pose_search import Closest

if TYPE_CHECKING:
    from dmpcli.surfaces.mesh import Mesh

MIN_PAIRS = 3
MIN_TOUCHED = 7
"""Six points fix a pose and leave nothing to judge it by."""

LIMIT = 1.5
"""mm. Poses that differ by more than this somewhere on the part are different ones."""

START_SHIFT, START_TURN = 15.0, np.radians(15.0)
"""How far about a rough pose the starts are spread, mm and rad ..."""
STARTS = 200
"""... and how many they are."""
ORIENTATIONS = 768
"""Starts over all orientations, about 22° from one to the next."""

_FACING = 0.3
"""Cosine above which a touch came out of the part rather than onto it; edges blur their normals."""
_MOST_ASTRAY = 0.2
"""Share of touches out of the part from which on the directions, not the pose, are wrong."""
_LEAST_SHIFT = 0.1
"""mm. Points that lie less to one side of the surface on average are not told of."""
_SMALL = 50.0
"""Points within this part of the part's size are in another unit, or tell nothing."""
_PLACES = 2000
"""Faces, the largest, whose middles stand for where a part can be touched."""


@dataclass(frozen=True)
class Rival:
    """Another pose that fits the touched points best but one.

    Attributes
    ----------
    rotation, position : array, shape (3, 3) and (3,)
    rms : float
        Of its distances, mm.
    apart : float
        Largest distance from the best pose at any point of the part, mm.
    turned : float
        Angle between the two, rad.
    near : bool
        Whether it fits nearly as well: it is not out of question with `pose_bound.SURE`.
    place : array, shape (3,)
        Point of the part in the best pose, base frame, mm, furthest from the other's surface.
    difference : float
        How far, mm.
    """

    rotation: Floats
    position: Floats
    rms: float
    apart: float
    turned: float
    near: bool
    place: Floats
    difference: float


@dataclass(frozen=True)
class Registration:
    """A part's pose and how well it is known: x_base = R x_part + position.

    Attributes
    ----------
    rotation : array, shape (3, 3)
        R.
    position : array, shape (3,)
        mm.
    residual : array, shape (n,)
        Distance of each touched point from its pair, or from the surface, mm.
    conditioning : PointConditioning
    spare : int
        Degrees of freedom that are left to the residuals.
    uncertainty : float
        Bound on the displacement at any point of the part, mm, with `pose_bound.LIKELY`.
    rival : Rival or None
        The runner-up; None where no other was found.
    directed : bool
        Whether directions of approach were used: given, and not against the part.
    outside : float
        Where all points lie off the surface to one side, their mean distance, mm, positive along
        its normals; else 0. No motion of the part does that: it is the tip's radius.
    """

    rotation: Floats
    position: Floats
    residual: Floats
    conditioning: PointConditioning
    spare: int
    uncertainty: float
    rival: Rival | None = None
    directed: bool = False
    outside: float = 0.0

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, mm."""
        return float(np.sqrt(np.mean(self.residual**2)))


def from_pairs(part: Floats, touched: Floats, extreme: Floats | None = None) -> Registration:
    """Find the pose that carries points of the part onto touched points.

    Parameters
    ----------
    part : array, shape (n, 3)
        Part frame, mm.
    touched : array, shape (n, 3)
        The same points in the base frame, mm.
    extreme : array, shape (m, 3), optional
        Points of the part that span its hull; without them those touched.

    Returns
    -------
    Registration

    Raises
    ------
    InputError
        Fewer than three pairs, points on a line, or spreads that differ twofold.
    """
    if len(part) < MIN_PAIRS:
        raise InputError(f"{len(part)} point pairs; a pose needs {MIN_PAIRS} at least")
    centre = touched.mean(axis=0)
    normals = np.broadcast_to(np.eye(3), (len(touched), 3, 3)).reshape(-1, 3)
    conditioning = conditioning_of(np.repeat(touched, 3, axis=0), normals, len(touched))
    refuse_unseen(conditioning, "touch points that do not lie on one line")
    origin = part.mean(axis=0)
    spread = float(np.sqrt(np.mean(np.sum((part - origin) ** 2, axis=1))))
    if not 0.5 < conditioning.radius / max(spread, 1e-12) < 2.0:
        raise InputError(
            f"the touched points lie {conditioning.radius:.4g} mm about their centre, the same "
            f"points of the part {spread:.4g} mm: check the part's unit of length"
        )
    R = Rotation.align_vectors(touched - centre, part - origin)[0].as_matrix()
    position = centre - R @ origin
    residual = np.linalg.norm(part @ R.T + position - touched, axis=1)
    spare = 3 * len(part) - 6
    squares = float(np.sum(residual**2))
    at = (part if extreme is None else extreme) @ R.T + position
    # Three pairs of three distances each leave three degrees of freedom, so that it is never 0.
    bound = pose_bound.ellipsoid(conditioning, len(touched), squares, spare, at)
    return Registration(R, position, residual, conditioning, spare, bound)


@dataclass(frozen=True)
class RegisteredPart:
    """What registration asks of a part, in its own frame.

    Attributes
    ----------
    closest : callable
        See `Closest`.
    extreme : array, shape (m, 3)
        The corners of its convex hull, mm: one of them moves most, whatever the motion.
    places : array, shape (k, 3)
        Points of its surface where a tip can touch, mm.
    """

    closest: Closest
    extreme: Floats
    places: Floats

    @classmethod
    def of(cls, surface: "Mesh") -> "RegisteredPart":
        """Return a mesh as registration asks of it."""

        def closest(points: Floats) -> tuple[Floats, Floats]:
            hits = surface.closest(points)
            return hits.position, hits.normal

        a, b, c = np.moveaxis(surface.corners, 1, 0)
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        largest = np.argsort(-area, kind="stable")[:_PLACES]
        return cls(closest, _extreme(surface.V), surface.corners[largest].mean(axis=1))


def _extreme(V: Floats) -> Floats:
    try:
        return np.asarray(V[ConvexHull(V).vertices])
    except QhullError:  # flat: it has no hull in space
        return V


def starts_near(touched: Floats, rotation: Floats, position: Floats) -> Pose:
    """Return starts about a rough pose, itself the first.

    Parameters
    ----------
    touched : array, shape (n, 3)
        Base frame, mm; the others are turned about their middle.
    rotation, position : array, shape (3, 3) and (3,)
        The rough pose of the part in the base frame, mm.

    Returns
    -------
    Pose
        `STARTS` of them.
    """
    centre = touched.mean(axis=0)
    return pose_search.near(rotation, position, centre, STARTS, START_SHIFT, START_TURN)


def starts_anywhere(touched: Floats, part: RegisteredPart) -> Pose:
    """Return starts in all orientations, with the middle of the touched points in the part's."""
    middles = [
        part.places.mean(axis=0),
        0.5 * (part.extreme.min(axis=0) + part.extreme.max(axis=0)),
    ]
    about = touched.mean(axis=0)
    some = [pose_search.anywhere(middle, about, ORIENTATIONS) for middle in middles]
    return Pose.joined(*some)


def onto_surface(
    touched: Floats,
    part: RegisteredPart,
    starts: Pose,
    approach: Floats | None = None,
    limit: float = LIMIT,
) -> Registration:
    """Find the pose that lays a part's surface onto points touched anywhere on it.

    Parameters
    ----------
    touched : array, shape (n, 3)
        Base frame, mm.
    part : RegisteredPart
    starts : Pose
        Of `starts_near` or `starts_anywhere`.
    approach : array, shape (n, 3), optional
        Unit directions in which the tip came to the points, base frame; NaN where not known.
    limit : float
        Poses that differ by more than this somewhere on the part are different ones, mm.

    Returns
    -------
    Registration

    Raises
    ------
    InputError
        Fewer than seven points, or points that leave the part free to move.
    """
    count = len(touched)
    if count < MIN_TOUCHED:
        raise InputError(
            f"{count} touched points; without matching points of the part, "
            f"{MIN_TOUCHED} at least are needed, spread over all its sides"
        )
    radius_of(touched - touched.mean(axis=0))
    _refuse_size(touched, part)
    spare = count - 6
    poses, squares = pose_search.descend(touched, part.closest, starts)
    # What fits as well beside the best pose may lead to one that is better yet.
    tried, fit = _beside(touched, part, poses[:1], limit)
    more = np.flatnonzero(fit <= squares[0] + pose_bound.sure_rise(squares[0], spare))
    if len(more):
        found, fit = pose_search.descended(touched, part.closest, tried[more])
        poses, squares = Pose.joined(poses, found), np.concatenate([squares, fit])
    cost, directed = _directed(touched, part, poses, squares, approach, limit)
    first = int(np.argmin(cost))
    best = steadied(touched, part.closest, poses[first : first + 1])
    distance = pose_search.signed(best.apply_inverse(touched), part.closest)[0][0]
    conditioning = _conditioning_at(touched, part, best)
    refuse_unseen(conditioning, "touch sides that face other ways too")
    least = float(np.sum(distance**2))
    tried, fit = _beside(touched, part, best, limit)
    likely = pose_bound.likely_rise(least, spare)
    apart = pose_bound.displacement(poses, best, part.extreme)
    # Another minimum within the limit is the same pose, less certain.
    same = (cost <= cost[first] + likely) & (apart <= limit)
    beside = pose_bound.displacement(tried[fit <= least + likely], best, part.extreme)
    at = best.apply(part.extreme)[0]
    bound = max(
        pose_bound.ellipsoid(conditioning, count, least, spare, at),
        float(beside.max(initial=0.0)),
        float(apart[same].max(initial=0.0)),
    )
    others = np.flatnonzero(apart > limit)
    rival = None
    if len(others):
        second = int(others[np.argmin(cost[others])])
        near = bool(cost[second] <= cost[first] + pose_bound.sure_rise(least, spare))
        rms = float(np.sqrt(squares[second] / count))
        rival = _rival(part, best, poses[second : second + 1], rms, near)
    rotation, position = best.rotation[0], best.position[0]
    residual = np.abs(distance)
    return Registration(
        rotation,
        position,
        residual,
        conditioning,
        spare,
        bound,
        rival,
        directed,
        _one_sided(distance),
    )


def _one_sided(distance: Floats) -> float:
    """Median of signed distances (n,), mm, where it is beyond doubt; else 0."""
    middle, spread = float(np.median(distance)), float(np.std(distance))
    sure = max(_LEAST_SHIFT, 5.0 * spread / np.sqrt(len(distance)))
    return middle if abs(middle) > sure else 0.0


def _refuse_size(touched: Floats, part: RegisteredPart) -> None:
    across = float(np.linalg.norm(np.ptp(touched, axis=0)))
    # No distance between two points of the part is larger than its box's diagonal.
    most = float(np.linalg.norm(np.ptp(part.extreme, axis=0)))
    spread = float(np.linalg.norm(touched - touched.mean(axis=0), axis=1).max())
    if spread > 1.1 * most or across < most / _SMALL:
        raise InputError(
            f"the touched points are {across:.4g} mm across, the part {most:.4g} mm: check the "
            "part's unit of length (--unit), and that x y z are in mm"
        )


def _beside(touched: Floats, part: RegisteredPart, best: Pose, limit: float) -> tuple[Pose, Floats]:
    conditioning = _conditioning_at(touched, part, best)
    return pose_bound.beside(touched, part.closest, best, conditioning, part.extreme, limit)


def _conditioning_at(touched: Floats, part: RegisteredPart, pose: Pose) -> PointConditioning:
    _, normal = part.closest(pose.apply_inverse(touched)[0])
    return conditioning_of(touched, normal @ pose.rotation[0].T, len(touched))


def _directed(
    touched: Floats,
    part: RegisteredPart,
    poses: Pose,
    squares: Floats,
    approach: Floats | None,
    limit: float,
) -> tuple[Floats, bool]:
    """Add to the sums of squares what touches that come out of the part speak against a pose.

    Each counts as a point that is off by the limit. Directions that speak against every pose are
    wrong themselves, and not used.
    """
    if approach is None:
        return squares, False
    _, normal = part.closest(poses.apply_inverse(touched).reshape(-1, 3))
    normal = normal.reshape(len(poses), -1, 3) @ np.swapaxes(poses.rotation, 1, 2)
    facing = np.sum(normal * approach, axis=2)
    astray = np.sum(facing > _FACING, axis=1)  # not where it is NaN
    cost = squares + limit**2 * astray
    known = int(np.sum(np.isfinite(approach[:, 0])))
    if astray[int(np.argmin(cost))] > _MOST_ASTRAY * known:
        return squares, False
    return cost, True


def _rival(part: RegisteredPart, best: Pose, other: Pose, rms: float, near: bool) -> Rival:
    places = best.apply(part.places)[0]
    off = np.abs(pose_search.signed(other.apply_inverse(places), part.closest)[0][0])
    worst = int(np.argmax(off))
    apart = float(pose_bound.displacement(other, best, part.extreme)[0])
    turned = float(np.linalg.norm(rotations.log_one(other.rotation[0] @ best.rotation[0].T)))
    return Rival(
        other.rotation[0],
        other.position[0],
        rms,
        apart,
        turned,
        near,
        places[worst],
        float(off[worst]),
    )

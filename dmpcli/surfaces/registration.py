"""Where a part lies: its pose in the base frame from points touched on it.

Point pairs are solved in closed form (W. Kabsch, Acta Crystallographica A32 (1976) 922; scipy's
`Rotation.align_vectors`). Points touched anywhere are laid onto the surface by iterative closest
points with distances measured to the surface, not to points of it (Y. Chen, G. Medioni, Image and
Vision Computing 10 (1992) 145): scipy's `least_squares` minimizes them, with a loss that a
mistouched point cannot dominate. docs/registration.md says why no ready ICP was taken.

Conditioning. A small motion of the part, v about the touched points' centre c and the rotation
vector ω, changes the distance of the point p by n · (v + ω × (p - c)). These rows, with ω in units
of 1/radius, have singular values, the gains: how much the distances change, RMS, for a motion that
moves the touched points by about 1. A gain of zero is a motion that the points cannot see.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from dmpcli import rotations
from dmpcli.arrays import Floats
from dmpcli.errors import InputError

MIN_GAIN = 0.015
"""A motion that changes the distances by less than this part of itself is taken for unseen.

The facets of round meshes alone give 0.001 to 0.008; rocking on a saddle of radius 120 mm 0.03.
"""

MIN_PAIRS = 3
MIN_TOUCHED = 7
"""Six points fix a pose and leave nothing to judge it by."""

Closest = Callable[[Floats], tuple[Floats, Floats]]
"""From points (n, 3) to the closest points of the part and its unit normals there, part frame."""


@dataclass(frozen=True)
class Conditioning:
    """How well touched points hold a part.

    Attributes
    ----------
    gains : array, shape (6,)
        Descending.
    motions : array, shape (6, 6)
        Row i is the unit motion (v, ω·radius) of gain i, base axes.
    centre : array, shape (3,)
        Of the touched points, mm.
    radius : float
        RMS distance of the touched points from it, mm.
    """

    gains: Floats
    motions: Floats
    centre: Floats
    radius: float

    @property
    def number(self) -> float:
        """Largest gain over smallest; infinite where a motion is not seen at all."""
        return float(self.gains[0] / self.gains[-1]) if self.gains[-1] > 0.0 else np.inf

    @property
    def weakest(self) -> str:
        """The motion of the smallest gain, in words."""
        return self._named(self.motions[-1])

    def free(self) -> list[str]:
        """Return in words the motions that the points do not see, slides first."""
        unseen = self.motions[self.gains < MIN_GAIN]
        if len(unseen) == 0:
            return []
        # Their mixture is arbitrary: take the pure slides out of it, and what is left turns.
        mixing, turning, _ = np.linalg.svd(unseen[:, 3:])
        turns = int(np.sum(turning > 0.1))
        return [
            self._named(mixing[:, i] @ unseen) for i in [*range(turns, len(unseen)), *range(turns)]
        ]

    def _named(self, motion: Floats) -> str:
        slide, turn = motion[:3], motion[3:] / self.radius
        if np.linalg.norm(motion[3:]) < 0.1:
            return f"slides along {_shown(_canonical(slide), 2)}"
        square = float(turn @ turn)
        foot = self.centre + np.cross(turn, slide) / square
        pitch = float(turn @ slide) / square
        named = f"turns about {_shown(_canonical(turn), 2)} through {_shown(foot, 1)} mm"
        return (
            named
            if abs(pitch) < 0.1 * self.radius
            else f"{named}, advancing {pitch:.3g} mm per rad"
        )


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
    conditioning : Conditioning
    spare : int
        Degrees of freedom that are left to the residuals.
    """

    rotation: Floats
    position: Floats
    residual: Floats
    conditioning: Conditioning
    spare: int

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, mm."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def uncertainty(self) -> float:
        """Standard deviation along the weakest motion, mm at the touched points."""
        spread = np.sqrt(np.sum(self.residual**2) / self.spare)
        return float(spread / (self.conditioning.gains[-1] * np.sqrt(len(self.residual))))


def from_pairs(part: Floats, touched: Floats) -> Registration:
    """Find the pose that carries points of the part onto touched points.

    Parameters
    ----------
    part : array, shape (n, 3)
        Part frame, mm.
    touched : array, shape (n, 3)
        The same points in the base frame, mm.

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
    conditioning = _conditioning(np.repeat(touched, 3, axis=0), normals, len(touched))
    _refuse_unseen(conditioning, "touch points that do not lie on one line")
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
    return Registration(R, position, residual, conditioning, 3 * len(part) - 6)


def onto_surface(
    touched: Floats, closest: Closest, rotation: Floats, position: Floats
) -> Registration:
    """Find the pose that lays a part's surface onto points touched anywhere on it.

    Parameters
    ----------
    touched : array, shape (n, 3)
        Base frame, mm.
    closest : callable
        See `Closest`.
    rotation, position : array, shape (3, 3) and (3,)
        A pose near the true one: each point must find the side of the part that it was touched on.

    Returns
    -------
    Registration

    Raises
    ------
    InputError
        Fewer than seven points, or points that leave the part free to move.
    """
    if len(touched) < MIN_TOUCHED:
        raise InputError(
            f"{len(touched)} touched points; without matching points of the part, "
            f"{MIN_TOUCHED} at least are needed, spread over all its sides"
        )
    centre = touched.mean(axis=0)
    arms = touched - centre
    radius = _radius(arms)

    def offsets(x: Floats) -> tuple[Floats, Floats, Floats]:
        """Signed distances of the points turned by x[3:]/radius about c and moved by x[:3].

        With them their gradients and the turned arms, base axes.
        """
        turned = arms @ rotations.exp(x[3:] / radius).T
        in_part = (turned + centre + x[:3] - position) @ rotation
        foot, normal = closest(in_part)
        away = in_part - foot
        distance = np.linalg.norm(away, axis=1)
        side = np.where(np.sum(away * normal, axis=1) < 0.0, -1.0, 1.0)
        safe = np.where(distance > 1e-9, distance, 1.0)[:, None]
        gradient = np.where(distance[:, None] > 1e-9, away / safe * side[:, None], normal)
        return side * distance, gradient @ rotation.T, turned

    def distances(x: Floats) -> Floats:
        return offsets(x)[0]

    def jacobian(x: Floats) -> Floats:
        _, gradient, turned = offsets(x)
        turn = np.cross(turned, gradient) @ _left_jacobian(x[3:] / radius) / radius
        return np.concatenate([gradient, turn], axis=1)

    x = np.zeros(6)
    scale = 1.0
    for loss in ("linear", "soft_l1", "soft_l1"):
        x = least_squares(
            distances,
            x,
            jac=jacobian,
            loss=loss,
            f_scale=scale,
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
            max_nfev=200,
        ).x
        # The median of absolute deviations, as a normal distribution's standard deviation.
        scale = max(1.4826 * float(np.median(np.abs(distances(x)))), 1e-3)
    # The touched points were moved onto the part: the part moves the other way.
    R = rotations.exp(-x[3:] / radius)
    rotation_found = R @ rotation
    position_found = R @ (position - x[:3] - centre) + centre
    foot, normal = closest((touched - position_found) @ rotation_found)
    residual = np.linalg.norm(foot @ rotation_found.T + position_found - touched, axis=1)
    conditioning = _conditioning(touched, normal @ rotation_found.T, len(touched))
    _refuse_unseen(conditioning, "touch sides that face other ways too")
    return Registration(rotation_found, position_found, residual, conditioning, len(touched) - 6)


def _conditioning(points: Floats, normals: Floats, touched: int) -> Conditioning:
    """Gains of rows of points and normals (k, 3) that came from this many touched points."""
    centre = points.mean(axis=0)
    arms = points - centre
    radius = _radius(arms)
    rows = np.concatenate([normals, np.cross(arms, normals) / radius], axis=1)
    _, gains, motions = np.linalg.svd(rows / np.sqrt(touched), full_matrices=False)
    return Conditioning(gains, motions, centre, radius)


def _radius(arms: Floats) -> float:
    radius = float(np.sqrt(np.mean(np.sum(arms**2, axis=1))))
    if radius < 1e-9:
        raise InputError("the touched points are all one point; spread them over the part")
    return radius


def _refuse_unseen(conditioning: Conditioning, advice: str) -> None:
    free = conditioning.free()
    if free:
        raise InputError(f"the touched points leave the part free: it {'; '.join(free)}; {advice}")


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


def _canonical(direction: Floats) -> Floats:
    """Unit vector, its largest component positive: an axis has no sign."""
    return np.asarray(direction / (np.linalg.norm(direction) * _sign(direction)))


def _sign(direction: Floats) -> float:
    return float(np.sign(direction[np.argmax(np.abs(direction))]))


def _shown(vector: Floats, digits: int) -> str:
    rounded = np.round(vector, digits) + 0.0
    return "(" + ", ".join(f"{value:.{digits}f}" for value in rounded) + ")"

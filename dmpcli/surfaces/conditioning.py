"""How well touched points hold a part.

A small motion of the part, v about the touched points' centre c and the rotation vector ω, changes
the distance of the point p by n · (v + ω × (p - c)). These rows, with ω in units of 1/radius, have
singular values, the gains: how much the distances change, RMS, for a motion that moves the touched
points by about 1. A gain of zero is a motion that the points cannot see.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError

MIN_GAIN = 0.015
"""A motion that changes the distances by less than this part of itself is taken for unseen.

The facets of round meshes alone give 0.001 to 0.008; rocking on a saddle of radius 120 mm 0.03.
"""


@dataclass(frozen=True)
class PointConditioning:
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


def conditioning_of(points: Floats, normals: Floats, touched: int) -> PointConditioning:
    """Gains of rows of points and normals (k, 3) that came from this many touched points.

    Parameters
    ----------
    points : array, shape (k, 3)
        Where the part was touched, base frame, mm; one may be there several times.
    normals : array, shape (k, 3)
        Unit normals of the part there, base axes.
    touched : int
        By which sums of squares are divided, however many rows there are.

    Raises
    ------
    InputError
        The points are all one.
    """
    centre = points.mean(axis=0)
    arms = points - centre
    radius = radius_of(arms)
    rows = np.concatenate([normals, np.cross(arms, normals) / radius], axis=1)
    _, gains, motions = np.linalg.svd(rows / np.sqrt(touched), full_matrices=False)
    return PointConditioning(gains, motions, centre, radius)


def radius_of(arms: Floats) -> float:
    """RMS distance of points (n, 3) from their centre, mm; refused where they are one point."""
    radius = float(np.sqrt(np.mean(np.sum(arms**2, axis=1))))
    if radius < 1e-9:
        raise InputError("the touched points are all one point; spread them over the part")
    return radius


def refuse_unseen(of: PointConditioning, advice: str) -> None:
    """Refuse, by name, points that leave the part free to move."""
    free = of.free()
    if free:
        raise InputError(f"the touched points leave the part free: it {'; '.join(free)}; {advice}")


def _canonical(direction: Floats) -> Floats:
    """Unit vector, its largest component positive: an axis has no sign."""
    return np.asarray(direction / (np.linalg.norm(direction) * _sign(direction)))


def _sign(direction: Floats) -> float:
    return float(np.sign(direction[np.argmax(np.abs(direction))]))


def _shown(vector: Floats, digits: int) -> str:
    rounded = np.round(vector, digits) + 0.0
    return "(" + ", ".join(f"{value:.{digits}f}" for value in rounded) + ")"

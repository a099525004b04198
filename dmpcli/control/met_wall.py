"""A wall or an edge that ended a stroke, and what no loop of its delay could have spared the tool.

A loop runs into a wall until it has felt it and the arm stands: meanwhile the force rises by the
wall's stiffness for each millimetre that the plan goes on. How fast it rises is seen between
readings that both feel the wall, those too that come after the stroke was ended. The first of them
is none of these: before it lies a blow, by the inertia and the damping of an arm that moves.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from dmpcli.arrays import Floats

# Of the largest force across the normal: what is less has not felt the wall.
_LOADED = 0.25


@dataclass(frozen=True)
class MetWall:
    """What was met across the normal, beside what could not be avoided.

    Attributes
    ----------
    across : float
        Force across the normal at which the stroke was ended, N.
    largest : float
        The most of it until the arm stood, N.
    speed : float
        Of the stroke against the wall, mm/s.
    stiffness : float
        Of tool and wall across the normal, by how fast the force rose, N/mm.
    reaction : float
        From a displacement to what is done about its force, s.
    """

    across: float
    largest: float
    speed: float
    stiffness: float
    reaction: float

    @property
    def unavoidable(self) -> float:
        """Force that is met before anything can be done: reaction time by speed by stiffness, N."""
        return self.reaction * self.speed * self.stiffness

    def __str__(self) -> str:
        """Say it in one line."""
        return (
            f"{self.largest:.1f} N across the normal until the arm stood; {self.unavoidable:.1f} N "
            f"are unavoidable at {self.speed:.3g} mm/s on {self.stiffness:.3g} N/mm behind "
            f"{self.reaction:.2g} s"
        )


def resisting(side: Sequence[float], way: Sequence[float], rub: float) -> float:
    """Size of a force across the normal, N; 0 where it does more than friction to help the tool on.

    What is met on the way resists: it takes work from the tool. An edge that the tool slides down
    from gives some back, and there is nothing to stop for: where the part ends the contact is lost,
    and at a step it is found again.

    Parameters
    ----------
    side : sequence of float
        Force on the tool across the normal, N.
    way : sequence of float
        Of the stroke in this cycle, mm.
    rub : float
        Friction that was felt, N.
    """
    x, y, z = side
    u, v, w = way
    helps = x * u + y * v + z * w + rub * math.sqrt(u * u + v * v + w * w)
    return 0.0 if helps > 0.0 else math.sqrt(x * x + y * y + z * z)


def against(
    felt: Sequence[tuple[float, Floats]], normal: Floats, velocity: Floats, friction: float
) -> tuple[list[tuple[float, float]], float]:
    """Return how hard a wall was met, and how fast the tool went against it.

    A wall rubs: what is felt of it leans from its own normal by the angle of friction, against the
    sliding. So that normal lies further from the way that the tool goes than the force does, and
    what the tool slides along the wall is no speed against it. (Nearer to head-on than the angle of
    friction it may be either way; with a friction of 0.2 the speed is then off by 8 % at most.)

    Parameters
    ----------
    felt : sequence of tuple
        Time, s, and force on the tool, shape (3,), N, of each reading.
    normal : array, shape (3,)
        Unit normal of the surface.
    velocity : array, shape (3,)
        Of the stroke, mm/s.
    friction : float
        Coulomb's coefficient, as it was felt on the surface; 0 where nothing is known.

    Returns
    -------
    list of tuple of float
        Time, s, and size of the force across the normal, N.
    float
        Speed against the wall where the largest of these was felt, mm/s.
    """
    sides = [force - float(normal @ force) * normal for _, force in felt]
    sizes = [math.sqrt(side @ side) for side in sides]
    largest, pace = max(sizes), math.sqrt(velocity @ velocity)
    speed = 0.0
    if largest and pace:
        share = abs(float(velocity @ sides[sizes.index(largest)])) / (largest * pace)
        lean = math.acos(min(share, 1.0)) + math.atan(friction)
        speed = pace * math.cos(min(lean, math.pi / 2.0))
    return list(zip((t for t, _ in felt), sizes, strict=True)), speed


def met(
    across: float,
    felt: Sequence[tuple[float, float]],
    speed: float,
    reaction: float,
    period: float,
) -> MetWall | None:
    """Put together what was met; None where no rise of the force is seen, or nothing moved.

    Where one reading alone has felt the wall, nothing tells the blow from the rise; then that force
    is taken to have risen for a period and half the way from one reading to the next.

    Parameters
    ----------
    across : float
        Force across the normal at which the stroke was ended, N.
    felt : sequence of tuple of float
        Time, s, and force across the normal, N, of each reading from before that to the arm's rest.
    speed : float
        Of the stroke against the wall, mm/s.
    reaction : float
        s.
    period : float
        Of the loop, s.
    """
    if not (felt and speed > 0.0):
        return None
    hardest = max(force for _, force in felt)
    loaded = [force >= _LOADED * hardest for _, force in felt]
    first = felt[loaded.index(True)][1]
    between = (felt[-1][0] - felt[0][0]) / max(len(felt) - 1, 1)
    single = first / (period + 0.5 * between)
    rise = max(
        (
            (b - a) / (t - since)
            for ((since, a), (t, b)), both in zip(pairwise(felt), pairwise(loaded), strict=True)
            if all(both) and t > since
        ),
        default=0.0,
    )
    rise = rise if rise > _LOADED * single else single
    if not rise > 0.0:
        return None
    largest = max(across, hardest)
    return MetWall(across, largest, speed, rise / speed, reaction)

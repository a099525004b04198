"""The discrete admittance model, eq. (1)-(3), in six dimensions.

Integrated as printed, with the old velocity and the old position in the force balance::

    a(k) = M⁻¹ [F(k) - D v(k-1) - K (x(k-1) - x0)]      (1)
    v(k) = a(k) T + v(k-1)                              (2)
    x(k) = v(k) T + x(k-1)                              (3)

Rotation is integrated as angular velocity in base axes, ``R(k) = Exp(T ω(k)) R(k-1)``, and its
spring acts on ``Log(R R0ᵀ)``. Euler angles in the place of x would turn a tool that points down
(rx = π) the wrong way about base y and z, and run away.
"""

import math
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError, beside
from dmpcli.spatial.rotations import exp_one, log_one

AXES = ("x", "y", "z", "rotation x", "rotation y", "rotation z")


@dataclass(frozen=True)
class AdmittanceLaw:
    """M, D and K of eq. (1), diagonal, and the control period T.

    Attributes
    ----------
    mass : array, shape (n,)
        N·s²/mm; kg·m² for rotations.
    damping : array, shape (n,)
        N·s/mm; N·m·s/rad. (The paper's sentence calls it stiffness, and K damping.)
    stiffness : array, shape (n,)
        N/mm; N·m/rad.
    period : float
        s.
    """

    mass: Floats
    damping: Floats
    stiffness: Floats
    period: float


@dataclass(frozen=True)
class Bounds:
    """Largest speeds and accelerations of the reference; infinite is no bound.

    Attributes
    ----------
    speed, acceleration : float
        mm/s and mm/s².
    turning, turning_acceleration : float
        rad/s and rad/s².
    """

    speed: float = np.inf
    acceleration: float = np.inf
    turning: float = np.inf
    turning_acceleration: float = np.inf


@dataclass(frozen=True)
class DragState:
    """The reference that eq. (1)-(3) move.

    Attributes
    ----------
    position, rotation : array, shape (3,) and (3, 3)
        mm, base frame.
    velocity : array, shape (6,)
        mm/s and rad/s, base axes.
    """

    position: Floats
    rotation: Floats
    velocity: Floats


def check_stable(law: AdmittanceLaw, names: tuple[str, ...] = AXES) -> None:
    """Refuse a law that would not come to rest.

    With a = TD/M and b = T²K/M the characteristic polynomial of (1)-(3) is
    ``z² - (2 - a - b) z + (1 - a)``; it is stable if and only if M > 0, D > 0, K ≥ 0 and
    2TD + T²K < 4M. (K = 0 leaves one root at 1: the tool stays where it is let go.)

    Parameters
    ----------
    law : AdmittanceLaw
    names : tuple of str
        What messages call the axes.

    Raises
    ------
    InputError
        Names the first axis that breaks a condition, and its value.
    """
    T = law.period
    if not (np.isfinite(T) and T > 0.0):
        raise InputError(f"control period = {T:g} s: must be finite and above 0")
    for name, M, D, K in zip(names, law.mass, law.damping, law.stiffness, strict=True):
        if not (np.isfinite(M) and M > 0.0):
            raise InputError(f"admittance, {name}: mass = {M:g}: must be finite and above 0")
        if not (np.isfinite(D) and D > 0.0):
            raise InputError(f"admittance, {name}: damping = {D:g}: must be finite and above 0")
        if not (np.isfinite(K) and K >= 0.0):
            raise InputError(f"admittance, {name}: stiffness = {K:g}: must be finite, 0 or more")
        if not 2.0 * T * D + T**2 * K < 4.0 * M:
            raise InputError(
                f"admittance, {name}: unstable, 2TD + T²K = "
                f"{beside(2.0 * T * D + T**2 * K, 4.0 * M, '.6g')} not below "
                f"4M = {4.0 * M:g} at a period of {T:g} s; raise the mass or the control rate, "
                "or lower damping and stiffness"
            )


def acceleration(
    law: AdmittanceLaw, force: Floats, velocity: Floats, displacement: Floats
) -> Floats:
    """Eq. (1).

    Parameters
    ----------
    law : AdmittanceLaw
    force : array, shape (..., n)
        F(k).
    velocity : array, shape (..., n)
        v(k-1).
    displacement : array, shape (..., n)
        x(k-1) - x0.

    Returns
    -------
    array, shape (..., n)
        a(k).
    """
    return (force - law.damping * velocity - law.stiffness * displacement) / law.mass  # eq. (1)


def move(
    law: AdmittanceLaw,
    pose: DragState,
    wrench: Floats,
    home: DragState,
    bounds: Bounds | None = None,
) -> DragState:
    """Take one step of eq. (1)-(3) with the tool.

    Bounds hold for the state itself, so that nothing winds up while a force pulls beyond them.

    Parameters
    ----------
    law : AdmittanceLaw
        Of six axes.
    pose : DragState
        Of step k-1.
    wrench : array, shape (6,)
        On the tool, at the TCP, base axes, N and N·m.
    home : DragState
        x0 and R0, where the springs pull to.
    bounds : Bounds, optional

    Returns
    -------
    Pose
        Of step k.
    """
    displacement = np.zeros(6)
    if law.stiffness.any():
        displacement[:3] = pose.position - home.position
        displacement[3:] = log_one(pose.rotation @ home.rotation.T)
    a = acceleration(law, wrench, pose.velocity, displacement)  # eq. (1)
    if bounds is not None:
        a = _within(a, bounds.acceleration, bounds.turning_acceleration)
    v = a * law.period + pose.velocity  # eq. (2)
    if bounds is not None:
        v = _within(v, bounds.speed, bounds.turning)
    x = v[:3] * law.period + pose.position  # eq. (3)
    R = exp_one(law.period * v[3:]) @ pose.rotation  # eq. (3), of a rotation
    return DragState(x, R, v)


def brake(law: AdmittanceLaw, pose: DragState, bounds: Bounds) -> DragState:
    """Slow the reference down as fast as the bounds allow, with no force felt.

    Parameters
    ----------
    law : AdmittanceLaw
        Gives the period.
    pose : DragState
        Of step k-1.
    bounds : Bounds

    Returns
    -------
    Pose
        Of step k.
    """
    v = pose.velocity + _within(
        -pose.velocity, bounds.acceleration * law.period, bounds.turning_acceleration * law.period
    )
    return DragState(
        v[:3] * law.period + pose.position, exp_one(law.period * v[3:]) @ pose.rotation, v
    )


def _within(vector: Floats, bound: float, turning_bound: float) -> Floats:
    """Shorten both halves of a vector to their bounds; the directions stay."""
    length, turning = math.sqrt(vector[:3] @ vector[:3]), math.sqrt(vector[3:] @ vector[3:])
    if length <= bound and turning <= turning_bound:
        return vector
    return np.concatenate(
        [
            vector[:3] * (bound / length if length > bound else 1.0),
            vector[3:] * (turning_bound / turning if turning > turning_bound else 1.0),
        ]
    )

"""Tool weight, centre of mass, zero and inclination from static poses, by least squares.

At rest, with nothing on the tool, a sensor in the attitude R (base ← sensor) reads::

    F = F0 + Rᵀ L            M = M0 + c × Rᵀ L

with L the weight as a vector in base axes, see `wrench.gravity`. Forces first: ``[Rᵀ I] [L; F0] =
F``. Then torques, with the forces as sensed: ``[-[F - F0]× I] [c; M0] = M``. That is the system
``[-[F]× I] [c; k] = M`` with ``M0 = k + c × F0`` put in: the same solution, but a large zero does
not spoil its conditioning.

Where the times of the poses are known, either zero may drift evenly: three more unknowns in each
system. 2 mN/s over the minute that twelve poses take would otherwise pass for 0.2° of inclination.

A sensor that is turned on the flange is not found by this: that turn has to be in R.
"""

from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.dmp.options import CONDITION
from dmpcli.errors import RefusedError, beside
from dmpcli.spatial import wrench
from dmpcli.spatial.rotations import log, skew
from dmpcli.spatial.wrench import LEVER

FEWEST = 3
"""Orientations about different axes that the six unknowns of either system need."""

SAME = 0.02
"""Orientations nearer to each other than this, rad, count as one."""

DRIFT = 6
"""Poses from which a drift is looked for."""

_REJECTED_SHARE = 0.25
_OUTLYING = 6.0  # times the RMS residual of the other poses
_OUTLYING_FORCE = 0.1  # N, and no less than this


@dataclass(frozen=True)
class PayloadEstimate:
    """What hangs on the sensor, and what it reads without it; or the standard errors of both.

    Attributes
    ----------
    weight : float
        N.
    centre : array, shape (3,)
        Centre of mass from the sensor's origin, sensor axes, mm.
    inclination : array, shape (2,)
        U, V of the robot's base, rad.
    zero : array, shape (6,)
        N and N·m; where it drifts, at the end of the last pose.
    """

    weight: float
    centre: Floats
    inclination: Floats
    zero: Floats


@dataclass(frozen=True)
class Identification:
    """What a set of static poses says of the payload, and how surely.

    Attributes
    ----------
    payload, error : PayloadEstimate
        The values and their standard errors.
    residual : array, shape (n, 6)
        What the payload leaves of each reading, sensor axes, N and N·m.
    condition : array, shape (2,)
        Condition numbers of the force and the torque system; the torque's forces count in units of
        the weight, so that both depend on the orientations alone.
    used : array of bool, shape (n,)
        False for poses that were left out of the fit because they do not agree with the others.
    drift : array, shape (6,), or None
        Of the zero, N/s and N·m/s; None where it was not looked for.
    """

    payload: PayloadEstimate
    error: PayloadEstimate
    residual: Floats
    condition: Floats
    used: Booleans
    drift: Floats | None = None

    @property
    def rms(self) -> Floats:
        """Root mean square of force and torque residuals of the poses used, (2,), N and N·m."""
        return np.asarray(np.sqrt(np.mean(self._sizes**2, axis=0)))

    @property
    def largest(self) -> Floats:
        """Largest force and torque residual of the poses used, shape (2,), N and N·m."""
        return np.asarray(self._sizes.max(axis=0))

    @property
    def _sizes(self) -> Floats:
        halves = self.residual[self.used].reshape(-1, 2, 3)
        return np.asarray(np.linalg.norm(halves, axis=-1))


def condition(R: Floats) -> float:
    """Condition number of the force system ``[Rᵀ I]``, whatever the weight.

    Its squared singular values are n (1 ± s), s those of the mean of the rotations.

    Parameters
    ----------
    R : array, shape (n, 3, 3)
        Base ← sensor.
    """
    largest = float(np.linalg.svd(R.mean(axis=0), compute_uv=False)[0])
    return float(np.sqrt((1.0 + largest) / max(1.0 - largest, 1e-16)))


def check_orientations(R: Floats, limit: float = CONDITION) -> None:
    """Refuse orientations from which the payload does not follow.

    Parameters
    ----------
    R : array, shape (n, 3, 3)
        Base ← sensor.
    limit : float
        Largest condition number.

    Raises
    ------
    RefusedError
        Fewer than three orientations, or an ill-conditioned set; names the axis and the remedy.
    """
    count = _different(R)
    if count < FEWEST:
        raise RefusedError(
            f"{count} different {'orientation is' if count == 1 else 'orientations are'} not "
            f"enough to identify a payload: take {FEWEST} or more about different axes; 12 that "
            "are tilted by 45° do well"
        )
    number = condition(R)
    if number <= limit:
        return
    left, values, _ = np.linalg.svd(R.mean(axis=0))
    # A second value near 1 as well: hardly turned at all; else they turn about the first direction.
    about = ""
    if values[1] < 1.0 - 4.0 * (1.0 - values[0]):
        axis = left[:, 0] * np.sign(left[np.argmax(np.abs(left[:, 0])), 0])
        words = ", ".join(f"{part + 0.0:.2f}" for part in np.round(axis, 2))
        about = f" (they turn about one axis, ({words}) of the base)"
    said = beside(number, limit, ".3g")
    raise RefusedError(
        f"the poses do not tell weight and zero apart: condition number {said} is over "
        f"{limit:g}{about};\ntilt the tool further, in all directions: 12 poses that are tilted by "
        "45° have 2.4"
    )


def identify(
    R: Floats, sensed: Floats, t: Floats | None = None, limit: float = CONDITION
) -> Identification:
    """Identify the payload; poses that contradict the others are left out.

    A pose is left out when the payload of the others misses its reading by more than six times
    what it misses theirs by, and by 0.1 N at least: something touched the tool there, or it moved.
    At most a quarter of the poses may go.

    Parameters
    ----------
    R : array, shape (n, 3, 3)
        Base ← sensor.
    sensed : array, shape (n, 6)
        Mean reading of each pose, N and N·m.
    t : array, shape (n,), optional
        When each was read, s. The zero may then drift, if there are `DRIFT` poses or more and the
        drift can be told from the weight; they are not well ordered where it cannot.
    limit : float
        Largest condition number of the poses that stay.

    Raises
    ------
    RefusedError
        As in `check_orientations` and `solve`.
    """
    check_orientations(R, limit)
    age = _age(R, t, limit)
    used = np.ones(len(R), dtype=bool)
    for _ in range(int(_REJECTED_SHARE * len(R))):
        worst = _outlier(R, sensed, age, used)
        if worst is None:
            break
        used[worst] = False
    check_orientations(R[used], limit)
    found = solve(R[used], sensed[used], None if age is None else age[used])
    return replace(found, used=used, residual=residuals(found, R, sensed, age))


def solve(R: Floats, sensed: Floats, age: Floats | None = None) -> Identification:
    """Identify the payload from poses that are all believed.

    Parameters
    ----------
    R : array, shape (n, 3, 3)
        Base ← sensor; n of 3 or more, with a drift of 4 or more.
    sensed : array, shape (n, 6)
        Mean reading of each pose, N and N·m.
    age : array, shape (n,), optional
        When each was read, s, counted from the time at which the zero is wanted: negative before.
        None: the zero does not drift.

    Returns
    -------
    Identification
        Standard errors from the residuals, with a variance of its own for each of the sensor's
        axes (a Mini45 is three times as noisy along z as across).

    Raises
    ------
    RefusedError
        The weight is within five standard errors of nothing: it has no direction and no centre.
    """
    force, torque = sensed[:, :3], sensed[:, 3:]
    forces = _Fit(np.swapaxes(R, -1, -2), force, age)
    weight, inclination = wrench.weight_and_inclination(forces.first)
    weight_error, inclination_error = _of_load(weight, inclination, forces.covariance)
    if not weight > 5.0 * weight_error:
        raise RefusedError(
            f"the tool weighs {weight:.3f} ± {weight_error:.3f} N on this sensor: too little to "
            "find its centre of mass and the inclination; does the sensor carry the tool?"
        )
    # In units of the weight, so that the condition number depends on the orientations alone.
    torques = _Fit(-skew((force - forces.zeros) / weight), torque, age)
    to_mm = wrench.METRE / weight
    zero = np.concatenate([forces.zero, torques.zero])
    found = Identification(
        PayloadEstimate(weight, to_mm * torques.first, inclination, zero),
        PayloadEstimate(
            weight_error,
            to_mm * np.sqrt(np.diagonal(torques.covariance)),
            inclination_error,
            np.concatenate([forces.zero_error, torques.zero_error]),
        ),
        sensed,
        np.array([forces.condition, torques.condition]),
        np.ones(len(R), dtype=bool),
        None if age is None else np.concatenate([forces.drift, torques.drift]),
    )
    return replace(found, residual=residuals(found, R, sensed, age))


def residuals(found: Identification, R: Floats, sensed: Floats, age: Floats | None) -> Floats:
    """What a payload leaves of readings at rest, shape (n, 6), sensor axes, N and N·m.

    Parameters
    ----------
    found : Identification
    R : array, shape (n, 3, 3)
        Base ← sensor.
    sensed : array, shape (n, 6)
    age : array, shape (n,), or None
        As in `solve`.
    """
    p = found.payload
    weight = wrench.of_weight(R, wrench.gravity(p.weight, p.inclination), p.centre)
    left = sensed - p.zero - weight
    if age is not None and found.drift is not None:
        left = left - age[:, None] * found.drift
    return np.asarray(left)


class _Fit:
    """Least squares of ``A_i x + zero + age_i drift = b_i``, three equations per pose.

    Attributes
    ----------
    first, zero, zero_error, drift : array, shape (3,)
        x, the zero at age 0 with its standard errors, and its drift per second.
    zeros : array, shape (n, 3)
        The zero of each pose.
    covariance : array, shape (3, 3)
        Of x.
    condition : float
        Condition number, ages counted from their mean in units of their deviation.
    """

    def __init__(self, A: Floats, b: Floats, age: Floats | None) -> None:
        n = len(A)
        system = _system(A, age)
        unknowns = system.shape[-1]
        stacked = system.reshape(3 * n, unknowns)
        inverse = np.linalg.pinv(stacked)
        x = inverse @ b.ravel()
        left = b - system @ x
        # The unknowns share three axes.
        variance = np.sum(left**2, axis=0) / max(n - unknowns // 3, 1)
        covariance = (inverse * np.tile(variance, n)) @ inverse.T
        self.condition = float(np.linalg.cond(stacked))
        self.first, self.covariance = x[:3], covariance[:3, :3]
        # Carries the unknowns over to the zero at age 0.
        carry = np.hstack([np.zeros((3, 3)), np.eye(3)])
        self.drift = np.zeros(3)
        if age is not None:
            carry = np.hstack([carry, -age.mean() / age.std() * np.eye(3)])
            self.drift = x[6:] / age.std()
        self.zero = carry @ x
        self.zero_error = np.sqrt(np.diagonal(carry @ covariance @ carry.T))
        self.zeros = self.zero + (0.0 if age is None else age[:, None] * self.drift)


def _system(A: Floats, age: Floats | None) -> Floats:
    """``[A I]`` of each pose, and with ages ``[A I tau I]``."""
    ones = np.broadcast_to(np.eye(3), A.shape)
    if age is None:
        return np.concatenate([A, ones], axis=-1)
    tau = (age - age.mean()) / age.std()
    return np.concatenate([A, ones, tau[:, None, None] * ones], axis=-1)


def _age(R: Floats, t: Floats | None, limit: float) -> Floats | None:
    """Times counted from the last one; None where they do not show a drift."""
    if t is None or len(R) < DRIFT or not np.std(t) > 0.0:
        return None
    age = np.asarray(t - np.max(t), dtype=float)
    system = _system(np.swapaxes(R, -1, -2), age)
    shows = np.linalg.cond(system.reshape(-1, 9)) <= limit
    return age if shows else None


def _outlier(R: Floats, sensed: Floats, age: Floats | None, used: Booleans) -> int | None:
    """Pose whose removal explains the others best, if they then contradict it."""
    candidates = np.flatnonzero(used)
    if len(candidates) <= FEWEST + 1:
        return None
    fits = []
    for pose in candidates:
        others = candidates[candidates != pose]
        try:
            found = solve(R[others], sensed[others], None if age is None else age[others])
        except RefusedError:  # without this pose there is hardly a weight: it is needed
            continue
        left = _counted(residuals(found, R, sensed, age))
        fits.append((float(np.sqrt(np.mean(left[others] ** 2))), float(left[pose]), int(pose)))
    if not fits:
        return None
    rest, missed, worst = min(fits)
    return worst if missed > max(_OUTLYING * rest, _OUTLYING_FORCE) else None


def _counted(residual: Floats) -> Floats:
    """Size of residuals, torques as forces at `LEVER`, shape (n,), N."""
    weighed = residual / np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
    return np.asarray(np.linalg.norm(weighed, axis=-1))


def _of_load(weight: float, inclination: Floats, spread: Floats) -> tuple[float, Floats]:
    """Carry the covariance of L over to its length and its two angles, as standard errors."""
    u, v = inclination
    along = wrench.gravity(1.0, inclination)
    by_u = np.array([-np.sin(u) * np.sin(v), -np.cos(u), np.sin(u) * np.cos(v)])
    by_v = np.array([np.cos(v), 0.0, np.sin(v)])
    sizes = [float(np.sqrt(direction @ spread @ direction)) for direction in (along, by_u, by_v)]
    if weight == 0.0:
        return sizes[0], np.full(2, np.pi)
    angles = np.array([sizes[1], sizes[2] / max(abs(np.cos(u)), 1e-9)]) / weight
    return sizes[0], np.minimum(angles, np.pi)


def _different(R: Floats) -> int:
    """Count orientations that differ from all before them."""
    kept: list[int] = []
    for i in range(len(R)):
        turns = log(R[kept] @ R[i].T)
        if not (np.linalg.norm(turns, axis=-1) < SAME).any():
            kept.append(i)
    return len(kept)

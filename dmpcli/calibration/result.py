"""From static poses to a tool: what is believed, what is refused, and the table that says so."""

from dataclasses import replace

import numpy as np

from dmpcli.admittance.payload_identification import Identification, identify
from dmpcli.arrays import Floats
from dmpcli.calibration.resting import STILL, STILL_ANGLE, at_rest
from dmpcli.errors import RefusedError
from dmpcli.instruments.protocols import SensorInfo
from dmpcli.records.static_poses import StaticPose
from dmpcli.records.tool import SensorIdentity
from dmpcli.spatial.wrench import LEVER, Tool

UNSTEADY = 0.2
"""N: a pose whose force changes by more than this while it is read swings, or is being touched."""


def identified(
    poses: list[StaticPose], geometry: Tool, condition: float, max_residual: float
) -> tuple[Identification, list[str]]:
    """Identify what hangs on the sensor, and judge it.

    Parameters
    ----------
    poses : list of StaticPose
    geometry : Tool
        Where TCP and sensor sit; the sensor's turn on the flange is taken from here.
    condition : float
        Largest condition number.
    max_residual : float
        Largest RMS residual, N; torques count as forces at `LEVER`.

    Returns
    -------
    Identification
        Of all poses; `used` tells which.
    remarks : list of str
        Which poses were left out, and why.

    Raises
    ------
    RefusedError
        The poses are ill-conditioned, or do not fit one tool.
    """
    remarks = {row: why for row, pose in enumerate(poses) if (why := _disbelief(pose))}
    rows = [row for row in range(len(poses)) if row not in remarks]
    if not rows:
        raise RefusedError(_left_out(0, remarks[0]) if poses else "no pose was taken")
    R = np.array([poses[row].rotation for row in rows]) @ geometry.sensor_in_tcp
    t = np.array([poses[row].t for row in rows])
    found = identify(R, np.array([poses[row].wrench for row in rows]), t, condition)
    residual, used = np.full((len(poses), 6), np.nan), np.zeros(len(poses), dtype=bool)
    residual[rows], used[rows] = found.residual, found.used
    found = replace(found, residual=residual, used=used)
    for row in rows:
        if not used[row]:
            force, torque = np.linalg.norm(residual[row].reshape(2, 3), axis=-1)
            remarks[row] = (
                f"it contradicts the others by {force:.2g} N, {torque:.2g} N·m; did something "
                "touch the tool?"
            )
    _check_residual(found, max_residual)
    return found, [_left_out(row, why) for row, why in sorted(remarks.items())]


def identity(info: SensorInfo) -> SensorIdentity:
    """Return what a sensor says of itself, as the tool file keeps it."""
    return SensorIdentity(make=info.make, product=info.product, serial=info.serial)


def with_payload(geometry: Tool, found: Identification) -> Tool:
    """Return the tool with what was identified."""
    p = found.payload
    return replace(
        geometry, weight=p.weight, centre=p.centre, inclination=p.inclination, zero=p.zero
    )


def table(found: Identification) -> list[tuple[str, str, str, str]]:
    """Return what was identified: name, values, standard errors, unit.

    The residuals' RMS stand among the values, the largest among the errors.
    """
    p, e, degree = found.payload, found.error, np.degrees
    drift = (
        []
        if found.drift is None
        else [("drift, force", _shown(1e3 * found.drift[:3], 2), "", "mN/s")]
    )
    return [
        _row("weight", p.weight, e.weight, "N", 3),
        _row("centre of mass", p.centre, e.centre, "mm", 2),
        _row("zero, force", p.zero[:3], e.zero[:3], "N", 3),
        _row("zero, torque", p.zero[3:], e.zero[3:], "N·m", 4),
        _row("inclination U V", degree(p.inclination), degree(e.inclination), "°", 3),
        _row("residual, force", found.rms[0], found.largest[0], "N", 4),
        _row("residual, torque", found.rms[1], found.largest[1], "N·m", 5),
        *drift,
    ]


def verdict(found: Identification) -> str:
    """Return in one line how many poses were used and how well they hold the payload."""
    force, torque = found.condition
    return (
        f"{int(found.used.sum())} of {len(found.used)} poses used, condition numbers {force:.2f} "
        f"and {torque:.2f}"
    )


def _row(
    name: str, value: float | Floats, error: float | Floats, unit: str, digits: int
) -> tuple[str, str, str, str]:
    return name, _shown(value, digits), _shown(error, digits), unit


def _shown(numbers: float | Floats, digits: int) -> str:
    return "  ".join(f"{number:.{digits}f}" for number in np.atleast_1d(numbers))


def _disbelief(pose: StaticPose) -> str:
    """Why a pose may not be used; empty if it may."""
    if not at_rest(pose.moved, pose.turned):
        return (
            f"the tool moved by {pose.moved:.3g} mm, {pose.turned:.3g} rad (at rest is {STILL:g} "
            f"mm, {STILL_ANGLE:g} rad)"
        )
    if not pose.unsteady <= UNSTEADY:
        return f"the force changed by {pose.unsteady:.2g} N while it was read; let it hang still"
    return ""


def _left_out(row: int, why: str) -> str:
    return f"pose {row + 1} is left out: {why}"


def _check_residual(found: Identification, limit: float) -> None:
    force, torque = found.rms
    if max(force, torque / LEVER) <= limit:
        return
    size = np.linalg.norm(found.residual[:, :3], axis=-1)
    worst = int(np.argmax(np.where(found.used, size, -1.0)))
    raise RefusedError(
        f"the poses do not fit one tool: residual {force:.3g} N, {torque:.2g} N·m RMS, largest at "
        f"pose {worst + 1}; is the sensor turned on the flange otherwise than the tool file says, "
        "does a cable pull, did something touch?"
    )

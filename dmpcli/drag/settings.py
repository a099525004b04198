"""Settings of ``record``: what options, ``--config`` and presets may say, with their ranges."""

from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field

from dmpcli.errors import InputError
from dmpcli.planning.limits import ordered
from dmpcli.primitives.admittance import Bounds, Law, check_stable
from dmpcli.records.settings import Settings

# Wide enough for any tool, and no product of two of them overflows.
Coefficient = Annotated[float, Field(ge=-1e9, le=1e9)]
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Six = tuple[Coefficient, Coefficient, Coefficient, Coefficient, Coefficient, Coefficient]
Three = tuple[Coordinate, Coordinate, Coordinate]
Positive = Annotated[float, Field(ge=1e-6, le=1e6)]
NotNegative = Annotated[float, Field(ge=0, le=1e6)]
Workspace = Annotated[
    tuple[Coordinate, Coordinate, Coordinate, Coordinate, Coordinate, Coordinate],
    AfterValidator(ordered),
]
_LIGHTEST = 1e-9


class RecordSettings(Settings):
    """The ``[record]`` section; lengths in mm, angles in rad, time in s, forces in N."""

    # Admittance model, eq. (1)-(3): x, y, z in N·s²/mm, N·s/mm, N/mm; rotations in kg·m²,
    # N·m·s/rad, N·m/rad. Presets hold them; there is no set that suits every tool.
    mass: Six
    damping: Six
    stiffness: Six
    control_rate: Annotated[float, Field(ge=1, le=1000, description="Hz")] = 50.0
    sensor_rate: Annotated[float, Field(ge=1, le=7000, description="Hz")] = 100.0

    # Compensation.
    low_pass: Annotated[float, Field(ge=1e-3, le=1e4, description="cut-off, Hz")] = 10.0
    dead_band_force: Annotated[NotNegative, Field(description="N")] = 1.0
    dead_band_torque: Annotated[NotNegative, Field(description="N·m")] = 0.05
    bias_time: Annotated[float, Field(ge=0.01, le=60, description="s at rest for the zero")] = 0.5

    # Bounds of the reference's motion.
    speed: Annotated[Positive, Field(description="mm/s")] = 250.0
    acceleration: Annotated[Positive, Field(description="mm/s²")] = 2000.0
    turning: Annotated[Positive, Field(description="rad/s")] = 0.8
    turning_acceleration: Annotated[Positive, Field(description="rad/s²")] = 8.0

    # When the loop stops by itself. The distances are from every set-point of the last look-ahead
    # and a tenth of a second; the built-in drag has no set-points, only the workspace counts.
    following_error: Annotated[Positive, Field(description="mm")] = 5.0
    following_angle: Annotated[Positive, Field(description="rad")] = 0.1
    max_force: Annotated[Positive, Field(description="N, of the hand and the work")] = 100.0
    max_torque: Annotated[Positive, Field(description="N·m, at the TCP")] = 10.0
    # What a known zero may miss at rest: half as much again as the dead-band, beyond which the arm
    # creeps with nobody at it. A zero that drifts by 2 mN/s gets there in twelve minutes.
    tool_check: Annotated[Positive, Field(description="N, and N·m at 0.1 m")] = 1.5
    workspace: Annotated[Workspace | None, Field(description="box for the TCP, mm")] = None

    # The recording.
    drag: Literal["admittance", "builtin"] = "admittance"
    duration: Annotated[float | None, Field(ge=0.1, le=3600, description="s")] = None
    until_rest: Annotated[float | None, Field(ge=0.01, le=60, description="s")] = None
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0

    # The mock tutor's stroke: the paper's, unless said otherwise.
    reference: str = "sine"
    start: Three = (-551.030, 131.399, -17.560)
    goal: Three = (-660.021, 130.034, -17.538)
    wave_height: Annotated[Positive, Field(description="mm, peak to trough")] = 49.979
    periods: Annotated[float, Field(ge=0.01, le=100)] = 1.0

    @property
    def law(self) -> Law:
        """The admittance model at the control rate."""
        return Law(
            np.array(self.mass),
            np.array(self.damping),
            np.array(self.stiffness),
            1.0 / self.control_rate,
        )

    @property
    def coasting(self) -> float:
        """Longest M/D of the axes, s: how long the tool runs on when it is let go."""
        return float(np.max(np.array(self.mass) / np.array(self.damping)))

    @property
    def bounds(self) -> Bounds:
        """Largest speeds and accelerations of the reference."""
        return Bounds(self.speed, self.acceleration, self.turning, self.turning_acceleration)


def check(settings: RecordSettings) -> None:
    """Refuse settings that fit their ranges but not each other, before anything moves.

    Raises
    ------
    InputError
        The admittance model is unstable or has no mass to speak of, the sensor is slower than the
        control loop, or the low-pass is above what the sensor's rate can show.
    """
    check_stable(settings.law)
    if min(settings.mass) < _LIGHTEST:
        raise InputError(
            f"[record] mass = {min(settings.mass):g}: must be {_LIGHTEST:g} or more on every axis"
        )
    if settings.sensor_rate < settings.control_rate:
        raise InputError(
            f"[record] sensor_rate = {settings.sensor_rate:g} Hz is below control_rate = "
            f"{settings.control_rate:g} Hz: the loop would run on stale forces; raise it"
        )
    if settings.low_pass >= 0.5 * settings.sensor_rate:
        raise InputError(
            f"[record] low_pass = {settings.low_pass:g} Hz: must be below half the sensor_rate, "
            f"{0.5 * settings.sensor_rate:g} Hz"
        )

"""Settings of ``record``: what options, ``--config`` and presets may say, with their ranges."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from annotated_types import Ge, Le, Lt

from dmpcli.errors import InputError
from dmpcli.settings.model import Option, Settings
from dmpcli.settings.ranges import CORNERS, XYZ, Box, Three

if TYPE_CHECKING:
    from dmpcli.admittance.model import AdmittanceLaw, Bounds
    from dmpcli.arrays import Floats

# Wide enough for any tool, and no product of two of them overflows.
Coefficient = Annotated[float, Ge(-1e9), Le(1e9)]
Six = tuple[Coefficient, Coefficient, Coefficient, Coefficient, Coefficient, Coefficient]
Positive = Annotated[float, Ge(1e-6), Le(1e6)]
NotNegative = Annotated[float, Ge(0), Le(1e6)]
_LIGHTEST = 1e-9

ROOM = 500.0
"""mm to each side of the start: more than a hand draws, and less than a runaway arm has."""

TUTOR = ("seed", "reference", "start", "goal", "wave_height", "periods")
"""Settings of the mock's hand, which mean nothing where a person draws."""


@dataclass(frozen=True, kw_only=True)
class RecordSettings(Settings):
    """The ``[record]`` section; lengths in mm, angles in rad, time in s, forces in N."""

    section: ClassVar[str] = "record"
    preset: ClassVar[str | None] = "drag"

    # Admittance model, eq. (1)-(3): x, y, z in N·s²/mm, N·s/mm, N/mm; rotations in kg·m²,
    # N·m·s/rad, N·m/rad. Presets hold them; there is no set that suits every tool.
    mass: Six
    damping: Six
    stiffness: Six
    control_rate: Annotated[float, Ge(1), Le(1000)] = 50.0  # Hz
    sensor_rate: Annotated[float, Ge(1), Le(7000)] = 100.0  # Hz

    # Compensation.
    low_pass: Annotated[float, Ge(1e-3), Le(1e4)] = 10.0  # cut-off, Hz
    dead_band_force: NotNegative = 1.0  # N
    dead_band_torque: NotNegative = 0.05  # N·m
    bias_time: Annotated[float, Ge(0.01), Le(60)] = 0.5  # s at rest for the zero

    # Bounds of the reference's motion.
    speed: Positive = 250.0  # mm/s
    acceleration: Positive = 2000.0  # mm/s²
    turning: Positive = 0.8  # rad/s
    turning_acceleration: Positive = 8.0  # rad/s²

    # When the loop stops by itself. The distances are from every set-point of the last look-ahead
    # and a tenth of a second; the built-in drag has no set-points, only the workspace counts.
    following_error: Annotated[Positive, Option("Stop when the arm strays further.", "mm")] = 5.0
    following_angle: Positive = 0.1  # rad
    max_force: Annotated[
        Positive, Option("Stop at a larger force of the hand and the work.", "N")
    ] = 100.0
    max_torque: Annotated[Positive, Option("Stop at a larger torque about the tip.", "N·m")] = 10.0
    # What a known zero may miss at rest: half as much again as the dead-band, beyond which the arm
    # creeps with nobody at it. A zero that drifts by 2 mN/s gets there in twelve minutes.
    tool_check: Annotated[
        Positive,
        Option("What the tool file may miss of the reading at rest; torque at 0.1 m.", "N"),
    ] = 1.5
    workspace: Annotated[
        Box | None,
        Option(
            "Box to stay in, mm; or none.",
            metavar=CORNERS,
            unset=f"{ROOM:g} mm about the start",
        ),
    ] = None

    # The recording.
    drag: Annotated[Literal["admittance", "builtin"], Option("Who moves the arm.")] = "admittance"
    duration: Annotated[
        float | None,
        Ge(0.1),
        Le(3600),
        Option(
            "How long, with the rests of the mock's hand; then it ends.",
            "s",
            unset="until asked, or the mock's hand is done",
        ),
    ] = None
    until_rest: Annotated[
        float | None,
        Ge(0.01),
        Le(60),
        Option("End once the tool has moved and rested for so long.", "s", unset="never"),
    ] = None
    seed: Annotated[int, Ge(0), Lt(2**63), Option("Of the simulated hand, sensor and faults.")] = 0

    # The mock tutor's stroke: the paper's, unless said otherwise.
    reference: Annotated[
        str,
        Option(
            "What the mock's hand draws; a file ends in .csv.",
            metavar="FILE",
            choices=("sine", "line", "circle"),
        ),
    ] = "sine"
    start: Annotated[Three, Option("Of what it draws.", "mm", metavar=XYZ)] = (
        -551.030,
        131.399,
        -17.560,
    )
    goal: Annotated[Three, Option("Of what it draws.", "mm", metavar=XYZ)] = (
        -660.021,
        130.034,
        -17.538,
    )
    wave_height: Annotated[Positive, Option("Of the sine, peak to trough.", "mm")] = 49.979
    periods: Annotated[float, Ge(0.01), Le(100), Option("Of the sine.")] = 1.0

    @property
    def law(self) -> "AdmittanceLaw":
        """The admittance model at the control rate."""
        import numpy as np

        from dmpcli.admittance.model import AdmittanceLaw

        return AdmittanceLaw(
            np.array(self.mass),
            np.array(self.damping),
            np.array(self.stiffness),
            1.0 / self.control_rate,
        )

    def room(self, start: "Floats") -> Box:
        """Return the workspace of a recording that begins at a point, shape (3,), mm."""
        if self.workspace is not None:
            return self.workspace
        low, high = (start - ROOM).tolist(), (start + ROOM).tolist()
        return (low[0], high[0], low[1], high[1], low[2], high[2])

    @property
    def coasting(self) -> float:
        """Longest M/D of the axes, s: how long the tool runs on when it is let go."""
        return max(mass / damping for mass, damping in zip(self.mass, self.damping, strict=True))

    @property
    def bounds(self) -> "Bounds":
        """Largest speeds and accelerations of the reference."""
        from dmpcli.admittance.model import Bounds

        return Bounds(self.speed, self.acceleration, self.turning, self.turning_acceleration)


def check(settings: RecordSettings) -> None:
    """Refuse settings that fit their ranges but not each other, before anything moves.

    Raises
    ------
    InputError
        The admittance model is unstable or has no mass to speak of, the sensor is slower than the
        control loop, or the low-pass is above what the sensor's rate can show.
    """
    from dmpcli.admittance.model import check_stable

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

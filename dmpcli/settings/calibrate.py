"""Settings of ``calibrate``: where each default comes from."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from annotated_types import Ge, Le

from dmpcli.dmp.options import CONDITION
from dmpcli.settings.execute import Positive
from dmpcli.settings.model import Option, Settings
from dmpcli.settings.ranges import CORNERS, Box


@dataclass(frozen=True, kw_only=True)
class CalibrateSettings(Settings):
    """The ``[calibrate]`` section, in mm, rad, s and N.

    Twelve poses that tilt by 45° have a condition number of 2.4; 30° has 3.7, 20° 5.7. A second at
    100 Hz brings the noise of a Mini45, 0.06 N, below 0.01 N.
    """

    section: ClassVar[str] = "calibrate"

    poses: Annotated[int, Ge(4), Le(100), Option("How many.")] = 12
    tilt: Annotated[
        float,
        Ge(0.05),
        Le(1.57),
        Option("How far the tool is tilted.", "°", factor=math.pi / 180.0),
    ] = math.pi / 4.0
    dwell: Annotated[float, Ge(0.05), Le(60), Option("How long each pose is read.", "s")] = 1.0
    settle: Annotated[float, Ge(0.05), Le(10)] = 0.3  # s at rest before them
    patience: Annotated[float, Ge(0.1), Le(600)] = 5.0  # s until it must rest
    sensor_rate: Annotated[float, Ge(1), Le(7000)] = 100.0  # Hz

    # How the arm goes from pose to pose: a turn of 45° in about four seconds.
    period: Annotated[Positive, Option("Servo period.", "s")] = 0.02
    max_rotation_speed: Annotated[Positive, Option("Largest speed of turning.", "rad/s")] = 0.4
    max_rotation_acceleration: Positive = 2.0
    max_rotation_jerk: Positive = 50.0
    workspace: Annotated[
        Box | None, Option("Box to stay in, mm.", metavar=CORNERS, unset="none")
    ] = None
    following_error: Positive = 5.0
    following_angle: Positive = 0.1
    # Change of the reading since the start: the tool's own weight turning, or something in its way.
    max_force: Annotated[Positive, Option("Stop when the reading changes by more.", "N")] = 30.0
    max_torque: Annotated[Positive, Option("Stop when the reading changes by more.", "N·m")] = 3.0

    # What is refused.
    condition: Annotated[
        float, Ge(1.5), Le(1000), Option("Refuse a worse conditioned set of poses.")
    ] = CONDITION
    max_residual: Annotated[
        Positive, Option("Refuse poses that fit worse, RMS; torque at 0.1 m.", "N")
    ] = 0.3

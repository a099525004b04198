"""Settings of ``calibrate``: where each default comes from."""

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from dmpcli.planning.limits import Limits, ordered
from dmpcli.primitives.identification import CONDITION
from dmpcli.records.settings import Settings

Positive = Annotated[float, Field(ge=1e-9, le=1e9)]
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Workspace = Annotated[
    tuple[Coordinate, Coordinate, Coordinate, Coordinate, Coordinate, Coordinate],
    AfterValidator(ordered),
]


class CalibrateSettings(Settings):
    """The ``[calibrate]`` section, in mm, rad, s and N.

    Twelve poses that tilt by 45° have a condition number of 2.4; 30° has 3.7, 20° 5.7. A second at
    100 Hz brings the noise of a Mini45, 0.06 N, below 0.01 N.
    """

    poses: Annotated[int, Field(ge=4, le=100)] = 12
    tilt: Annotated[float, Field(ge=0.05, le=1.57, description="rad")] = np.pi / 4.0
    dwell: Annotated[float, Field(ge=0.05, le=60, description="s of readings per pose")] = 1.0
    settle: Annotated[float, Field(ge=0.05, le=10, description="s at rest before them")] = 0.3
    patience: Annotated[float, Field(ge=0.1, le=600, description="s until it must rest")] = 5.0
    sensor_rate: Annotated[float, Field(ge=1, le=7000, description="Hz")] = 100.0

    # How the arm goes from pose to pose: a turn of 45° in about four seconds.
    period: Positive = 0.02
    max_rotation_speed: Positive = 0.4
    max_rotation_acceleration: Positive = 2.0
    max_rotation_jerk: Positive = 50.0
    workspace: Workspace | None = None
    following_error: Positive = 5.0
    following_angle: Positive = 0.1
    # Change of the reading since the start: the tool's own weight turning, or something in its way.
    max_force: Positive = 30.0
    max_torque: Positive = 3.0

    # What is refused.
    condition: Annotated[float, Field(ge=1.5, le=1000)] = CONDITION
    max_residual: Annotated[Positive, Field(description="RMS, N, and N·m at 0.1 m")] = 0.3

    @property
    def limits(self) -> Limits:
        """Limits of the set-points; the TCP stays where it is but for what the arm strayed."""
        return Limits(
            20.0,
            200.0,
            5000.0,
            self.max_rotation_speed,
            self.max_rotation_acceleration,
            self.max_rotation_jerk,
            self.workspace,
        )

"""The settings of `execute`: where each default comes from."""

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from dmpcli.errors import InputError
from dmpcli.primitives import admittance
from dmpcli.primitives.coupling import Law
from dmpcli.records.settings import Settings
from dmpcli.streaming.limits import Limits

Positive = Annotated[float, Field(gt=0)]


class ExecuteSettings(Settings):
    """Settings of `execute`, in mm, rad, s and N.

    The speed is what the safety standards of industrial arms call reduced (250 mm/s). The
    acceleration is that of the EC66's published Cartesian limits (1 m/s, 2.25 m/s², 1.57 rad/s);
    the rotation speed is half of theirs. For the rest they state nothing, and the values are ours:
    rotation about a tip 150 mm below the flange shall accelerate the flange no more than the tip
    may be, and either acceleration is not reached in less than 45 ms, about two periods of 20 ms.
    """

    period: Positive = 0.02
    speed: Positive = 1.0
    max_speed: Positive = 250.0
    max_acceleration: Positive = 2250.0
    max_jerk: Positive = 50_000.0
    max_rotation_speed: Positive = 0.785
    max_rotation_acceleration: Positive = 15.0
    max_rotation_jerk: Positive = 333.0
    workspace: tuple[float, float, float, float, float, float] | None = None
    # Inside the tolerance the arm is led to the start at lead_speed; beyond, only when asked.
    start_tolerance: Positive = 2.0
    start_angle: Positive = 0.035
    lead_speed: Positive = 20.0
    approach: Positive | None = None
    # Distance of the actual pose from every set-point of the last look-ahead and a tenth of a
    # second: what a look-ahead delays is no error, what stands still or strays is.
    following_error: Positive = 5.0
    following_angle: Positive = 0.1
    max_force: Positive = 50.0
    force_setpoint: Positive | None = None
    # M/D = 40 ms and no spring: the force settles at the set-point without a steady error, on a
    # plate of 5 N/mm behind 0.1 s of delay within about a second. It seeks at F_d/D.
    coupling_mass: Positive = 0.08
    coupling_damping: Positive = 2.0
    coupling_stiffness: Annotated[float, Field(ge=0)] = 0.0
    coupling_clamp: Positive = 5.0
    coupling_contact: Positive = 0.5
    coupling_patience: Positive = 0.1
    coupling_release: Positive = 10.0

    @model_validator(mode="after")
    def _box(self) -> "ExecuteSettings":
        box = self.workspace
        if box is not None and not all(
            low < high for low, high in zip(box[::2], box[1::2], strict=True)
        ):
            raise ValueError("each minimum of the workspace must lie below its maximum")
        return self

    @property
    def limits(self) -> Limits:
        """The limits of the set-points."""
        return Limits(
            self.max_speed,
            self.max_acceleration,
            self.max_jerk,
            self.max_rotation_speed,
            self.max_rotation_acceleration,
            self.max_rotation_jerk,
            self.workspace,
        )

    def law(self) -> Law:
        """The admittance model of the force coupling.

        Raises
        ------
        InputError
            It would be unstable at the servo period.
        """
        if self.force_setpoint is None:
            raise InputError("--coupling force needs a force to press with: --force-setpoint N")
        model = admittance.Law(
            np.array([self.coupling_mass]),
            np.array([self.coupling_damping]),
            np.array([self.coupling_stiffness]),
            self.period,
        )
        admittance.check_stable(model, ("along the normal",))
        return Law(
            model,
            self.force_setpoint,
            self.coupling_clamp,
            # A force-setpoint near or below it would count as no contact.
            min(self.coupling_contact, self.force_setpoint / 2.0),
            self.coupling_patience,
            self.coupling_release,
        )

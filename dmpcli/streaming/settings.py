"""The settings of `execute`: where each default comes from."""

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from dmpcli.errors import InputError
from dmpcli.planning.limits import Limits, ordered
from dmpcli.primitives import admittance
from dmpcli.primitives.coupling import Law
from dmpcli.records.settings import Settings

# No product of two of them overflows.
Positive = Annotated[float, Field(ge=1e-9, le=1e9)]
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Workspace = Annotated[
    tuple[Coordinate, Coordinate, Coordinate, Coordinate, Coordinate, Coordinate],
    AfterValidator(ordered),
]

COUPLED = 0.1
"""Look-ahead that the coupling's mass and damping are for, s."""


class ExecuteSettings(Settings):
    """Settings of `execute`, in mm, rad, s and N.

    The speed is what the safety standards of industrial arms call reduced (250 mm/s). The
    acceleration is that of the EC66's published Cartesian limits (1 m/s, 2.25 m/s², 1.57 rad/s);
    the rotation speed is half of theirs. For the rest they state nothing, and the values are ours:
    rotation about a tip 150 mm below the flange shall accelerate the flange no more than the tip
    may be, and either acceleration is not reached in less than 45 ms, about two periods of 20 ms.
    """

    period: Positive = 0.02
    speed: Annotated[float, Field(ge=0.001, le=10)] = 1.0
    max_speed: Positive = 250.0
    max_acceleration: Positive = 2250.0
    max_jerk: Positive = 50_000.0
    max_rotation_speed: Positive = 0.785
    max_rotation_acceleration: Positive = 15.0
    max_rotation_jerk: Positive = 333.0
    workspace: Workspace | None = None
    # Inside the tolerance the arm is led to the start at lead_speed; beyond, only when asked.
    start_tolerance: Positive = 2.0
    start_angle: Positive = 0.035
    lead_speed: Positive = 20.0
    approach: Positive | None = None
    # Between strokes. 20 mm are more than any coupling's clamp; through the air less than half the
    # reduced speed, off the work a fifth of it as nothing is in the way, onto it lead_speed.
    clearance: Annotated[float, Field(ge=1, le=1e4)] | None = None
    transfer_speed: Positive = 100.0
    retract_speed: Positive = 50.0
    # Distance of the actual pose from every set-point of the last look-ahead and a tenth of a
    # second: what a look-ahead delays is no error, what stands still or strays is.
    following_error: Positive = 5.0
    following_angle: Positive = 0.1
    max_force: Positive = 50.0
    max_torque: Positive = 5.0
    # What a tool file's zero may miss at rest, N, and N·m at 0.1 m; see RecordSettings.
    tool_check: Positive = 1.5
    # Of a marking pen; a polishing pad wants more.
    force_setpoint: Positive = 5.0
    # M/D = 40 ms and no spring: the force settles at the set-point without a steady error, on a
    # plate of 5 N/mm behind 0.1 s of look-ahead within about a second. It seeks at F_d/D. A longer
    # look-ahead raises M and D in proportion: the stiffest plate that is stable has about D/delay.
    coupling_mass: Positive = 0.08
    coupling_damping: Positive = 2.0
    coupling_stiffness: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    coupling_clamp: Positive = 5.0
    coupling_contact: Positive = 0.5
    coupling_patience: Positive = 0.1
    coupling_release: Positive = 10.0

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

    def law(self, lookahead: float = 0.0) -> Law:
        """The admittance model of the force coupling.

        Parameters
        ----------
        lookahead : float
            Of the arm, s; beyond `COUPLED` the model is slowed down in proportion.

        Raises
        ------
        InputError
            It would be unstable at the servo period, or press as hard as the run allows.
        """
        if self.force_setpoint >= self.max_force:
            raise InputError(
                f"--force-setpoint {self.force_setpoint:g}: is not below --max-force "
                f"{self.max_force:g}, at which the run stops"
            )
        slow = max(lookahead / COUPLED, 1.0)
        model = admittance.Law(
            np.array([slow * self.coupling_mass]),
            np.array([slow * self.coupling_damping]),
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

"""The settings of `execute`: where each default comes from."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from annotated_types import Ge, Le

from dmpcli.errors import InputError
from dmpcli.settings.model import Option, Settings
from dmpcli.settings.ranges import CORNERS, Box

if TYPE_CHECKING:
    from dmpcli.admittance.force_coupling import CouplingLaw

# No product of two of them overflows.
Positive = Annotated[float, Ge(1e-9), Le(1e9)]

COUPLED = 0.1
"""Look-ahead that the coupling's mass and damping are for, s."""


@dataclass(frozen=True, kw_only=True)
class ExecuteSettings(Settings):
    """Settings of `execute`, in mm, rad, s and N.

    The speed is what the safety standards of industrial arms call reduced (250 mm/s). The
    acceleration is that of the EC66's published Cartesian limits (1 m/s, 2.25 m/s², 1.57 rad/s);
    the rotation speed is half of theirs. For the rest they state nothing, and the values are ours:
    rotation about a tip 150 mm below the flange shall accelerate the flange no more than the tip
    may be, and either acceleration is not reached in less than 45 ms, about two periods of 20 ms.
    """

    section: ClassVar[str] = "execute"

    period: Annotated[Positive, Option("Servo period.", "s")] = 0.02
    speed: Annotated[
        float,
        Ge(0.001),
        Le(10),
        Option("Times as fast as planned; below 1 the ways are slower too."),
    ] = 1.0
    max_speed: Annotated[Positive, Option("Largest speed of the tip.", "mm/s")] = 250.0
    max_acceleration: Annotated[Positive, Option("Largest acceleration of the tip.", "mm/s²")] = (
        2250.0
    )
    max_jerk: Annotated[Positive, Option("Largest jerk of the tip.", "mm/s³")] = 50_000.0
    max_rotation_speed: Annotated[Positive, Option("Largest speed of turning.", "rad/s")] = 0.785
    max_rotation_acceleration: Annotated[
        Positive, Option("Largest acceleration of turning.", "rad/s²")
    ] = 15.0
    max_rotation_jerk: Annotated[Positive, Option("Largest jerk of turning.", "rad/s³")] = 333.0
    workspace: Annotated[
        Box | None, Option("Box to stay in, mm.", metavar=CORNERS, unset="none")
    ] = None
    # Inside the tolerance the arm is led to the start at lead_speed; beyond, only when asked.
    start_tolerance: Annotated[
        Positive, Option("How far off the start the arm may stand.", "mm")
    ] = 2.0
    start_angle: Positive = 0.035
    lead_speed: Positive = 20.0
    approach: Annotated[
        Positive | None,
        Option("Go to the start, no faster than this.", "mm/s", unset="not at all"),
    ] = None
    # Between strokes. 20 mm are more than any coupling's clamp; through the air less than half the
    # reduced speed, off the work a fifth of it as nothing is in the way, onto it lead_speed.
    clearance: Annotated[
        float | None,
        Ge(1),
        Le(1e4),
        Option("Lift the pen by this after each stroke.", "mm", unset="20 for several strokes"),
    ] = None
    transfer_speed: Annotated[Positive, Option("Through the air, at most.", "mm/s")] = 100.0
    retract_speed: Annotated[Positive, Option("Off the work, at most.", "mm/s")] = 50.0
    # Distance of the actual pose from every set-point of the last look-ahead and a tenth of a
    # second: what a look-ahead delays is no error, what stands still or strays is.
    following_error: Annotated[Positive, Option("Stop when the arm strays further.", "mm")] = 5.0
    following_angle: Positive = 0.1
    # Of the arm at a stroke's end, and at rest at the end of the run, from where it was led to.
    # Under force coupling only across the normal.
    arrival_tolerance: Annotated[
        Positive, Option("How far off its end a stroke may come to rest.", "mm")
    ] = 1.0
    arrival_angle: Annotated[Positive, Option("The same, turned.", "rad")] = 0.0175
    max_force: Annotated[Positive, Option("Stop at a larger force on the tool.", "N")] = 50.0
    max_torque: Annotated[Positive, Option("Stop at a larger torque about its tip.", "N·m")] = 5.0
    # What a tool file's zero may miss at rest, N, and N·m at 0.1 m; see RecordSettings.
    tool_check: Annotated[
        Positive,
        Option("What the tool file may miss of the reading at rest; torque at 0.1 m.", "N"),
    ] = 1.5
    # Of a marking pen; a polishing pad wants more.
    force_setpoint: Annotated[Positive, Option("Force to press with.", "N")] = 5.0
    # M/D = 40 ms and no spring: the force settles at the set-point without a steady error, on a
    # plate of 5 N/mm behind 0.1 s of look-ahead within about a second. It seeks at F_d/D. A longer
    # look-ahead raises M and D in proportion: the stiffest plate that is stable has about D/delay.
    coupling_mass: Positive = 0.08
    coupling_damping: Positive = 2.0
    coupling_stiffness: Annotated[float, Ge(0), Le(1e9)] = 0.0
    coupling_clamp: Positive = 5.0
    coupling_contact: Positive = 0.5
    coupling_patience: Positive = 0.1
    coupling_release: Positive = 10.0

    def law(self, lookahead: float = 0.0) -> "CouplingLaw":
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
        import numpy as np

        from dmpcli.admittance import model as admittance
        from dmpcli.admittance.force_coupling import CouplingLaw

        if self.force_setpoint >= self.max_force:
            raise InputError(
                f"--force-setpoint {self.force_setpoint:g}: is not below --max-force "
                f"{self.max_force:g}, at which the run stops"
            )
        slow = max(lookahead / COUPLED, 1.0)
        model = admittance.AdmittanceLaw(
            np.array([slow * self.coupling_mass]),
            np.array([slow * self.coupling_damping]),
            np.array([self.coupling_stiffness]),
            self.period,
        )
        admittance.check_stable(model, ("along the normal",))
        return CouplingLaw(
            model,
            self.force_setpoint,
            self.coupling_clamp,
            # A force-setpoint near or below it would count as no contact.
            min(self.coupling_contact, self.force_setpoint / 2.0),
            self.coupling_patience,
            self.coupling_release,
        )

"""The settings of `execute`: where each default comes from."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from annotated_types import Ge, Le

from dmpcli.errors import InputError
from dmpcli.settings.model import Option, Settings
from dmpcli.settings.ranges import CORNERS, Box

if TYPE_CHECKING:
    from dmpcli.admittance.force_law import ForceGains

# No product of two of them overflows.
Positive = Annotated[float, Ge(1e-9), Le(1e9)]

COUPLED = 0.1
"""Look-ahead behind which a force is held well, s."""

SETPOINT = 5.0
"""Of a marking pen, where neither trajectory nor person says another, N."""

CLAMP = 15.0
"""How far off the plan a surface may be that is drawn on, mm; below the usual clearance."""


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
    # How far from the planned goal one that is told while the stroke runs may lie, mm.
    goal_range: Positive = 200.0
    # Of a marking pen; a polishing pad wants more.
    force_setpoint: Annotated[
        Positive | None,
        Option("Force to press with.", "N", unset="the trajectory's, else 5"),
    ] = None
    stiffness: Annotated[
        Positive | None,
        Option("Of tool and surface in series.", "N/mm", unset="measured at the landing"),
    ] = None
    delay: Annotated[
        Annotated[float, Ge(1e-3), Le(2)] | None,
        Option("From a displacement to its force.", "s", unset="measured at the landing"),
    ] = None
    on_contact_loss: Annotated[
        Literal["seek", "hold", "stop"],
        Option("Where contact is lost: seek it again and then stop, go on, or stop."),
    ] = "seek"
    min_contact: Annotated[
        float,
        Ge(0),
        Le(100),
        Option("Share of a stroke in contact that counts as drawn.", "%"),
    ] = 95.0
    normal_from_force: Annotated[
        bool, Option("Hold the force along the surface's own normal, as friction and motion show.")
    ] = False
    # How far that may lean from the planned normal, rad, and how fast it may turn, rad/s.
    normal_angle: Annotated[float, Ge(0.001), Le(0.7)] = 0.175
    normal_rate: Positive = 0.175
    # None of them is by the rule of `admittance.force_law`, from what the landing has measured.
    coupling_mass: Positive | None = None
    coupling_damping: Positive | None = None
    coupling_stiffness: Annotated[float, Ge(0), Le(1e9)] = 0.0
    # Limits of its own: how far off the plan the surface may be, how fast the correction, how hard.
    coupling_clamp: Positive | None = None
    coupling_rate: Positive = 10.0
    coupling_limit: Annotated[float, Ge(1.2), Le(100)] = 2.0
    # What is more across the normal than drag + rub times the normal force is a wall.
    coupling_drag: Positive = 2.0
    coupling_rub: Annotated[float, Ge(0), Le(100)] = 0.4
    # How far off the plan's start the surface is looked for, and how fast before anything is known.
    coupling_reach: Positive = 10.0
    coupling_seek: Positive = 2.0
    coupling_contact: Positive = 0.5
    coupling_patience: Positive = 0.06
    coupling_release: Positive = 10.0
    # What a lifted tool may read: its zero and payload are another's beyond.
    coupling_zero_limit: Positive = 2.0

    @property
    def clamp(self) -> float:
        """How far off the plan the surface may be that is drawn on, mm: less than the clearance."""
        if self.coupling_clamp is not None:
            return self.coupling_clamp
        return CLAMP if self.clearance is None else min(CLAMP, 0.75 * self.clearance)

    @property
    def reach(self) -> float:
        """How far off the plan's start it is looked for, mm."""
        return min(self.coupling_reach, self.clamp)

    def setpoint(self, largest: float | None = None) -> float:
        """The force to press with, N.

        Parameters
        ----------
        largest : float, optional
            The trajectory's own largest set-point; 0 of one that is lifted all along.

        Raises
        ------
        InputError
            It is as hard as the run allows.
        """
        wanted = self.force_setpoint or largest or SETPOINT
        if wanted >= self.max_force:
            said = "--force-setpoint" if self.force_setpoint else "the trajectory's fn ="
            raise InputError(
                f"{said} {wanted:g}: is not below --max-force {self.max_force:g}, at which the run "
                "stops"
            )
        return wanted

    def chosen_gains(self, tool: float = 0.0) -> "ForceGains | None":
        """The gains of the force coupling where a configuration states them; None is by the rule.

        Parameters
        ----------
        tool : float
            Mass on the sensor's tool side, N·s²/mm.

        Raises
        ------
        InputError
            They would be unstable at the servo period, with no contact at all; or with
            `stiffness` and `delay` where these are named.
        """
        if self.coupling_damping is None:
            if self.coupling_mass is not None:
                raise InputError(
                    "[execute] coupling_mass: says nothing without coupling_damping; give both, or "
                    "leave both to the rule"
                )
            return None
        import numpy as np

        from dmpcli.admittance import model as admittance
        from dmpcli.admittance.force_law import ForceGains
        from dmpcli.admittance.force_stability import is_safe

        damping = self.coupling_damping
        mass = self.period * damping if self.coupling_mass is None else self.coupling_mass
        model = admittance.AdmittanceLaw(
            np.array([mass]), np.array([damping]), np.array([self.coupling_stiffness]), self.period
        )
        admittance.check_stable(model, ("along the normal",))
        made = ForceGains(mass, damping, self.coupling_stiffness, math.inf, self.period)
        k, late = self.stiffness, self.delay
        if k is not None and late is not None and not is_safe(made, k, late, tool):
            raise InputError(
                f"[execute] coupling_damping = {damping:g}: unstable on a contact of {k:g} N/mm "
                f"behind {late:g} s (--stiffness, --delay); raise it, or leave it to the rule"
            )
        return made

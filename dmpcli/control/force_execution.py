"""What an execution under force is made of: policy, filter, sense of touch, and its words."""

from collections.abc import Callable

import numpy as np

from dmpcli.admittance.compensation import Compensation
from dmpcli.admittance.force_coupling import Filter, fast_filter
from dmpcli.control.contact_policy import ContactEvent, ContactPolicy, course
from dmpcli.control.contact_supervisor import ContactSupervisor
from dmpcli.control.cycle import ReadyArm
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.force_tracking import LONG, ForceInput, ForceTracker
from dmpcli.control.normal_sensing import NormalPolicy, NormalSense
from dmpcli.errors import InputError
from dmpcli.instruments.protocols import Sensor
from dmpcli.planning.plan import Plan
from dmpcli.records.stroke_selection import StrokeSelection
from dmpcli.settings.execute import COUPLED, ExecuteSettings
from dmpcli.spatial.trajectory import StrokeTrajectory
from dmpcli.spatial.wrench import Tool

SENSOR_RATE = 100.0
GRAVITY = 9.80665  # m/s²
AGAIN = 6.0
"""How far a surface is looked for where contact is lost, mm: deeper lies another part."""
DRIFTED = 0.15
"""N: a zero that has moved further is told; what noise leaves of one is a fifth of it."""
# A zero is taken over this time, s.
ZERO_TIME = 0.5


def touch(
    sensor: Sensor,
    tool: Tool,
    plan: Plan,
    settings: ExecuteSettings,
    arm: ReadyArm,
    coupling: Filter | None,
    tool_check: float | None = None,
    policy: ContactPolicy | None = None,
    told: Callable[[ContactEvent], None] = lambda _: None,
) -> ForceInput:
    """Let the sensor stream at rest, and return what the loop feels with.

    Parameters
    ----------
    sensor : Sensor
    tool : Tool
        Where its zero is None, it is taken now.
    plan : Plan
    settings : ExecuteSettings
    arm : ReadyArm
    coupling : Filter, optional
        None: only log the wrench.
    tool_check : float, optional
        By how much the tool's zero may miss the reading at rest, N; None does not check it.
    policy : ContactPolicy, optional
        Of the coupling.
    told : callable
        Told how the contact changes, as it does.

    Raises
    ------
    RefusedError
        The tool's zero and payload do not explain the reading.
    InstrumentError
        The sensor cannot be reached, is silent, or sends what must not be believed.
    """
    info = sensor.open()
    rate = min(SENSOR_RATE, info.rate)
    sensor.start(rate)
    sensing = Sensing(sensor, info, rate, plan.period, arm.clock)
    zeroed = sensing.zeroed(tool, plan.rotation[0], ZERO_TIME, tool_check)
    pressing = None
    if coupling is not None and policy is not None:
        supervisor = ContactSupervisor(policy, plan.period, told)
        normals = NormalPolicy(
            settings.normal_from_force, settings.normal_angle, settings.normal_rate
        )
        sense = NormalSense(plan.period, normals)
        pressing = ForceTracker(supervisor, coupling, plan, settings.force_setpoint, sense=sense)
    return ForceInput(sensing, Compensation(zeroed), pressing)


def coupling_filter(stroke: StrokeTrajectory, settings: ExecuteSettings) -> Filter:
    """Return the filter of eq. (10) on the normal axis.

    Where its file states no tau, the stroke's duration stands for it: the time constant that
    `fast_filter` chooses does not depend on tau, the gains k and d that it logs do.

    Raises
    ------
    InputError
        The trajectory states no normal, or a set-point is too large.
    """
    if stroke.normal is None:
        raise InputError(
            "--coupling force: the trajectory states no surface normal to press along; "
            "make it anew with generalize"
        )
    settings.setpoint(_largest(stroke))
    tau = float(stroke.facts.get("tau") or stroke.t[-1] - stroke.t[0])
    return fast_filter(tau / settings.speed, settings.period)


def _largest(stroke: StrokeTrajectory) -> float | None:
    return None if stroke.force is None else float(stroke.force.max())


def policy_of(
    batch: StrokeSelection, settings: ExecuteSettings, lookahead: float, weight: float = 0.0
) -> ContactPolicy:
    """Return what the coupling goes by in a run of these strokes.

    Parameters
    ----------
    batch : StrokeSelection
    settings : ExecuteSettings
    lookahead : float
        Of the arm, s.
    weight : float
        Of what the sensor carries, N.
    """
    own = [largest for stroke in batch.strokes if (largest := _largest(stroke))]
    setpoint = settings.setpoint(max(own, default=None))
    return ContactPolicy(
        setpoint,
        # A set-point near or below it would count as no contact.
        min(settings.coupling_contact, setpoint / 2.0),
        settings.reach,
        min(AGAIN, settings.reach),
        settings.coupling_seek,
        settings.coupling_release,
        settings.clamp,
        settings.coupling_rate,
        settings.coupling_limit,
        settings.coupling_drag,
        settings.coupling_rub,
        settings.coupling_patience,
        settings.on_contact_loss,
        lookahead,
        settings.stiffness,
        settings.delay,
        settings.chosen_gains(1e-3 * weight / GRAVITY),
        settings.coupling_stiffness,
        settings.coupling_zero_limit,
        settings.min_contact / 100.0,
        weight / GRAVITY,
    )


def coupling_of(batch: StrokeSelection, settings: ExecuteSettings, weight: float = 0.0) -> Filter:
    """Return the filter for all strokes of a run: their time constants differ in no case.

    Parameters
    ----------
    batch : StrokeSelection
    settings : ExecuteSettings
    weight : float
        Of what the sensor carries, N.

    Raises
    ------
    InputError
        As `coupling_filter`, for any of them; or the gains are unstable.
    """
    settings.chosen_gains(1e-3 * weight / GRAVITY)
    filters = [coupling_filter(stroke, settings) for stroke in batch.strokes]
    return filters[0]


def slowed(lookahead: float) -> str:
    """Say that the arm answers too late for a quick force coupling; empty where it does not."""
    if lookahead <= LONG:
        return ""
    return (
        f"--coupling force: behind a look-ahead of {lookahead:g} s the force is corrected "
        f"{lookahead / COUPLED:.2g} times as slowly; lookahead={COUPLED:g} in --robot is better"
    )


def pressed(pressing: ForceTracker) -> str:
    """Say how hard the coupling pressed, and for how much of the stroke it did not."""
    found = pressing.facts().get("contact")
    if found is None:
        return "no stroke was drawn under force"
    said = (
        f"force along the normal {found['mean']:.2f} N in the mean, {found['least']:.2f} to "
        f"{found['largest']:.2f} N, RMS error {found['rms_error']:.2f} N; no contact on "
        f"{100.0 * (1.0 - found['share']):.3g} % of the stroke"
    )
    if "stiffness" in found:
        said += (
            f"; landed with {found['landing_peak']:.2f} N at the most, on {found['stiffness']:.3g} "
            f"N/mm behind {found['delay']:.2g} s"
        )
    if "normal_angle" in found:
        mean, most = (np.degrees(found["normal_angle"][key]) for key in ("mean", "p95"))
        said += (
            f"; the surface leans from the planned normal by {mean:.1f}° in the mean, {most:.1f}° "
            f"(95 %), friction {found['friction']:.2f}"
        )
    if pressing.wall is not None:
        said += f"; ended by a wall: {pressing.wall}"
    if found.get("zero_drift", 0.0) > max(DRIFTED, 3.0 * pressing.supervisor.noise):
        said += (
            f"; the force's zero has moved by {found['zero_drift']:.2f} N since it was taken, and "
            "so has the force that was held: calibrate anew, or let the sensor warm up"
        )
    if found["saturated"]:
        said += f"; at its limits on {100.0 * found['saturated']:.2g} % of the stroke"
    if "oscillating" in {event.state for event in pressing.supervisor.events}:
        said += "; the force swung, and the gains were softened"
    changes = course(pressing.supervisor.events)
    return f"{said}; contact: {changes}" if changes else said

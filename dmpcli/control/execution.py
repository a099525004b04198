"""What one execution is made of: mock scene, checked plan, sense of touch, run file."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmpcli.admittance.compensation import Compensation
from dmpcli.admittance.force_coupling import Filter, fast_filter
from dmpcli.arrays import AnyArray, Floats
from dmpcli.control import guards
from dmpcli.control.contact_policy import ContactEvent, ContactPolicy, course
from dmpcli.control.contact_supervisor import ContactSupervisor
from dmpcli.control.cycle import LoopOutcome, ReadyArm, StopLimits
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.force_tracking import LONG, ForceInput, ForceTracker
from dmpcli.control.normal_sensing import NormalPolicy, NormalSense
from dmpcli.control.servo_loop import DONE, PlanLoop
from dmpcli.errors import InputError
from dmpcli.instruments.protocols import PlanPlayer, RobotState, Sensor, Servo
from dmpcli.kinematics import models
from dmpcli.kinematics.reachability import Reach
from dmpcli.planning import plan as planning
from dmpcli.planning import preflight
from dmpcli.planning.limits import limits_of
from dmpcli.planning.plan import Plan
from dmpcli.planning.preflight import Check
from dmpcli.records import schemas
from dmpcli.records.record import Provenance, Record
from dmpcli.records.schemas import EULER_ANGLES, JOINTS, POSITION
from dmpcli.records.stroke_selection import StrokeSelection
from dmpcli.settings.execute import COUPLED, ExecuteSettings
from dmpcli.simulation.mock import Plate, Scene
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import from_euler
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


def scene(stroke: StrokeTrajectory, presses: bool, height: float = 0.0) -> Scene:
    """Return the mock lab where its URL says nothing.

    The arm is parked at the stroke's first pose. There is a plate only for a force coupling, which
    needs something to press on: through the stroke's start, across its normal there.

    Parameters
    ----------
    stroke : StrokeTrajectory
    presses : bool
        Whether the force coupling is on.
    height : float
        How far above the plate the stroke begins, mm.
    """
    lab = replace(Scene(), position=stroke.position[0])
    if stroke.rotation is not None:
        lab = replace(lab, rotation=stroke.rotation[0])
    if presses and stroke.normal is not None:
        normal = stroke.normal[0]
        lab = replace(lab, plate=Plate(stroke.position[0] - height * normal, normal))
    return lab


def prepare(
    stroke: StrokeTrajectory,
    settings: ExecuteSettings,
    state: RobotState,
    reach: Reach | None = None,
) -> tuple[Plan, list[Check]]:
    """Plan the stroke from where the arm stands, and judge it.

    Parameters
    ----------
    stroke : StrokeTrajectory
    settings : ExecuteSettings
    state : RobotState
    reach : Reach, optional
        The arm whose joints are judged too, from where they are if the state tells it.

    Returns
    -------
    Plan
    list of Check
        All of them, failed ones too.

    Raises
    ------
    RefusedError
        The arm is not ready.
    """
    guards.check_ready(state)
    start = state.pose
    near = standing(stroke, settings, state) if settings.approach is None else []
    made = planning.make(
        stroke,
        settings.period,
        settings.speed,
        limits_of(settings),
        start,
        settings.approach or settings.lead_speed,
    )
    joints = None if reach is None else reach.standing(state.joints, start)
    return made, judge(stroke, made, settings, near, reach, joints)[0]


def standing(stroke: StrokeTrajectory, settings: ExecuteSettings, state: RobotState) -> list[Check]:
    """Check that the arm stands at a stroke's start."""
    goal = state.rotation if stroke.rotation is None else stroke.rotation[0]
    gap = state.pose.apart(Pose(stroke.position[0], goal))
    return preflight.near_start(*gap, settings.start_tolerance, settings.start_angle)


def judge(
    stroke: StrokeTrajectory,
    plan: Plan,
    settings: ExecuteSettings,
    near: list[Check],
    reach: Reach | None,
    joints: Floats | None,
) -> tuple[list[Check], Floats | None]:
    """Check one stroke with its ways.

    Parameters
    ----------
    stroke : StrokeTrajectory
    plan : Plan
    settings : ExecuteSettings
    near : list of Check
        What was found of where the arm stands.
    reach : Reach or None
    joints : array, shape (6,), or None
        Before, rad.

    Returns
    -------
    list of Check
        All of them, failed ones too.
    array, shape (6,), or None
        Joint angles after, rad.
    """
    limits = limits_of(settings)
    checks = preflight.at_rest(stroke, settings.speed, settings.period, limits) + near
    checks += preflight.within_limits(plan, stroke, limits)
    if reach is None:
        return checks, None
    by_joints, joints = preflight.by_joints(plan, stroke, reach, joints)
    return checks + by_joints, joints


def reach_of(robot: Servo, model: str | None, tool: Tool | None) -> Reach | None:
    """Return the arm whose joints can be judged: the one that is named, else the robot's own.

    Parameters
    ----------
    robot : Servo
        Open.
    model : str, optional
        Its kinematic model, as asked for.
    tool : Tool, optional

    Raises
    ------
    InputError
        The model is not known, or is not the robot's.
    """
    own: Reach | None = getattr(robot, "reach", None)  # a servo that is driven by poses has none
    if model is None or own is None:
        return own if model is None else Reach(models.model(model), tool)
    if own.arm.name != models.model(model).name:
        raise InputError(f"--robot-model {model}: the robot is an {own.arm.name}; leave it out")
    return own


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


def facts_of(arm: ReadyArm, coupling: Filter | None) -> dict[str, Any]:
    """Return the arm's look-ahead and the gains that were chosen on the normal axis."""
    lookahead = arm.info.lookahead
    if isinstance(arm.servo, PlanPlayer):
        return {}  # its look-ahead is the most that it may take to begin
    if coupling is None:
        return {"lookahead": lookahead}
    gains = {"k": coupling.k, "d": coupling.d, "tau": coupling.tau, "alpha_e": coupling.alpha_e}
    return {"lookahead": lookahead, "coupling": gains}


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


def watch(settings: ExecuteSettings) -> StopLimits:
    """Return when the loop stops by itself."""
    return StopLimits(
        settings.following_error,
        settings.following_angle,
        settings.max_force,
        settings.max_torque,
        settings.arrival_tolerance,
        settings.arrival_angle,
    )


def record_of(
    loop: PlanLoop,
    outcome: LoopOutcome,
    provenance: Provenance,
    realtime: bool,
    reach: Reach | None = None,
) -> Record:
    """Return the run as a record.

    Parameters
    ----------
    loop : PlanLoop
        Has run, at least one cycle.
    outcome : LoopOutcome
    provenance : Provenance
        What was known before.
    realtime : bool
        Lateness is a fact only where a clock ran: a simulated run is the same every time.
    reach : Reach, optional
        The arm whose joint angles follow from the poses where no driver told them.
    """
    facts = provenance.facts | {
        "reason": outcome.reason,
        "completed": outcome.reason == DONE,
        "missed": loop.timing.missed,
    }
    facts |= loop.stop_outcome.facts()
    if realtime:
        facts |= loop.timing.facts()
    if loop.pressing is not None:
        facts |= loop.pressing.facts()
        if "coupling" in facts:
            facts["coupling"] = facts["coupling"] | loop.pressing.gains()
    if loop.goals is not None:
        facts |= loop.goals.facts()
    if "strokes" in facts:
        facts |= progress_of([stroke["id"] for stroke in facts["strokes"]], loop.drawn)
    columns = loop.log.columns()
    joints = joints_of(columns, reach, loop.plan.period)
    if joints:
        arm = None if reach is None else reach.arm.name
        facts["joints"] = {"arm": arm, "measured": JOINTS[0] in columns}
    return Record(schemas.RUN, columns | joints, replace(provenance, facts=facts))


def joints_of(
    columns: Mapping[str, AnyArray], reach: Reach | None, period: float
) -> dict[str, AnyArray]:
    """Return the columns of the joint angles of a run: as told, else by the arm's kinematics.

    Parameters
    ----------
    columns : dict of array
        Of the run.
    reach : Reach or None
    period : float
        s.

    Returns
    -------
    dict of array
        None where nothing is known of them, or the arm does not reach a pose.
    """
    told = {name: columns[name] for name in JOINTS if name in columns}
    if told or reach is None:
        return told
    position = np.column_stack([columns[name] for name in POSITION])
    rotation = from_euler(np.column_stack([columns[name] for name in EULER_ANGLES]))
    q = reach.follow(position[None], rotation[None], period).joints[0]
    return {} if np.isnan(q).any() else dict(zip(JOINTS, q.T, strict=False))


def progress_of(ids: Sequence[str], drawn: Sequence[str]) -> dict[str, list[str]]:
    """Return what the file of a run of many strokes says at its end: ``drawn``, ``remaining``.

    Parameters
    ----------
    ids, drawn : sequence of str
        All strokes of the run in order, and those that are whole.
    """
    done = set(drawn)
    return {"drawn": list(drawn), "remaining": [name for name in ids if name not in done]}

"""What one execution is made of: mock scene, checked plan, run file."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dmpcli.arrays import AnyArray, Floats
from dmpcli.control import guards
from dmpcli.control.cycle import LoopOutcome, ReadyArm, StopLimits
from dmpcli.control.servo_loop import DONE, PlanLoop
from dmpcli.errors import InputError
from dmpcli.instruments.protocols import PlanPlayer, RobotState, Servo
from dmpcli.planning import plan as planning
from dmpcli.planning import preflight
from dmpcli.planning.limits import limits_of
from dmpcli.planning.plan import Plan
from dmpcli.planning.preflight import Check
from dmpcli.records import schemas
from dmpcli.records.record import Provenance, Record
from dmpcli.records.schemas import EULER_ANGLES, JOINTS, POSITION
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.simulation.mock import Plate, Scene
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import from_euler
from dmpcli.spatial.trajectory import StrokeTrajectory
from dmpcli.spatial.wrench import Tool

if TYPE_CHECKING:  # neither is loaded where neither is asked for
    from dmpcli.admittance.force_coupling import Filter
    from dmpcli.kinematics.reachability import Reach


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
    reach: "Reach | None" = None,
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
    """Check that the arm stands at a stroke's start.

    Parameters
    ----------
    stroke : StrokeTrajectory
        Where it says no orientation, the arm's own is right.
    settings : ExecuteSettings
        Of which the tolerances of the start count, mm and rad.
    state : RobotState

    Returns
    -------
    list of Check
        Distance and angle; failed ones too.
    """
    goal = state.rotation if stroke.rotation is None else stroke.rotation[0]
    gap = state.pose.apart(Pose(stroke.position[0], goal))
    return preflight.near_start(*gap, settings.start_tolerance, settings.start_angle)


def judge(
    stroke: StrokeTrajectory,
    plan: Plan,
    settings: ExecuteSettings,
    near: list[Check],
    reach: "Reach | None",
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


def reach_of(robot: Servo, model: str | None, tool: Tool | None) -> "Reach | None":
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
    # A servo that is driven by poses has none.
    own: Reach | None = getattr(robot, "reach", None)
    if model is None:
        return own
    from dmpcli.kinematics import models, reachability

    if own is None:
        return reachability.Reach(models.model(model), tool)
    if own.arm.name != models.model(model).name:
        raise InputError(f"--robot-model {model}: the robot is an {own.arm.name}; leave it out")
    return own


def facts_of(arm: ReadyArm, coupling: "Filter | None") -> dict[str, Any]:
    """Return the arm's look-ahead and the gains that were chosen on the normal axis."""
    lookahead = arm.info.lookahead
    if isinstance(arm.servo, PlanPlayer):
        return {}  # its look-ahead is the most that it may take to begin
    if coupling is None:
        return {"lookahead": lookahead}
    gains = {"k": coupling.k, "d": coupling.d, "tau": coupling.tau, "alpha_e": coupling.alpha_e}
    return {"lookahead": lookahead, "coupling": gains}


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
    reach: "Reach | None" = None,
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
    columns: Mapping[str, AnyArray], reach: "Reach | None", period: float
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

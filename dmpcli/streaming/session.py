"""What one execution is made of: mock scene, checked plan, sense of touch, run file."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from dmpcli.errors import InputError, RefusedError
from dmpcli.instruments.mock import Plate, Scene
from dmpcli.instruments.protocols import Clock, RobotState, Sensor
from dmpcli.instruments.sensing import Sensing
from dmpcli.measures.timing import punctuality
from dmpcli.primitives.compensation import Compensation
from dmpcli.primitives.coupling import Filter, fast_filter
from dmpcli.primitives.wrench import Tool
from dmpcli.records import schemas
from dmpcli.records.record import Provenance, Record
from dmpcli.streaming import plan as planning
from dmpcli.streaming import preflight, run_file
from dmpcli.streaming.contact import Pressing, Touch
from dmpcli.streaming.loop import DONE, Arm, Loop, Outcome, Watch
from dmpcli.streaming.plan import Plan, Stroke
from dmpcli.streaming.preflight import Check
from dmpcli.streaming.settings import ExecuteSettings

SENSOR_RATE = 100.0
# A zero is taken over this time, s.
ZERO_TIME = 0.5


def scene(stroke: Stroke, presses: bool) -> Scene:
    """Return the mock lab where its URL says nothing.

    The arm is parked at the stroke's first pose. There is a plate only for a force coupling, which
    needs something to press on: through the stroke's start, across its normal there.

    Parameters
    ----------
    stroke : Stroke
    presses : bool
        Whether the force coupling is on.
    """
    lab = replace(Scene(), position=stroke.position[0])
    if stroke.rotation is not None:
        lab = replace(lab, rotation=stroke.rotation[0])
    if presses and stroke.normal is not None:
        lab = replace(lab, plate=Plate(stroke.position[0], stroke.normal[0]))
    return lab


def prepare(
    stroke: Stroke, settings: ExecuteSettings, state: RobotState
) -> tuple[Plan, list[Check]]:
    """Plan the stroke from where the arm stands, and judge it.

    Parameters
    ----------
    stroke : Stroke
    settings : ExecuteSettings
    state : RobotState

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
    if state.mode != "ready":
        raise RefusedError(f"robot: {state.mode}; clear it on the pendant before it may move")
    start = (state.position, state.rotation)
    goal = stroke.rotation[0] if stroke.rotation is not None else state.rotation
    checks = preflight.at_rest(stroke, settings.speed, settings.period, settings.limits)
    if settings.approach is None:
        distance, angle = planning.gap(start, (stroke.position[0], goal))
        checks += preflight.near_start(
            distance, angle, settings.start_tolerance, settings.start_angle
        )
    made = planning.make(
        stroke,
        settings.period,
        settings.speed,
        settings.limits,
        start,
        settings.approach or settings.lead_speed,
    )
    return made, checks + preflight.within_limits(made, stroke, settings.limits)


def check_period(arm: Arm, period: float) -> None:
    """Refuse a servo period that the robot does not take.

    Raises
    ------
    InputError
    """
    shortest, longest = arm.info.period_range
    if not shortest <= period <= longest:
        raise InputError(
            f"--period {period:g}: the {arm.info.make} robot takes {shortest:g} to {longest:g} s"
        )


def touch(
    sensor: Sensor,
    tool: Tool,
    plan: Plan,
    settings: ExecuteSettings,
    clock: Clock,
    coupling: Filter | None,
) -> Touch:
    """Let the sensor stream at rest, and return what the loop feels with.

    Parameters
    ----------
    sensor : Sensor
    tool : Tool
        Where its zero is None, it is taken now.
    plan : Plan
    settings : ExecuteSettings
    clock : Clock
    coupling : Filter, optional
        None: only log the wrench.

    Raises
    ------
    InstrumentError
        The sensor cannot be reached, is silent, or sends what must not be believed.
    """
    info = sensor.open()
    rate = min(SENSOR_RATE, info.rate)
    sensor.start(rate)
    sensing = Sensing(sensor, info, rate, plan.period, clock)
    zeroed = sensing.zeroed(tool, plan.rotation[0], ZERO_TIME)
    pressing = None if coupling is None else Pressing(settings.law(), coupling, plan)
    return Touch(sensing, Compensation(zeroed), pressing)


def coupling_filter(stroke: Stroke, facts: Mapping[str, Any], settings: ExecuteSettings) -> Filter:
    """Return the filter of eq. (10) on the normal axis.

    Where the facts state no tau, the stroke's duration stands for it: the time constant that
    `fast_filter` chooses does not depend on tau, the gains k and d that it logs do.

    Raises
    ------
    InputError
        The trajectory states no normal, no set-point was given, or the model is unstable.
    """
    if stroke.normal is None:
        raise InputError(
            "--coupling force: the trajectory states no surface normal to press along; "
            "make it anew with generalize"
        )
    settings.law()
    tau = float(facts.get("tau") or stroke.t[-1] - stroke.t[0])
    return fast_filter(tau / settings.speed, settings.period)


def facts_of(coupling: Filter) -> dict[str, float]:
    """Return the gains that were chosen on the normal axis."""
    return {"k": coupling.k, "d": coupling.d, "tau": coupling.tau, "alpha_e": coupling.alpha_e}


def watch(settings: ExecuteSettings) -> Watch:
    """Return when the loop stops by itself."""
    return Watch(settings.following_error, settings.following_angle, settings.max_force)


def record_of(loop: Loop, outcome: Outcome, provenance: Provenance, realtime: bool) -> Record:
    """Return the run as a record.

    Parameters
    ----------
    loop : Loop
        Has run, at least one cycle.
    outcome : Outcome
    provenance : Provenance
        What was known before.
    realtime : bool
        Lateness is a fact only where a clock ran: a simulated run is the same every time.
    """
    columns = run_file.columns(loop.log, loop.plan.oriented, loop.senses, loop.presses)
    facts = dict(provenance.facts) | {
        "reason": outcome.reason,
        "completed": outcome.reason == DONE,
        "missed": outcome.missed,
    }
    if realtime:
        found = punctuality(columns["deadline"], columns["lateness"], loop.plan.period)
        facts["lateness"] = {"p50": found.median, "p99": found.p99, "max": found.worst}
    return Record(schemas.RUN, columns, replace(provenance, facts=facts))

"""Loops in simulated time, with and without a hand or a surface: results that are kept.

See `tests/kept.py`.
"""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.admittance import model
from dmpcli.admittance.force_law import LawState
from dmpcli.control import chatter, guarded_motion, playback, servo_loop, stopping
from dmpcli.control.contact_policy import ContactPolicy
from dmpcli.control.cycle import StopLimits
from dmpcli.control.execution_plan import CheckedPlan
from dmpcli.control.goal_following import GoalEvent, GoalOptions
from dmpcli.control.guards import FollowingErrorMonitor
from dmpcli.control.loop_timing import LoopTiming
from dmpcli.control.normal_sensing import NormalPolicy, NormalSense
from dmpcli.control.plan_cursor import PlanCursor
from dmpcli.control.preflight_table import facts as preflight_facts
from dmpcli.control.preflight_table import table
from dmpcli.control.settling import RestWindow, SettlingDetector
from dmpcli.instruments.protocols import RobotState, ServoInfo
from dmpcli.kinematics import models
from dmpcli.kinematics.reachability import Reach
from dmpcli.planning import transfers
from dmpcli.planning.limits import Limits
from dmpcli.planning.preflight import Check
from dmpcli.planning.transfers import TransferOptions
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp
from tests.control.contact_plant import Plant, Rig
from tests.control.drag_fakes import rehearse
from tests.control.fake_sensors import StreamingSensor
from tests.control.mock_runs import executed, short
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, plan, stroke
from tests.control.test_goal_following import Run as Followed
from tests.control.test_playback import Bench as Played
from tests.control.test_servo_loop import Bench
from tests.kept import Kept

KEPT = Kept(__file__)
UP = np.array([0.0, 0.0, 1.0])
TIGHT = Limits(60.0, 300.0, 3000.0, 0.3, 2.0, 20.0)


def seen(bench):
    """What a run has logged."""
    rows = bench.rows
    numbers = [[r.t, r.t_plan, r.deadline, r.lateness, r.coupling, r.force] for r in rows]
    poses = [
        np.array([getattr(r, name)[k] for r in rows])
        for k in (0, 1)
        for name in ("planned", "sent", "actual")
    ]
    words = sorted({(r.phase, r.state, r.contact, r.id or "") for r in rows})
    return [np.array(numbers), poses, ["/".join(w) for w in words], bench.servo.calls]


@KEPT.case
def landings_and_strokes_on_springs():
    found: list = []
    ways = ((0.5, 0, {}), (2.0, 2, {}), (5.0, 1, {"clamp": 8.0}), (20.0, 4, {"seek": 1.0}))
    for stiffness, cycles, policy in ways:
        for height in (-2.0, 1.0):
            rig = Rig(Plant(stiffness, cycles, surface=lambda t, h=height: h), **policy)
            drawn = rig.land().draw(2.0, lambda t: 5.0 + np.sin(3.0 * t))
            s = rig.supervisor
            found += [
                drawn,
                [r[2] for r in rig.rows],
                rig.states,
                rig.t,
                s.stiffness,
                s.delay,
                s.landing_peak,
                [(e.t, e.state) for e in s.events],
            ]
    return found


@KEPT.case
def surfaces_that_end_or_jump():
    found: list = []
    for surface in (
        lambda t: None if 3.0 < t < 3.4 else 0.0,
        lambda t: None if t > 3.0 else 0.0,
        lambda t: 0.5 * (t > 3.5),
        lambda t: -0.8 * (t > 3.5),
        lambda t: None,
    ):
        for on_loss in ("seek", "stop", "hold"):
            rig = Rig(Plant(3.0, 1, surface=surface), on_loss=on_loss)
            drawn = rig.land(8.0).draw(3.0)
            s = rig.supervisor
            found += [drawn, rig.states, rig.t, bool(s.failure), [(e.t, e.state) for e in s.events]]
    return found


@KEPT.case
def runs_along_a_plan():
    away, turned = START + np.array([30.0, -40.0, 10.0]), exp(np.array([0, 0.1, 0.2])) @ PEN_DOWN
    plans = [
        plan(stroke(2.0)),
        plan(stroke(1.5, 73.0, 0.6), 0.008, 0.5),
        plan(stroke(2.0, normal=(0, 0, 1)), start=Pose(away, turned)),
    ]
    found: list = []
    for made in plans:
        for more in ({}, {"jumps": {20: 0.05, 60: 0.03}}):
            bench = Bench(made, **more)
            if made is plans[2]:
                bench.servo.position, bench.servo.rotation = made.position[0], made.rotation[0]
            outcome = bench.run()
            found += [outcome.reason, seen(bench), bench.loop.timing.missed]
    return found


@KEPT.case
def runs_that_are_interrupted():
    found: list = []
    made = plan(stroke(3.0))
    for cycle in (5, 60, 120, 149):
        bench = Bench(made)
        bench.servo.at[cycle] = lambda servo, b=bench: b.interruption.receive(2)
        outcome = bench.run()
        found += [outcome.reason, outcome.signal, seen(bench)]
    for at in (
        {70: lambda s: setattr(s, "mode", "emergency stop")},
        {70: lambda s: setattr(s, "accepts", False)},
        {70: lambda s: setattr(s, "stuck", True)},
    ):
        bench = Bench(made, at=at)
        outcome = bench.run()
        found += [type(outcome.failure).__name__, seen(bench)]
    return found


@KEPT.case
def runs_that_press():
    found: list = []
    for below in (0.0, 1.5):
        bench = Bench(plan(stroke(2.0, normal=(0, 0, 1))), presses=True)
        bench.sensor.plate = START[2] - below
        outcome = bench.run()
        found += [outcome.reason, seen(bench), bench.loop.pressing.gains]
    return found


@KEPT.case
def walls_that_are_run_into():
    found: list = []
    for slope, drift in ((800.0, 0.0), (90.0, 0.02)):
        bench = Bench(plan(stroke(3.0, normal=(0, 0, 1))), presses=True)
        met: list = []

        def feel(t, bench=bench, met=met, slope=slope, drift=drift):
            side = slope * min(max(t - met[0], 0.0), 0.06) if met else 0.0
            push = 2.0 * max(START[2] - bench.servo.position[2], 0.0) + drift * (t - 100.0)
            return np.array([0.6 * side, 0.8 * side, push, 0.0, 0.0, 0.0])

        bench.servo.at = {360: lambda _, b=bench, m=met: m.append(b.clock.now() + 0.005)}
        streaming = StreamingSensor(bench.clock, feel)
        streaming.start(100.0)
        bench.sensor.poll = streaming.poll
        found += [bench.run().reason, bench.loop.pressing.facts(), seen(bench)]
    return found


@KEPT.case
def recordings_by_a_hand():
    found: list = []
    for options in ({}, {"dead_band_force": 2.0}):
        _, recorder, outcome = rehearse(**options)
        columns = recorder.log.columns()
        keep = (
            "t",
            "x",
            "y",
            "z",
            "rx",
            "ry",
            "rz",
            "fx",
            "fy",
            "fz",
            "tx",
            "x_ref",
            "fz_raw",
            "lost",
        )
        found += [outcome.reason, {n: columns[n] for n in keep if n in columns}]
        found += [recorder.log.duration, recorder.log.moved(0.5), recorder.log.still(1.0, 0.5)]
    return found


@KEPT.case
def numbers_that_run_along_a_plan():
    found: list = []
    made = plan(stroke(1.6), start=Pose(START + 5.0, PEN_DOWN))
    for limits in (WIDE, TIGHT):
        for at in (None, 0, 30, made.lead, 70, len(made) - 2):
            for wait in (False, True):
                cursor = PlanCursor(made, limits, wait)
                told = []
                for k in range(200):
                    if k == at:
                        cursor.brake()
                    if k == 100:
                        cursor.release()
                    told.append([cursor.index, cursor.waiting, cursor.braking, cursor.finished])
                    if cursor.finished:
                        break
                    cursor.advance()
                found += [np.array(told, dtype=float), cursor.phase]
    return found


@KEPT.case
def ways_that_the_coupling_makes_itself():
    found: list = []
    for goal, speed in ((3.0, 10.0), (-2.0, 50.0), (0.1, 5.0)):
        state, way = LawState(0.5, 1.0), []
        for _ in range(60):
            state, there = guarded_motion.towards(state, goal, speed, 0.02)
            way.append([state.e, state.speed, there])
        found.append(np.array(way, dtype=float))
    state, way = LawState(0.5, 1.0), []
    for _ in range(40):
        state = guarded_motion.sinking(state, 7.0, 0.02)
        way.append([state.e, state.speed])
    return [*found, np.array(way)]


@KEPT.case
def arms_that_come_to_rest():
    found: list = []
    info = ServoInfo("fake", (0.002, 0.1), 0.2)
    for rate, shake in ((3.0, 0.0), (8.0, 0.01), (8.0, 0.03)):
        rest, settled = RestWindow(0.1), SettlingDetector(info, 0.01)
        errors = FollowingErrorMonitor(info, 0.01, 5.0, 0.1)
        told = []
        for k in range(180):
            left = np.exp(-rate * 0.01 * k)
            off = START + [0.0, 2.0 * left + shake * (k % 2), 0.0]
            turn = exp(np.array([0.0, 0.05 * left, 0.0])) @ PEN_DOWN
            state = RobotState(0.01 * k, off, turn, "ready")
            errors.add(Pose(START + [0.0, 2.0 * left**2, 0.0], PEN_DOWN))
            told.append([rest.rests(state), settled.reached(state), *errors.strayed(state)])
        found.append(np.array(told, dtype=float))
    return found


@KEPT.case
def forces_that_chatter():
    t = np.arange(0.0, 8.0, 0.02)
    found: list = []
    for f in (1.0, 2.0, 4.0, 9.0):
        detector = chatter.ChatterDetector(0.02)
        told = [
            detector.feel(
                s, np.array([0.3, 0, max(6 * np.sin(2 * np.pi * f * s), 0)]), np.array([0, 0, -1.0])
            )
            for s in t
        ]
        found += [told, detector.alarms, detector.spent]
    law = model.AdmittanceLaw(np.full(6, 5.0), np.full(6, 90.0), np.zeros(6), 0.008)
    found += [
        chatter.damped(law, np.array([0.0, 0.6, 0.8])),
        chatter.damped(law, np.eye(3)[0], 3.0),
    ]
    timing = LoopTiming()
    for k in range(50):
        timing.add(k, k + 1e-3 * (k % 7), k + 2e-3 * (k % 5) + 8e-3, k + 0.02)
    return [*found, timing.facts()]


@KEPT.case
def single_strokes_that_are_executed():
    return [
        executed([short()]),
        executed([short(by=(3.0, 1.0, 0.0))], approach=15.0, robot="mock:?x=-551&y=131&z=-10"),
        executed([short(duration=0.81)], speed=0.5, period=0.016, sensor="mock:"),
        executed([replace(short(), rotation=None, normal=None)], clearance=8.0),
        executed([short(size=1.0, duration=1.0)]),
        executed([short(by=(9.0, 0.0, 0.0))], robot="mock:?x=-551&y=131&z=-17"),
    ]


@KEPT.case
def strokes_that_are_checked_alone():
    away = {"robot": "mock:?x=-560&y=140&z=20"}
    return [
        executed([short()], dry_run=True),
        executed([short(str(n), by=(0.0, 9.0 * n, 0.0)) for n in range(3)], dry_run=True),
        executed([short()], dry_run=True, approach=30.0, **away),
        executed([short()], dry_run=True, robot_model="ec66", workspace=(-600, 0, 0, 200, -50, 50)),
        executed([short(size=1.0)], dry_run=True),
    ]


@KEPT.case
def several_strokes_with_outputs():
    events = (OutputEvent(0.2, "DO1", on=True), OutputEvent(0.8, "DO1", on=False))
    many = [
        short("a", 0.6, 0.1, events=events[:1]),
        short("b", 0.8, 0.1, (0.0, 8.0, 1.0), events=events),
    ]
    ways = {"transfer_speed": 250.0, "retract_speed": 250.0, "lead_speed": 250.0}
    return [
        executed(many, ids=("b", "a"), clearance=4.0, **ways),
        executed(many, robot="mock:?estop_at=1.5", **ways),
        executed(many[:1], ignore_events=True),
    ]


PRESS = {"presses": True, "sensor": "mock:"}


@KEPT.case
def a_stroke_that_is_pressed():
    return executed([short()], {"k": [100.0] * 6}, **PRESS)


@KEPT.case
def a_stroke_whose_force_waves():
    wave = 3.0 + np.sin(np.arange(41))
    return executed([short(force=wave)], stiffness=5.0, delay=0.06, speed=0.5, **PRESS)


@KEPT.case
def a_stroke_that_is_lifted_in_its_midst():
    lifted = np.where(np.abs(np.arange(41) - 20) > 8, 4.0, 0.0)
    return executed([short(force=lifted)], force_setpoint=2.0, coupling_reach=4.0, **PRESS)


@KEPT.case
def a_stroke_along_a_normal_that_is_felt():
    return executed([short(size=0.5)], normal_from_force=True, coupling_reach=4.0, **PRESS)


@KEPT.case
def strokes_that_are_pressed_one_after_the_other():
    many = [short("a", 0.6, 0.1), short("b", 0.6, 0.1, (0.0, 8.0, 0.0))]
    return executed(many, coupling_reach=3.0, robot="mock:?stiffness=8", clearance=16.0, **PRESS)


@KEPT.case
def a_stroke_by_gains_that_were_chosen():
    chosen = {"coupling_damping": 2.0, "coupling_stiffness": 0.2, "coupling_reach": 4.0}
    return executed([short()], **chosen, **PRESS)


@KEPT.case
def strokes_whose_surface_is_too_far():
    return executed([short()], robot="mock:?plate=-40", coupling_reach=6.0, **PRESS)


@KEPT.case
def strokes_that_fail_under_force():
    return [
        executed([short()], robot="mock:?silent_at=3", **PRESS),
        executed([short()], coupling_damping=0.05, coupling_reach=3.0, **PRESS),
        executed([replace(short(), normal=None)], **PRESS),
        executed([short()], force_setpoint=60.0, **PRESS),
        executed([short()], min_contact=100.0, coupling_zero_limit=0.001, **PRESS),
    ]


@KEPT.case
def runs_that_instruments_end():
    felt = {"sensor": "mock:"}
    return [
        executed([short()], robot="mock:?estop_at=0.4"),
        executed([short()], robot="mock:?refuse_at=0.5"),
        executed([short()], robot="mock:?silent_at=0.5", **felt),
        executed([short()], robot="mock:?speed=5"),
        executed([short(size=1.0, duration=4.0)], robot="mock:?lag=0.5"),
        executed([short()], robot="mock:?plate=-17", max_force=0.5, **felt),
        executed([short()], following_error=0.01),
        executed([short()], arrival_tolerance=1e-6),
    ]


@KEPT.case
def goals_that_are_followed():
    found: list = []
    for moves in (
        [(1.0, (10.0, -6.0, 0.0))],
        [(0.3, (5.0, 0.0, 0.2)), (0.32, (6.0, 1.0, 0.0)), (2.0, (0.0, 0.0, 9.0))],
        [(3.9, (10.0, 0.0, 0.0)), (3.9, (300.0, 0.0, 0.0)), (3.95, (190.0, 0.0, 0.0))],
        [(3.0, (150.0, 0.0, 0.0)), (3.5, (150.0, 1.0, 0.0)), (9.0, (1.0, 0.0, 0.0))],
    ):
        run = Followed(moves).run()
        found += [run.outcome.reason, run.sent, run.told, run.goals.facts(), run.goals.said()]
        found += [run.goals.taken, run.goals.told, run.loop.duration, run.loop.log.columns()["xg"]]
    return found


@KEPT.case
def goals_that_are_followed_by_joints():
    reach = Reach(models.model("ec66"))
    run = Followed([(0.5, (4.0, 0.0, 0.0)), (2.0, (4.0, 160.0, 0.0))], reach=reach).run()
    course = run.goals.course
    return [run.told, run.goals.facts(), course.joints, course.start, run.sent]


@KEPT.case
def plans_that_are_played():
    found: list = []
    for more in ({}, {"jumps": {40: 0.05}}, {"delay": 0.2}, {"pace": 0.7}, {"pace": 1.2}):
        bench = Played(**more)
        outcome = bench.run()
        found += [outcome.reason, bench.servo.calls, bench.loop.drawn, bench.loop.timing.missed]
        rows = bench.loop.log.columns()
        found += [{name: rows[name] for name in ("t", "t_plan", "x", "x_sent", "rz_plan")}]
    return found


def recorded(*ways):
    found: list = []
    for url, options in ways:
        _, recorder, outcome = rehearse(url, url, **options)
        found += [outcome.reason, recorder.log.columns(), recorder.log.duration]
        found += [recorder.timing.missed, recorder.log.moved(2.0), outcome.stop.kind]
    return found


@KEPT.case
def recordings_by_other_settings():
    return recorded(
        ("mock:", {"duration": 4.0, "speed": 160.0, "acceleration": 500.0}),
        ("mock:", {"duration": 3.0, "reference": "line", "control_rate": 125.0, "low_pass": 4.0}),
        ("mock:", {"duration": 3.0, "stiffness": (0.0, 0.5, 0.0, 0.0, 0.0, 2.0)}),
    )


@KEPT.case
def recordings_that_end_otherwise():
    room = (-560.0, -540.0, 0.0, 200.0, -50.0, 50.0)
    return recorded(
        ("mock:?estop_at=1.2", {"duration": 3.0}),
        ("mock:?silent_at=2", {"duration": 3.0, "dead_band_torque": 0.5}),
        ("mock:?speed=4", {"duration": 3.0, "following_error": 2.0}),
        ("mock:", {"duration": 4.0, "until_rest": 0.3, "reference": "circle", "periods": 2.0}),
        ("mock:", {"duration": 3.0, "workspace": room}),
    )


@KEPT.case
def forces_that_swing():
    found: list = []
    for factor, cycles in ((1.7, 2), (2.4, 1), (5.0, 2)):
        rig = Rig(Plant(4.0, cycles, surface=lambda t: 0.0))
        rig.land().draw(1.0)
        plant = rig.plant
        plant.stiffness *= factor
        height = plant.height + plant.force / plant.stiffness
        plant.surface = lambda t, h=height: h
        drawn, s = rig.draw(8.0), rig.supervisor
        found += [drawn, [(e.t, e.state, e.detail) for e in s.events], s.gains, s.failure, s.urgent]
    return found


@KEPT.case
def surfaces_that_are_too_far_or_too_hard():
    found: list = []
    for stiffness, change, policy in (
        (2.0, lambda t: -max(t - 4.0, 0.0), {"clamp": 4.0, "reach": 3.0}),
        (2.0, lambda t: 6.0 * max(t - 5.0, 0.0), {"rate": 3.0}),
        (10.0, lambda t: min(max(t - 5.0, 0.0) * 8.7, 3.0), {}),
        (0.06, lambda t: 0.0, {"setpoint": 1.0}),
        (0.04, lambda t: 0.0, {"setpoint": 1.0}),
        (3.0, lambda t: 0.0, {"stiffness": 3.0, "whole_delay": 0.08, "setpoint": 0.6}),
        (3.0, lambda t: 0.0, {"tool_mass": 2.0, "spring": 0.3, "setpoint": 12.0}),
    ):
        rig = Rig(Plant(stiffness, 1, surface=change), **policy)
        drawn, s = rig.land(12.0).draw(4.0), rig.supervisor
        found += [drawn, rig.states, rig.t, s.failure, s.urgent, s.gains, s.stiffness, s.delay]
        found += [[(e.t, e.state, e.detail) for e in s.events], s.landing_peak, s.doubted]
    return found


@KEPT.case
def normals_that_are_felt():
    found: list = []
    for policy in (NormalPolicy(), NormalPolicy(True, 0.05, 0.1), NormalPolicy(used=True)):
        sense = NormalSense(0.02, policy)
        for k in range(90):
            lean, turn = 0.07 + 0.001 * k, 0.004 * k
            true = np.array([np.sin(turn), np.sin(lean), np.cos(lean)])
            true /= np.linalg.norm(true)
            planned = np.array([np.sin(turn), 0.0, np.cos(turn)])
            if k == 50:
                sense.lift()
            place = np.array([15.0 * 0.02 * k, 3.0 * np.sin(0.1 * k), 0.0])
            sense.feel(0.02 * k, 5.0 * true - [1.2, 0.1, 0.0], place, planned)
            found.append(sense.normal(planned))
        found += [sense.estimate, sense.facts()]
        sense.begin()
        found += [sense.estimate, sense.normal(UP)]
    return found


@KEPT.case
def verdicts_before_a_motion():
    near = Check("jerk", 49_000.0, 50_000.0, "mm/s³", None, None, "", "in the transfer")
    over = Check("acceleration", 3000.0, 2250.0, "mm/s²", 0.1, 6, "")
    out = Check("distance outside the workspace in x", 0.5, 0.0, "mm", 1.0, 51, "")
    ways = TransferOptions(3.0, 100.0, 50.0, 20.0, settling=10)
    strokes = [short(f"{n}", 0.6 + 0.1 * (n % 3), by=(0.0, 2.0 * n, 0.0)) for n in range(23)]
    plans = list(transfers.plans(strokes, 0.02, 1.0, WIDE, Pose(START, PEN_DOWN), True, ways))
    of = [
        CheckedPlan(p, [replace(near, value=2000.0 * (n + 1)), *([over] if n == 5 else [])])
        for n, p in enumerate(plans)
    ]
    of[7] = CheckedPlan(plans[7], [near, out])
    batches = (
        of[:1],
        of[5:6],
        of[:3],
        of,
        [CheckedPlan(plan(start=Pose(START + 9.0, PEN_DOWN)), [])],
    )
    return [[table(some).splitlines(), preflight_facts(some)] for some in batches]


@KEPT.case
def what_is_meant_where_nothing_is_said():
    limits = Limits(*range(1, 7))
    return [
        ContactPolicy(5.0),
        StopLimits(1.0, 2.0, 3.0, 4.0),
        LawState(),
        model.Bounds(),
        NormalPolicy(),
        stopping.AT_REST,
        GoalEvent(1.0, "taken"),
        GoalOptions(limits).range,
        [TransferOptions(1.0, 2.0, 3.0, 4.0), limits],
        [playback.Playback.PATIENCE, servo_loop.ServoLoop.PATIENCE],
    ]


@pytest.mark.sweep(kept=11)
@pytest.mark.slow
@pytest.mark.parametrize("name", KEPT.cases)
def test_results_are_those_that_were_kept(name):
    KEPT.check(name)

"""Loops in simulated time, with and without a hand or a surface: results that are kept.

See `tests/kept.py`.
"""

import numpy as np
import pytest

from dmpcli.admittance import model
from dmpcli.admittance.force_law import LawState
from dmpcli.control import chatter, guarded_motion
from dmpcli.control.contact_policy import ContactPolicy
from dmpcli.control.cycle import StopLimits
from dmpcli.control.guards import FollowingErrorMonitor
from dmpcli.control.loop_timing import LoopTiming
from dmpcli.control.plan_cursor import PlanCursor
from dmpcli.control.settling import RestWindow, SettlingDetector
from dmpcli.instruments.protocols import RobotState, ServoInfo
from dmpcli.planning.limits import Limits
from dmpcli.spatial.rotations import exp
from tests.control.contact_plant import Plant, Rig
from tests.control.drag_fakes import rehearse
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, plan, stroke
from tests.control.test_servo_loop import Bench
from tests.kept import Kept

KEPT = Kept(__file__)
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
    away = START + np.array([30.0, -40.0, 10.0])
    plans = [
        plan(stroke(2.0)),
        plan(stroke(1.5, 73.0, 0.6), 0.008, 0.5),
        plan(stroke(2.0, normal=(0, 0, 1)), start=(away, exp(np.array([0, 0.1, 0.2])) @ PEN_DOWN)),
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
    made = plan(stroke(1.6), start=(START + 5.0, PEN_DOWN))
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
            errors.add(START + [0.0, 2.0 * left**2, 0.0], PEN_DOWN)
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
def what_is_meant_where_nothing_is_said():
    return [ContactPolicy(5.0), StopLimits(1.0, 2.0, 3.0, 4.0), LawState(), model.Bounds()]


@pytest.mark.slow
@pytest.mark.parametrize("name", KEPT.cases)
def test_results_are_those_that_were_kept(name):
    KEPT.check(name)

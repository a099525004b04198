"""A stroke of known shape, and instruments that do exactly what a test tells them."""

import numpy as np

from dmpcli.control.run_log import Row
from dmpcli.errors import RefusedError
from dmpcli.instruments.protocols import RobotState, ServoInfo
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import Plan, make
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import from_euler
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.minimum_jerk import minimum_jerk

PEN_DOWN = from_euler(np.array([np.pi, 0.0, 0.0]))
START = np.array([-551.030, 131.399, -17.560])
LENGTH, AMPLITUDE = 109.0, 25.0

WIDE = Limits(250.0, 2250.0, 50_000.0, 0.785, 15.0, 333.0)


def sine(t, duration):
    """One sine period across x, minimum jerk along it: position at any time, mm."""
    u = minimum_jerk(np.clip(np.asarray(t) / duration, 0.0, 1.0))
    offset = np.stack([-LENGTH * u, AMPLITUDE * np.sin(2 * np.pi * u), 0.0 * u], axis=-1)
    return START + offset


def stroke(duration=10.0, rate=50.0, turn=0.0, rotated=True, normal=None, first_row=1):
    n = round(duration * rate)
    t = np.arange(n + 1) / rate
    angles = np.zeros((n + 1, 3))
    angles[:, 0] = np.pi
    angles[:, 2] = turn * minimum_jerk(t / duration)
    return StrokeTrajectory(
        t,
        sine(t, duration),
        from_euler(angles) if rotated else None,
        None if normal is None else np.broadcast_to(np.asarray(normal, float), (n + 1, 3)),
        first_row=first_row,
        id="0",
    )


def plan(source=None, period=0.02, speed=1.0, start=None, approach=20.0, limits=WIDE) -> Plan:
    source = stroke() if source is None else source
    if start is None:
        held = PEN_DOWN if source.rotation is None else source.rotation[0]
        start = Pose(source.position[0], held)
    return make(source, period, speed, limits, start, approach)


class FakeClock:
    """Simulated time that can be made to oversleep: `jumps` maps a deadline's number to s."""

    def __init__(self, period=0.02, jumps=None):
        self.time = 100.0
        self.period = period
        self.jumps = dict(jumps or {})

    def now(self):
        return self.time

    def sleep_until(self, t):
        number = round((t - 100.0) / self.period)
        self.time = max(self.time, t) + self.jumps.pop(number, 0.0)


class FakeServo:
    """Reaches each set-point one period later; `at` maps a cycle's number to a deed.

    Cycle -1 is the look at where the arm stands once it has been started.
    """

    def __init__(
        self, clock, position=START, rotation=PEN_DOWN, lookahead=0.2, at=None, queues=False
    ):
        self.clock = clock
        self.position, self.rotation = np.array(position), np.array(rotation)
        self.info = ServoInfo("fake", (0.002, 0.1), lookahead, queues)
        self.at = dict(at or {})
        self.reads = -1
        self.sent = []
        self.calls = []
        self.mode = "ready"
        self.accepts = True
        self.stuck = False

    def open(self):
        return self.info

    def state(self):
        deed = self.at.pop(self.reads, None)
        self.reads += 1
        if deed is not None:
            deed(self)
        if self.sent and not self.stuck:
            self.position, self.rotation = self.sent[-1]
        return RobotState(self.clock.now(), self.position, self.rotation, self.mode)

    def start(self, period):
        self.calls.append("start")

    def send(self, position, rotation):
        if self.accepts:
            self.sent.append((np.array(position), np.array(rotation)))
        return self.accepts

    def stop(self):
        self.calls.append("stop")

    def close(self):
        self.calls.append("close")


def rows_of(log):
    """The rows of a run's log, one by one."""
    rows = log.rows
    count = len(rows)
    poses = [
        list(zip(rows.numbers(name), rows.rotations(f"{name}_rotation"), strict=True))
        for name in ("planned", "sent", "actual")
    ]
    wrench = [None] * count
    if "wrench" in rows.groups:
        wrench = [None if np.isnan(w).all() else w for w in rows.numbers("wrench")]
    coupling = rows.numbers("coupling") if "coupling" in rows.groups else np.zeros(count)
    t, t_plan, deadline, lateness = (
        rows.numbers(name) for name in ("t", "t_plan", "deadline", "lateness")
    )
    ids = [word or None for word in rows.words("id")]
    columns = (t, t_plan, *poses, deadline, lateness, wrench, coupling)
    force = rows.numbers("fn") if "fn" in rows.groups else np.zeros(count)
    contact = rows.words("contact") if "contact" in rows.texts else [""] * count
    events = rows.words("event") if "event" in rows.texts else [""] * count
    joints = list(rows.numbers("joints")) if "joints" in rows.groups else [None] * count
    words = (rows.words("state"), rows.words("phase"), ids, joints, events, force, contact)
    return [Row(*row) for row in zip(*columns, *words, strict=True)]


def refuse_any(checks):
    """Raise for the first check that failed, as the command does for a stroke's."""
    for check in checks:
        if not check.passed:
            raise RefusedError(str(check))

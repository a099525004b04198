"""Recordings with the mock lab, and instruments that do exactly what a test tells them."""

from collections import deque
from dataclasses import replace

import numpy as np

from dmpcli.control import workcell
from dmpcli.control.drag_loop import Recorder
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.protocols import RobotState, ServoInfo
from dmpcli.settings import layers
from dmpcli.settings.record import RecordSettings
from dmpcli.simulation import reference_strokes, rehearsal
from dmpcli.simulation.mock import PEN, PEN_DOWN


def drag_settings(**options):
    return layers.resolve(RecordSettings, options, "drag")


def rehearse(robot="mock:", sensor="mock:", **options):
    """Record with the mock tutor; returns the reference, the recorder and how it ended."""
    settings = drag_settings(**options)
    stroke = reference_strokes.build(settings)
    clock = SimulatedClock()
    bench = workcell.connect(robot, sensor, clock, scene=rehearsal.scene(stroke, settings))
    tutored = rehearsal.rehearse(bench.lab, stroke, settings)
    recorder = Recorder(
        bench.robot,
        bench.sensor,
        clock,
        PEN.with_zero(None),
        settings,
        tutored.longest,
        begin=tutored.begin,
        lead_in=tutored.lead_in,
    )
    return stroke, recorder, recorder.run()


def positions(recorder):
    columns = recorder.log.columns()
    return columns["t"], np.column_stack([columns[n] for n in "xyz"])


class FakeServo:
    """Reaches each set-point at once."""

    def __init__(self, clock, lookahead=0.2):
        self.clock, self.lookahead = clock, lookahead
        self.position, self.rotation = np.zeros(3), PEN_DOWN
        self.mode = "ready"
        self.accepts = lambda t: True
        self.sent = []
        self.calls = []

    def open(self):
        self.calls.append("open")
        return ServoInfo("fake", (0.002, 0.1), self.lookahead)

    def state(self):
        mode = self.mode(self.clock.now()) if callable(self.mode) else self.mode
        return RobotState(self.clock.now(), self.position, self.rotation, mode)

    def start(self, period):
        self.calls.append("start")

    def send(self, position, rotation):
        if not self.accepts(self.clock.now()):
            return False
        self.sent.append((self.clock.now(), position))
        self.position, self.rotation = position, rotation
        return True

    def stop(self):
        self.calls.append("stop")

    def close(self):
        self.calls.append("close")


class QueueServo(FakeServo):
    """Queues set-points for one look-ahead, and takes one out each period by its own clock.

    `level` is what the queue holds when it is left, `speed` how fast the arm moves then, mm/s.
    """

    def __init__(self, clock, lookahead=0.1):
        super().__init__(clock, lookahead)
        self.queue, self.dry, self.level, self.speed = deque(), 0, None, None
        self.before = self.position

    def open(self):
        return replace(super().open(), queues=True)

    def start(self, period):
        super().start(period)
        self.period, self.taken = period, self.clock.now()
        self.queue.extend([(self.position, self.rotation)] * round(self.lookahead / period))

    def send(self, position, rotation):
        self._run()
        self.sent.append((self.clock.now(), position))
        self.queue.append((position, rotation))
        return True

    def state(self):
        self._run()
        return super().state()

    def stop(self):
        if self.level is None:
            self._run()
            self.level = len(self.queue)
            self.speed = np.linalg.norm(self.position - self.before) / self.period
        super().stop()

    def _run(self):
        while "start" in self.calls and self.taken + self.period <= self.clock.now() + 1e-9:
            self.taken += self.period
            self.before = self.position
            if self.queue:
                self.position, self.rotation = self.queue.popleft()
            else:
                self.dry += 1

"""How punctual the loops of `record` and `execute` are, beside a bare loop on the same machine.

    python -m benchmarks.lateness [--block 30] [--rates 50 250]
    python -m benchmarks.lateness --robot URL --sensor URL --tool FILE

For each rate and each command six blocks take turns: the bare loop (absolute deadlines, sleep, read
the clock, no work) and ours (everything, the journal too). Pooled over its three blocks our p99 may
be at most twice the bare loop's and 0.5 ms more. Our own work in a cycle may take 1 ms (median):
all that the loop's thread computes, the mock's physics with it. Over the wire (`--robot`,
`--sensor`) it takes longer from waking to sleep, as the controller's answer is waited for. They
are for the virtual lab of `dmpcli simulate`: an arm is moved by 109 mm and more from wherever it
stands, with no limits on force and following error.
"""

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.control import execution, force_execution, workcell
from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.drag_loop import Recorder
from dmpcli.control.loop_timing import LoopTiming
from dmpcli.control.servo_loop import ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.control.watchdog import watched
from dmpcli.instruments.clock import MonotonicClock
from dmpcli.planning import plan as planning
from dmpcli.planning.limits import limits_of
from dmpcli.records import file_io, schemas
from dmpcli.records import tool as tool_file
from dmpcli.records.journal import Journal
from dmpcli.records.record import Provenance
from dmpcli.settings import layers
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.settings.record import RecordSettings
from dmpcli.simulation import reference_strokes, rehearsal
from dmpcli.simulation.mock import PEN, Scene
from dmpcli.spatial.trajectory import StrokeTrajectory
from dmpcli.spatial.wrench import Tool

BLOCKS = 3
# A look-ahead that bears a busy machine: a benchmark that stops early measures nothing.
ROBOT = "mock:?lag=0.4"


class Metered(MonotonicClock):
    """The real clock; it meters what the thread that sleeps on it computes in between.

    Attributes
    ----------
    computed : list of float
        From each waking to the next sleep, s of processor time.
    """

    def __init__(self) -> None:
        self.computed: list[float] = []
        self._woke: float | None = None

    def sleep_until(self, t: float) -> None:
        """Sleep."""
        if self._woke is not None:
            self.computed.append(time.thread_time() - self._woke)
        super().sleep_until(t)
        self._woke = time.thread_time()


Measured: TypeAlias = tuple[LoopTiming, list[float]]
"""When cycles woke, sent and ended, and what each computed, s of processor time."""


@dataclass(frozen=True)
class Place:
    """Which instruments are driven, and the tool on them."""

    robot: str
    sensor: str
    tool: Tool

    def connect(self, clock: MonotonicClock, scene: Scene) -> workcell.Workcell:
        """Connect to them; the scene is a mock's."""
        return workcell.connect(self.robot, self.sensor, clock, scene=scene, tool=self.tool)


def bare(period: float, duration: float) -> tuple[Floats, int]:
    """Return the lateness of each cycle of a loop that does nothing, s, and its missed periods."""
    late, missed, number = [], 0, 0
    begin = time.monotonic()
    while number * period < duration:
        wait = begin + number * period - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        now = time.monotonic() - begin
        late.append(now - number * period)
        following = max(int(now / period), number) + 1
        missed += following - number - 1
        number = following
    return np.array(late), missed


def recording(period: float, duration: float, folder: Path, at: Place) -> Measured:
    """Run the loop of `record` on the real clock, with watchdog and journal."""
    given = {
        "control_rate": 1.0 / period,
        "sensor_rate": max(1.0 / period, 100.0),
        "duration": duration,
        "following_error": 100.0,
        "following_angle": 1.0,
    }
    settings = layers.resolve(RecordSettings, given, "drag")
    stroke, clock = reference_strokes.build(settings), Metered()
    bench = at.connect(clock, rehearsal.scene(stroke, settings))
    tutored = rehearsal.rehearse(bench.lab, stroke, settings)
    recorder = Recorder(
        watched(bench.robot),
        bench.sensor,
        clock,
        at.tool.with_zero(None),
        settings,
        tutored.longest,
        begin=tutored.begin,
        lead_in=tutored.lead_in,
    )
    path = folder / "record.journal"
    journal = Journal(path, recorder.log.rows, schemas.DEMONSTRATION, Provenance("record"))
    ending = recorder.run()
    journal.finish({"ended": ending.reason})
    journal.discard()
    if ending.failure is not None:
        print(f"  ended early: {ending.reason}")
    return recorder.timing, clock.computed


def executing(period: float, duration: float, folder: Path, at: Place) -> Measured:
    """Run the loop of `execute` on the real clock, with sensor, watchdog and journal."""
    settings = layers.resolve(ExecuteSettings, {"period": period}, None)
    t = np.arange(round(duration * 100.0) + 1) / 100.0
    s = t / t[-1]
    u = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    # There and back: the next block begins where this one did.
    away = np.sin(np.pi * u) ** 2
    wave = np.column_stack([-109.0 * away, 25.0 * np.sin(2.0 * np.pi * u), 0.0 * u])
    stroke = StrokeTrajectory(t, np.array([-551.03, 131.4, -17.56]) + wave, None, id="0")
    clock = Metered()
    bench = at.connect(clock, execution.scene(stroke, presses=False))
    servo = watched(bench.robot)
    arm = ReadyArm(servo, servo.open(), clock)
    # From where it stands: the plan needs no approach.
    here = servo.state()
    stroke = replace(stroke, position=stroke.position + here.position - stroke.position[0])
    start = stroke.position[0], here.rotation
    plan = planning.make(stroke, period, 1.0, limits_of(settings), start, 20.0)
    watch = StopLimits(100.0, 1.0, 1e3, 1e3)
    touch = force_execution.touch(bench.sensor, at.tool, plan, settings, arm, None)
    loop = ServoLoop(plan, limits_of(settings), watch, arm, touch)
    path = folder / "execute.journal"
    journal = Journal(path, loop.log.rows, schemas.RUN, Provenance("execute"))
    outcome = loop.run(Interruption())
    journal.finish({"reason": outcome.reason})
    journal.discard()
    if outcome.failure is not None:
        print(f"  ended early: {outcome.reason}")
    servo.close()
    bench.sensor.close()
    return loop.timing, clock.computed


def _line(name: str, late: Floats, missed: int, more: str = "") -> None:
    median, p99, worst = 1e3 * np.quantile(late, [0.5, 0.99, 1.0])
    print(
        f"  {name:12s} p50 {median:6.3f}  p99 {p99:6.3f}  worst {worst:7.3f} ms   "
        f"missed {missed} of {len(late) + missed}{more}"
    )


def main() -> int:
    """Print the figures; 1 where one is missed."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--block", type=float, default=30.0, metavar="S")
    options.add_argument("--rates", type=float, nargs="+", default=[50.0, 250.0], metavar="HZ")
    options.add_argument("--robot", default=ROBOT)
    options.add_argument("--sensor", default="mock:")
    options.add_argument("--tool", type=Path, metavar="FILE", help="the mock knows its own")
    given = options.parse_args()
    tool = tool_file.decode(file_io.read(given.tool)) if given.tool else PEN
    at = Place(given.robot, given.sensor, tool)
    passed = True
    with tempfile.TemporaryDirectory() as name:
        for rate in given.rates:
            for command, ours in (("record", recording), ("execute", executing)):
                print(f"{command} at {rate:g} Hz, {2 * BLOCKS} blocks of {given.block:g} s")
                empty: list[tuple[Floats, int]] = []
                runs: list[Measured] = []
                for _ in range(BLOCKS):
                    empty.append(bare(1.0 / rate, given.block))
                    runs.append(ours(1.0 / rate, given.block, Path(name), at))
                passed &= _judge(empty, runs)
    print("passed" if passed else "failed")
    return 0 if passed else 1


def _judge(empty: list[tuple[Floats, int]], runs: list[Measured]) -> bool:
    idle = np.concatenate([late for late, _ in empty])
    wake, sent, work = (
        np.concatenate([np.array(getattr(pace, name)) for pace, _ in runs])
        for name in ("wake", "lateness", "work")
    )
    computed = float(np.median(np.concatenate([np.array(times) for _, times in runs])))
    missed = sum(pace.missed for pace, _ in runs)
    _line("bare", idle, sum(count for _, count in empty))
    _line("ours, woke", wake, missed)
    _line("ours, sent", sent, missed)
    bound = 2.0 * np.quantile(idle, 0.99) + 5e-4
    punctual, quick = bool(np.quantile(wake, 0.99) <= bound), computed <= 1e-3
    print(
        f"  p99 of the waking, at most {1e3 * bound:.3f} ms: {'yes' if punctual else 'NO'}\n"
        f"  computed in a cycle {1e3 * computed:.3f} ms (median), at most 1 ms: "
        f"{'yes' if quick else 'NO'}; from waking to sleep {1e3 * np.median(work):.3f} ms"
    )
    return punctual and quick


if __name__ == "__main__":
    sys.exit(main())

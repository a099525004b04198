"""Whether chatter of a dragged tool is named and ended, and calm drags are left alone.

``python -m benchmarks.chatter [--jobs N] [--lag S ...]``

The mock lab in simulated time, the preset ``drag``. A hand of 0.5 N/mm leads the pen down onto a
plate, presses with 3 N and draws to and fro for 10 s, trembling by 0.15 N. Plates of 10 to 50 N/mm,
servos that lag by 30 to 80 ms, set-points that are taken up 0 to 2 cycles late. What is unstable is
told by the same drag with nobody listening: after the touch the pen is off the plate for over 5 %
of the time. A chatter has ended where the pen lies on the plate in the last 2.5 s. The 24 calm runs
are drags in the air, on soft plates, with tremor of up to 0.8 N, and slow tapping.
"""

import argparse
import logging
import multiprocessing
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.control import workcell
from dmpcli.control.chatter import ChatterDetector
from dmpcli.control.drag_loop import Recorder
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.settings import layers
from dmpcli.settings.record import RecordSettings
from dmpcli.simulation.mock import PEN, Plate, Scene

DURATION, TOUCH = 10.0, 1.0  # s
ABOVE, PRESS, HAND = 4.0, 3.0, 0.5  # mm, N, N/mm
LAST = 2.5  # s
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Drag:
    """One drag.

    Attributes
    ----------
    stiffness, lag : float
        Of the plate, N/mm, and of the servos, s.
    cycles : int
        By which a set-point is taken up late.
    tremor : float
        RMS along each axis, N.
    taps : float
        Period of tapping, s; 0 presses evenly.
    air : bool
        Whether the plate is out of reach.
    heard : bool
        Whether anybody listens for chatter.
    seed : int
    """

    stiffness: float
    lag: float
    cycles: int
    tremor: float = 0.15
    taps: float = 0.0
    air: bool = False
    heard: bool = True
    seed: int = 0


class Hand:
    """A spring and a damper to where the hand aims, and a tremor."""

    def __init__(self, drag: Drag, start: Floats) -> None:
        self._drag, self._start, self._began = drag, start, np.inf
        rng = np.random.default_rng([drag.seed, 0xC4])
        self._waves = rng.uniform(8.0, 12.0, (12, 3)), rng.uniform(0.0, 2.0 * np.pi, (12, 3))

    def begin(self, t: float) -> None:
        """Take hold."""
        self._began = t

    def wrench(self, t: float, position: Floats, rotation: Floats, velocity: Floats) -> Floats:
        """Return what the hand does to the tool, shape (6,), N and N·m."""
        del rotation
        drag, since = self._drag, t - self._began
        if since <= 0.0:
            return np.zeros(6)
        down = (ABOVE + PRESS / HAND) * min(since / TOUCH, 1.0)
        if drag.taps and since > TOUCH:
            down *= 1.0 if (since - TOUCH) % drag.taps < 0.5 * drag.taps else 0.2
        way = 15.0 * np.sin(0.8 * max(since - 1.5, 0.0))
        aim = self._start + np.array([way, 0.0, -down])
        frequency, phase = self._waves
        shakes = np.sin(2.0 * np.pi * frequency * since + phase).sum(axis=0) * np.sqrt(2.0 / 12.0)
        force = HAND * (aim - position) - 0.03 * velocity[:3] + drag.tremor * shakes
        return np.concatenate([force, -0.2 * velocity[3:]])


class Late:
    """An arm that takes up set-points some cycles late."""

    def __init__(self, servo: Any, cycles: int) -> None:
        self._servo, self._queue = servo, deque[Any]()
        self._cycles = cycles

    def __getattr__(self, name: str) -> Any:
        return getattr(self._servo, name)

    def send(self, position: Floats, rotation: Floats) -> bool:
        """As of a servo."""
        self._queue.append((position, rotation))
        if len(self._queue) <= self._cycles:
            return True
        taken: bool = self._servo.send(*self._queue.popleft())
        return taken


def run(drag: Drag) -> dict[str, float]:
    """Return what came of a drag: share of the time off the plate, first alarm, alarms, ended."""
    logging.disable(logging.CRITICAL)
    settings = layers.resolve(RecordSettings, {"duration": DURATION}, "drag")
    surface = np.array([-551.0, 131.4, -17.5])
    start = surface + ABOVE * UP
    place = surface - (500.0 * UP if drag.air else 0.0)
    scene = Scene(position=start, plate=Plate(place, UP), seed=drag.seed)
    url = f"mock:?stiffness={drag.stiffness:g}&lag={drag.lag:g}"
    clock = SimulatedClock()
    bench = workcell.connect(url, url, clock, scene=scene)
    hand = Hand(drag, start)
    assert bench.lab is not None
    bench.lab.hand = hand
    recorder = Recorder(
        Late(bench.robot, drag.cycles),
        bench.sensor,
        clock,
        PEN.with_zero(None),
        settings,
        DURATION,
        begin=hand.begin,
    )
    if not drag.heard:
        recorder.chatter = Deaf(settings.law.period)
    outcome = recorder.run()
    if outcome.failure is not None:
        raise outcome.failure
    columns = recorder.log.columns()
    t, off = columns["t"], columns["z"] > place[2] + 1e-3
    touched = int(np.argmax(~off)) if (~off).any() else len(t) - 1
    alarms = recorder.chatter.alarms
    after = t > t[touched] + 0.5
    return {
        "off": float(off[after].mean()) if after.any() else 0.0,
        "named": alarms[0]["t"] - t[touched] if alarms else np.nan,
        "alarms": len(alarms),
        "left": float(off[t > t[-1] - LAST].mean()),
    }


class Deaf(ChatterDetector):
    """Hears nothing."""

    def feel(self, t: float, force: Floats, axis: Floats) -> bool:
        """As of a `ChatterDetector`."""
        del t, force, axis
        return False


def calm() -> list[Drag]:
    """The 24 calm drags."""
    return [
        *(
            Drag(5.0, lag, n, air=True, tremor=0.8, seed=n)
            for lag in (0.03, 0.08)
            for n in range(3)
        ),
        *(Drag(k, 0.03, n, seed=n) for k in (2.0, 5.0) for n in range(3)),
        *(Drag(k, 0.03, 0, tremor=0.8, seed=seed) for k in (2.0, 5.0) for seed in range(3)),
        *(Drag(k, 0.03, 0, taps=1.5 + 0.25 * n, seed=n) for k in (2.0, 5.0) for n in range(3)),
    ]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--lag", type=float, nargs="*", default=[0.03, 0.05, 0.08])
    asked = parser.parse_args()
    with multiprocessing.get_context("spawn").Pool(asked.jobs) as pool:
        quiet = calm()
        found = pool.map(run, quiet, chunksize=1)
        alarms = sum(one["alarms"] > 0 for one in found)
        print(f"{len(quiet)} calm runs, {alarms} with an alarm\n", flush=True)
        for drag, one in zip(quiet, found, strict=True):
            if one["alarms"]:
                print(f"ALARM: {drag}: {one}")
        print("off the plate unheard, named after, alarms, off the plate in the last 2.5 s\n")
        print(
            "| N/mm | "
            + " | ".join(f"{1e3 * lag:.0f} ms, {n}" for lag in asked.lag for n in range(3))
        )
        print("| ---: |" + " --- |" * (3 * len(asked.lag)), flush=True)
        for k in (10.0, 20.0, 35.0, 50.0):
            cells = [(lag, n) for lag in asked.lag for n in range(3)]
            work = [Drag(k, lag, n, heard=heard) for lag, n in cells for heard in (False, True)]
            results = pool.map(run, work, chunksize=1)
            print(
                f"| {k:g} | " + " | ".join(map(cell, results[::2], results[1::2])) + " |",
                flush=True,
            )


def cell(deaf: dict[str, float], heard: dict[str, float]) -> str:
    """Return what is said of one plate, lag and delay."""
    off = f"{100.0 * deaf['off']:.0f} %"
    if not heard["alarms"]:
        return f"{off}, MISSED" if deaf["off"] > 0.05 else f"{off}, calm"
    late = " LATE" if heard["named"] > 2.0 else ""
    return (
        f"{off}, {heard['named']:.1f} s{late}, {heard['alarms']:.0f}, {100.0 * heard['left']:.0f} %"
    )


if __name__ == "__main__":
    main()

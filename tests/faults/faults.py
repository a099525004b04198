"""What goes wrong, by seed: kinds of faults, each put on a bench with numbers of its own."""

import errno
import os
import signal
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import TypeAlias
from unittest import mock

import numpy as np

from dmpcli.instruments.elite.frames import FRAME
from dmpcli.records import file_io, journal
from tests.faults.bench import MONITOR_PORT, RPC_PORT, Bench, Wire

Rng: TypeAlias = np.random.Generator


@dataclass
class Wrong:
    """What was done to a bench.

    Attributes
    ----------
    words : list of str
        For people.
    hides : set of str
        What a judge must not rest on then: ``rest`` where nobody can see whether the arm rests,
        ``stop`` where it cannot be told to stop, ``disk`` where nothing can be kept.
    """

    words: list[str] = field(default_factory=list)
    hides: set[str] = field(default_factory=set)


Fault: TypeAlias = Callable[[Bench, Rng, Wrong, ExitStack], None]

KINDS: dict[str, Fault] = {}
"""Faults by name."""


def _kind(fault: Fault) -> Fault:
    KINDS[fault.__name__.strip("_")] = fault
    return fault


def _when(bench: Bench, rng: Rng, event: Callable[[], None]) -> float:
    """Have something happen some time after the first set-point; return that time, s."""
    after = float(rng.uniform(0.0, 1.2))

    def begun() -> None:
        bench.world.at(bench.world.now() + after, event)

    bench.begun.append(begun)
    return after


Change: TypeAlias = Callable[[bytes], list[tuple[bytes, float]] | None]
"""From bytes on their way to what becomes of them, with delays, s; None where nothing does."""


def _composed(before: Wire, change: Change) -> Wire:
    """Return what bytes become that one fault has had, and those before it."""

    def wire(content: bytes) -> list[tuple[bytes, float]]:
        changed = change(content)
        parts = [(content, 0.0)] if changed is None else changed
        return [(last, late + delay) for part, late in parts for last, delay in before(part)]

    return wire


def _replies(bench: Bench, change: Change) -> None:
    bench.reply = _composed(bench.reply, change)


def _frames(bench: Bench, change: Change) -> None:
    # What another fault has cut is no frame any more.
    bench.frame = _composed(bench.frame, lambda f: change(f) if len(f) == FRAME.itemsize else None)


def _once(bench: Bench, rng: Rng) -> tuple[Callable[[], bool], float]:
    """Return what is true once, at the first call after some time; and that time."""
    armed: list[bool] = []
    after = _when(bench, rng, lambda: armed.append(True))

    def now() -> bool:
        return bool(armed and armed.pop())

    return now, after


def _from(bench: Bench, rng: Rng) -> tuple[Callable[[], bool], float]:
    """Return what is true from some time on; and that time."""
    on: list[bool] = []
    after = _when(bench, rng, lambda: on.append(True))
    return lambda: bool(on), after


# The controller's replies.


@_kind
def reply_late(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    now, after = _once(bench, rng)
    delay = float(10.0 ** rng.uniform(-2.0, 0.5))
    _replies(bench, lambda r: [(r, delay)] if now() else None)
    wrong.hides.add("stop")
    wrong.words.append(f"a reply comes {delay:.3f} s late, {after:.2f} s in")


@_kind
def reply_lost(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    now, after = _once(bench, rng)
    _replies(bench, lambda _: [] if now() else None)
    wrong.hides.add("stop")
    wrong.words.append(f"a reply is lost, {after:.2f} s in")


@_kind
def reply_twice(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    now, after = _once(bench, rng)
    _replies(bench, lambda r: [(r, 3e-4), (r, 4e-4)] if now() else None)
    wrong.hides.add("stop")
    wrong.words.append(f"a reply comes twice, {after:.2f} s in")


@_kind
def reply_torn(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    now, after = _once(bench, rng)

    def torn(reply: bytes) -> list[tuple[bytes, float]] | None:
        if not now():
            return None
        bent = bytearray(reply)
        bent[int(rng.integers(len(bent)))] = int(rng.integers(256))
        return [(bytes(bent), 3e-4)]

    _replies(bench, torn)
    wrong.hides.add("stop")
    wrong.words.append(f"a byte of a reply is wrong, {after:.2f} s in")


@_kind
def reply_in_pieces(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    size = int(rng.integers(1, 12))
    _replies(
        bench,
        lambda r: [(r[i : i + size], 3e-4 + 1e-6 * i) for i in range(0, len(r), size)],
    )
    wrong.words.append(f"replies come in pieces of {size} bytes")


@_kind
def robot_slow(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    most = float(rng.uniform(0.005, 0.06))
    _replies(bench, lambda r: [(r, float(rng.uniform(0.0, most)))])
    wrong.hides.add("stop")
    wrong.words.append(f"replies take up to {most:.3f} s")


@_kind
def robot_mute(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    on, after = _from(bench, rng)
    _replies(bench, lambda _: [] if on() else None)
    wrong.hides.add("stop")
    wrong.words.append(f"no reply any more from {after:.2f} s in")


@_kind
def robot_cut(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    forever = bool(rng.integers(2))

    def cut() -> None:
        bench.exchange.cut(RPC_PORT)
        bench.exchange.refuses |= forever

    after = _when(bench, rng, cut)
    wrong.hides.add("stop")
    wrong.words.append(f"the connection is cut {'for good ' if forever else ''}{after:.2f} s in")


@_kind
def robot_refuses(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    after = _when(bench, rng, lambda: setattr(bench.lab.controller, "refuses", True))
    wrong.words.append(f"set-points are refused from {after:.2f} s in")


@_kind
def arm_stands(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    def stand() -> None:
        arm = bench.lab.controller.arm
        arm.advance = lambda _: None  # type: ignore[method-assign]

    after = 0.0 if rng.integers(2) else _when(bench, rng, stand)
    if after == 0.0:
        bench.begun.append(stand)
    wrong.words.append(f"everything is acknowledged and the arm stands, {after:.2f} s in")


@_kind
def stop_fails(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    """The stop is not answered, or by no, or by yes; the arm goes on with what it has."""
    call = bench.lab.call
    kept = ("tt_clear_servo_joint_buf", "stop", "stop_trajectory", "pause_trajectory")
    how = int(rng.integers(3))
    answer = (None, False, True)[how]
    bench.answers = lambda m, p: answer if m in kept and bench.entered else call(m, p)
    wrong.hides.add("stop")
    wrong.words.append(f"stops are {('not answered', 'refused', 'said to be done')[how]}")


# Monitor frames.


@_kind
def frames_stop(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    on, after = _from(bench, rng)
    _frames(bench, lambda _: [] if on() else None)
    bench.must_stop.append(after + 0.15)
    wrong.words.append(f"no frames any more from {after:.2f} s in")


@_kind
def frames_late(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    on, after = _from(bench, rng)
    share, late = float(10.0 ** rng.uniform(-1.5, 0.0)), [0.0]

    def lag(frame: bytes) -> list[tuple[bytes, float]] | None:
        if not on():
            return None
        late[0] += 0.008 * share
        return [(frame, late[0])]

    _frames(bench, lag)
    wrong.words.append(f"frames lag by {share:.2f} s more each second from {after:.2f} s in")


@_kind
def frames_lost(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    share = float(rng.uniform(0.02, 0.9))
    _frames(bench, lambda _: [] if rng.random() < share else None)
    wrong.words.append(f"{share:.0%} of the frames are lost")


@_kind
def frames_twice(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    share = float(rng.uniform(0.1, 1.0))
    _frames(bench, lambda f: [(f, 3e-4), (f, 9e-3)] if rng.random() < share else None)
    wrong.words.append(f"{share:.0%} of the frames come twice")


@_kind
def frame_torn(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    now, after = _once(bench, rng)
    cut = int(rng.integers(1, 1023))
    _frames(bench, lambda f: [(f[:cut], 3e-4)] if now() else None)
    wrong.words.append(f"a frame ends after {cut} bytes, {after:.2f} s in")


def _changed(frame: bytes, **fields: object) -> bytes:
    made = np.frombuffer(frame, FRAME).copy()
    for name, value in fields.items():
        made[name] = value
    return made.tobytes()


@_kind
def frame_nan(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    now, after = _once(bench, rng)
    bad = float(rng.choice([np.nan, np.inf, 1e300, 400.0]))
    axis = int(rng.integers(6))

    def spoil(frame: bytes) -> list[tuple[bytes, float]] | None:
        if not now():
            return None
        joints = np.frombuffer(frame, FRAME)["joints"][0].copy()
        joints[axis] = bad
        return [(_changed(frame, joints=joints), 3e-4)]

    _frames(bench, spoil)
    wrong.words.append(f"one frame says {bad:g}° of joint {axis + 1}, {after:.2f} s in")


@_kind
def frame_flag(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    """An emergency stop or a collision that is shown in a single frame, of those that arrive."""
    now, after = _once(bench, rng)
    name, before = str(rng.choice(["estop", "collision"])), bench.frame

    def flagged(frame: bytes) -> list[tuple[bytes, float]]:
        parts = before(frame)
        for i, (part, delay) in enumerate(parts):
            if len(part) == FRAME.itemsize and now():
                parts[i] = (_changed(part, **{name: 1}), delay)
                bench.must_stop.append(bench.world.now() + delay - bench.entered)
        return parts

    bench.frame = flagged
    wrong.words.append(f"a single frame shows {name}, {after:.2f} s in")


@_kind
def frames_frozen(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    """New time stamps, old joints."""
    on, after = _from(bench, rng)
    held: list[object] = []

    def freeze(frame: bytes) -> list[tuple[bytes, float]] | None:
        if not on():
            return None
        if not held:
            held.append(np.frombuffer(frame, FRAME)["joints"][0].copy())
        return [(_changed(frame, joints=held[0]), 3e-4)]

    _frames(bench, freeze)
    wrong.hides.add("rest")
    wrong.words.append(f"the joints that are told stand still from {after:.2f} s in")


@_kind
def clock_slews(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    share = float(rng.choice([-0.05, 0.05, 0.01, -0.01]))
    first: list[int] = []

    def slew(frame: bytes) -> list[tuple[bytes, float]]:
        stamp = int(np.frombuffer(frame, FRAME)["timestamp"][0])
        first.extend([] if first else [stamp])
        stamp += round(share * (stamp - first[0]))
        return [(_changed(frame, timestamp=stamp), 3e-4)]

    _frames(bench, slew)
    wrong.words.append(f"the controller's clock goes {share:+.0%} wrong")


@_kind
def monitor_cut(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    after = _when(bench, rng, lambda: bench.exchange.cut(MONITOR_PORT))
    bench.must_stop.append(after)
    wrong.words.append(f"the monitor is cut {after:.2f} s in")


# The arm.


@_kind
def estop(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    after = _when(bench, rng, lambda: bench.lab.controller.press_estop())
    bench.must_stop.append(after)
    wrong.words.append(f"emergency stop {after:.2f} s in")


@_kind
def collision(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    after = _when(bench, rng, lambda: bench.lab.controller.collide())
    bench.must_stop.append(after)
    wrong.words.append(f"collision {after:.2f} s in")


@_kind
def mode(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    after = _when(bench, rng, lambda: bench.lab.controller.switch(int(rng.integers(2))))
    bench.must_stop.append(after)
    wrong.words.append(f"the key is turned {after:.2f} s in")


@_kind
def alarm(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    after = _when(bench, rng, lambda: bench.lab.controller.raise_alarm("a joint overheats"))
    bench.must_stop.append(after)
    wrong.words.append(f"an alarm {after:.2f} s in")


# The sensor.


def _shares(name: str, least: float, most: float) -> Fault:
    def fault(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
        share = float(np.exp(rng.uniform(np.log(least), np.log(most))))
        setattr(bench.box.faults, name, share)
        wrong.words.append(f"{name} of {share:.1%} of the sensor's datagrams")

    return fault


for _name in ("loss", "duplication", "reordering", "malformed", "foreign"):
    KINDS[f"sensor_{_name}"] = _shares(_name, 0.001, 0.6)


def _later(name: str, value: object, words: str) -> Fault:
    def fault(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
        after = _when(bench, rng, lambda: setattr(bench.box.faults, name, value))
        bench.must_stop_with_sensor.append(after)
        wrong.words.append(f"the sensor {words} {after:.2f} s in")

    return fault


KINDS["sensor_silent"] = _later("silent_at", 0.0, "falls silent")
KINDS["sensor_saturated"] = _later("saturated", True, "saturates")
KINDS["sensor_fault"] = _later("status", 0x80000001, "flags an error")


@_kind
def sensor_stalled(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    after = _when(bench, rng, lambda: setattr(bench.box.faults, "stalled", True))
    bench.must_stop_with_sensor.append(after)
    wrong.words.append(f"the sensor's own counter stands {after:.2f} s in")


@_kind
def sensor_frozen(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    """Six equal values, while both counters go on."""

    def freeze() -> None:
        held = bench.box.reading(bench.world.now())
        bench.box.reading = lambda _: held  # type: ignore[method-assign]

    after = _when(bench, rng, freeze)
    bench.must_stop_with_sensor.append(after + 0.5)
    wrong.words.append(f"the sensor's values stand {after:.2f} s in")


@_kind
def sensor_biased(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    """Another client sets the box's bias."""
    axis, newtons = int(rng.integers(3)), float(rng.uniform(3.0, 20.0) * rng.choice([-1, 1]))
    after = _when(bench, rng, lambda: bench.box.set_bias(axis, int(newtons * 1e6)))
    bench.must_stop_with_sensor.append(after)
    wrong.words.append(f"the box's bias changes by {newtons:.1f} N {after:.2f} s in")


# The computer, and the people.


@_kind
def computer_slow(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    now, after = _once(bench, rng)
    late = float(10.0 ** rng.uniform(-2.5, 0.0))
    bench.world.lateness = lambda _: late if now() else 0.0
    wrong.words.append(f"the computer is {late:.3f} s late once, {after:.2f} s in")


@_kind
def computer_jittery(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    most = float(10.0 ** rng.uniform(-3.5, -1.7))
    bench.world.lateness = lambda _: float(rng.uniform(0.0, most))
    wrong.words.append(f"the computer is up to {most:.4f} s late")


@_kind
def signals(bench: Bench, rng: Rng, wrong: Wrong, _: ExitStack) -> None:
    number = int(rng.choice([signal.SIGINT, signal.SIGTERM, signal.SIGHUP]))
    count = int(rng.integers(1, 3))
    for _ in range(count):
        after = _when(bench, rng, lambda: bench.signal(number))
        bench.must_heed.append(after)
        wrong.words.append(f"{signal.Signals(number).name} {after:.2f} s in")


@_kind
def disk_full(bench: Bench, rng: Rng, wrong: Wrong, stack: ExitStack) -> None:
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    after = int(rng.integers(0, 4))
    left = [after]

    def failing(_: int, content: bytes = b"") -> int:
        left[0] -= 1
        if left[0] < 0:
            raise full
        return len(content)

    def write(file: int, content: bytes) -> int:
        failing(file, content)
        return os.write(file, content)

    for module in (journal, file_io):
        names = vars(os) | {"write": write, "fsync": failing}
        stack.enter_context(mock.patch.object(module, "os", SimpleNamespace(**names)))
    wrong.hides.add("disk")
    wrong.words.append(f"the disk is full after {after} writes")

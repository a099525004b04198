"""`check`: connect to the instruments, read them for a while, and tell; nothing moves.

The driver is opened and asked for its state; servo mode is never entered, and no motion is ever
asked for or stopped: an arm that somebody else moves goes on undisturbed.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.control import guards, workcell
from dmpcli.errors import InstrumentError, RefusedError
from dmpcli.instruments import clock as clocks
from dmpcli.instruments.protocols import Clock, RobotState, Sample, Sensor, Servo
from dmpcli.messages import tell, warn
from dmpcli.records import file_io
from dmpcli.records import tool as tool_file
from dmpcli.records.schemas import WRENCH
from dmpcli.settings.check import CheckSettings
from dmpcli.spatial.rotations import to_euler
from dmpcli.spatial.wrench import Tool

STILL = 0.1
"""How far an arm at rest may seem to move, mm: encoders' noise is below it."""


@dataclass(frozen=True)
class CheckRequest:
    """What is asked for beside the settings.

    Attributes
    ----------
    robot, sensor : str or None
        URLs; None leaves it out.
    tool : Path or None
        Where the TCP is on the flange.
    """

    robot: str | None
    sensor: str | None
    tool: Path | None = None


def check(settings: CheckSettings, request: CheckRequest) -> dict[str, Any]:
    """Read the instruments and tell of them.

    Returns
    -------
    dict
        What was read, as JSON values.

    Raises
    ------
    InputError
        A URL or the tool file is wrong.
    InstrumentError
        An instrument cannot be reached, sends nothing, or what must not be believed.
    RefusedError
        The robot is in a mode that forbids motion; all that was read is told before.
    """
    robot, sensor = request.robot or workcell.MOCK, request.sensor or workcell.MOCK
    simulated = workcell.repeatable(workcell.check(robot, sensor, allow_mixed=True))
    clock: Clock = clocks.SimulatedClock() if simulated else clocks.MonotonicClock()
    tool = None if request.tool is None else tool_file.geometry(file_io.read(request.tool))
    # Either may stand alone here: nothing is moved by what the other feels.
    bench = workcell.connect(robot, sensor, clock, allow_mixed=True, tool=tool)
    found: dict[str, Any] = {}
    trouble: list[InstrumentError | RefusedError] = []
    for name, wanted, read in (
        ("robot", request.robot, lambda: _robot(bench.robot, clock, settings, tool)),
        ("sensor", request.sensor, lambda: _sensor(bench.sensor, clock, settings)),
    ):
        if wanted is None:
            continue
        try:
            facts, fault = read()
        except (InstrumentError, RefusedError) as failure:
            trouble.append(failure)
            continue
        found[name] = {"url": wanted} | facts
        tell("\n  ".join([f"{name} {wanted}", *_lines(facts)]), {name: found[name]})
        if fault is not None:
            trouble.append(fault)
    for error in trouble[1:]:
        warn(str(error))
    if trouble:
        raise trouble[0]
    return found


def _robot(
    robot: Servo, clock: Clock, settings: CheckSettings, tool: Tool | None
) -> tuple[dict[str, Any], RefusedError | None]:
    try:
        said = robot.open()
        states = [robot.state()]
        end = clock.now() + settings.seconds
        while clock.now() < end:
            clock.sleep_until(min(clock.now() + 0.05, end))
            states.append(robot.state())
            guards.check_pose(states[-1])
    finally:
        closing = guards.leave(robot.close)
    if closing is not None:
        raise closing
    last = states[-1]
    moved = float(np.ptp([state.position for state in states], axis=0).max())
    facts: dict[str, Any] = {
        "make": said.make,
        "mode": last.mode + (f" ({last.detail})" if last.detail else ""),
        "period_s": list(said.period_range),
        "lookahead_s": said.lookahead,
        "position_mm": _rounded(last.position, 3),
        "euler_rad": _rounded(to_euler(last.rotation), 5),
        "joints_rad": None if last.joints is None else _rounded(last.joints, 5),
        "moved_mm": round(moved, 4),
        "tcp": "that of the tool file" if tool is not None else "the flange's or the robot's own",
    }
    return facts, _unready(last, moved)


def _unready(state: RobotState, moved: float) -> RefusedError | None:
    try:
        guards.check_ready(state)
    except RefusedError as error:
        return error
    if moved > STILL:
        return RefusedError(
            f"robot: it moved by {moved:.3g} mm meanwhile, and not by us; stop what moves it"
        )
    return None


def _sensor(
    sensor: Sensor, clock: Clock, settings: CheckSettings
) -> tuple[dict[str, Any], InstrumentError | None]:
    try:
        said = sensor.open()
        sensor.start(settings.sensor_rate)
        begun, samples = clock.now(), list[Sample]()
        while clock.now() < begun + settings.seconds:
            clock.sleep_until(min(clock.now() + 0.02, begun + settings.seconds))
            samples += sensor.poll()
    finally:
        closing = guards.leave(sensor.close)
    if closing is not None:
        raise closing
    if not samples:
        raise InstrumentError(
            f"force sensor: sent nothing for {settings.seconds:g} s; check cable and address"
        )
    wrench = np.array([sample.wrench for sample in samples])
    bad = next((sample for sample in samples if not sample.healthy), None)
    facts = {
        "make": said.identity,
        "simulated": said.virtual or said.make == "mock",
        "highest_rate_hz": said.rate,
        "samples": len(samples),
        "asked_rate_hz": settings.sensor_rate,
        "rate_hz": round(len(samples) / settings.seconds, 1),
        "lost": samples[-1].lost,
        "range": _rounded(said.limit, 3),
        "mean": _rounded(wrench.mean(axis=0), 3),
        "noise": _rounded(wrench.std(axis=0), 4),
    }
    if bad is None:
        return facts, None
    why = bad.reason or "a reading is saturated, or the sensor says that it is not well"
    return facts, InstrumentError(f"force sensor: {why}; free the tool and look at the sensor")


def _lines(facts: dict[str, Any]) -> list[str]:
    """Return what was read in words, one line a fact."""
    lines = []
    for key, value in facts.items():
        if key in ("range", "mean", "noise") and value is not None:
            shown = ", ".join(f"{n} {v:g}" for n, v in zip(WRENCH, value, strict=True))
            lines.append(f"{key} as sensed, N and N·m: {shown}")
            continue
        name, _, unit = key.rpartition("_")
        if unit not in ("s", "mm", "rad", "hz"):
            name, unit = key, ""
        if value is None:
            lines.append(f"{name.replace('_', ' ')}: not told")
            continue
        if isinstance(value, bool):
            shown = "yes" if value else "no"
        elif isinstance(value, list | float):
            shown = " ".join(f"{v:g}" for v in (value if isinstance(value, list) else [value]))
        else:
            shown = str(value)
        unit = "Hz" if unit == "hz" else unit
        lines.append(f"{name.replace('_', ' ')}: {shown} {unit}".rstrip())
    return lines


def _rounded(values: Floats, digits: int) -> list[float]:
    return [round(float(value), digits) + 0.0 for value in values]

"""One run: a command on the bench, with the faults of its seed, and what a judge says of it."""

import os
import signal
import tempfile
import traceback
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from typer.testing import CliRunner

from dmpcli.arrays import Floats
from dmpcli.cli import app
from dmpcli.control.signals import Interruption
from dmpcli.instruments import goal_sources
from dmpcli.kinematics import chain
from dmpcli.kinematics.models import model
from dmpcli.records import file_io, record, schemas, tool
from dmpcli.records.record import Provenance, Record
from dmpcli.simulation.elite_server.lab import ROBOT_MODEL, LabParameters
from dmpcli.simulation.mock import PEN, Plate
from dmpcli.spatial import output_events
from dmpcli.spatial.output_events import OutputEvent
from tests.faults.bench import Bench
from tests.faults.faults import KINDS, Wrong
from tests.faults.world import EndlessError

START = np.array([-551.03, 131.399, 245.031])
COMMANDS = {
    "execute": 0.29,
    "execute felt": 0.25,
    "execute pressed": 0.1,
    "execute file": 0.1,
    "record": 0.25,
    "calibrate": 0.01,
}
MOVED = "execute moved"
"""A third of what is executed: its goal jumps meanwhile, and garbage is sent beside it."""
"""What is run, and how often; a calibration takes as long as thirty strokes."""

STROKES = {"stroke": (1.0, 41), "short": (0.12, 41), "long": (1.0, 201)}
"""What is executed: size and samples. A short one ends within the following error that is allowed;
a long one, which a controller plays by itself, takes longer than an arm is watched after a stop."""
ALLOWED = {0, 2, 3, 4, *(128 + n for n in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP))}
# mm/s of the TCP: an arm at rest; and how long it may go on after the command, s.
_REST, _AFTER = 0.5, 0.3
# s for which other commands rest, lift or end by themselves.
_ENDING = 0.15
# What a person is told where the arm was not seen at rest.
_UNSURE = "THE ARM MAY STILL MOVE"
OUTPUT, _LEFT_ON = "DO1", "MAY STILL BE ON: DO1"
"""What is switched on along every stroke, and what is told where it could not be switched off."""


@dataclass
class Finding:
    """What one run came to.

    Attributes
    ----------
    seed : int
    command : str
    stroke : str
        Which is executed.
    faults : str
    code : int
    told : str
    wrong : list of str
        Invariants that do not hold; empty where all do.
    """

    seed: int
    command: str
    stroke: str
    faults: str
    code: int
    told: str
    wrong: list[str] = field(default_factory=list)


class Push:
    """A hand that swings the tool to and fro, and lets go."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._force = np.append(rng.uniform(-12.0, 12.0, 3), np.zeros(3))
        self._period, self._until = rng.uniform(0.3, 1.0), rng.uniform(0.5, 2.0)
        self._since: float | None = None

    def watch(self, t: float, arm: object, transmission: Any) -> None:
        """Take hold where set-points flow."""
        del arm
        if self._since is None and transmission is not None and transmission.running:
            self._since = t

    def wrench(self, t: float, *_: object) -> Floats:
        """Return the wrench on the tool, shape (6,), N and N·m."""
        if self._since is None or not 0.0 <= t - self._since <= self._until:
            return np.zeros(6)
        return self._force * np.sin(2.0 * np.pi * (t - self._since) / self._period)


@cache
def folder() -> Path:
    """A folder with what the commands read."""
    made = Path(tempfile.mkdtemp(prefix="dmpcli-faults-"))
    (made / "pen.json").write_bytes(tool.encode(PEN))
    # The plate lies where the plan says; to seek it 10 mm about would take as long as 20 strokes.
    (made / "pressed.toml").write_text("[execute]\ncoupling_reach = 2.0\n")
    for name, (scale, samples) in STROKES.items():
        t = 0.02 * np.arange(samples)
        u = t / t[-1]
        u = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        path = np.column_stack([-20.0 * u, 12.0 * u + 4.0 * np.sin(2.0 * np.pi * u), 0.0 * u])
        x, y, z = (START + scale * path).T
        columns = {"id": np.full(len(t), "0", dtype=object), "t": t, "x": x, "y": y, "z": z}
        # On for the rest of the stroke, and off whatever ends it.
        events = output_events.stored([OutputEvent(0.13 * t[-1], OUTPUT, on=True)], t)
        columns |= {schemas.EVENT: np.array(events, dtype=object)}
        facts = {"tau": float(t[-1]), "normal": [0.0, 0.0, 1.0]}
        facts |= {"k": [100.0] * 6, "d": [20.0] * 6}
        drawn = Record(schemas.TRAJECTORY, columns, Provenance("generalize", {}, (), facts))
        (made / f"{name}.parquet").write_bytes(record.encode(drawn))
    return made


def generator(seed: int) -> np.random.Generator:
    """Return what everything of a seed is drawn from."""
    return np.random.default_rng([seed, 0xFA])


def draw(seed: int, rng: np.random.Generator) -> tuple[str, list[str]]:
    """Draw a seed's command, and none to three kinds of faults."""
    command = str(rng.choice([*COMMANDS], p=[*COMMANDS.values()]))
    # By numbers of its own, so that a seed draws what it always drew for the rest.
    goals = np.random.default_rng([seed, 0x60])
    command = MOVED if command == "execute" and goals.random() < 1 / 3 else command
    count = int(rng.choice(4, p=[0.05, 0.6, 0.25, 0.1]))
    return command, [str(kind) for kind in rng.choice(sorted(KINDS), count, replace=False)]


def telling(seeds: Iterable[int]) -> list[int]:
    """Return the seeds that put a kind of fault on its first or its second command."""
    seen: dict[str, set[str]] = {}
    found = []
    for seed in seeds:
        command, kinds = draw(seed, generator(seed))
        on = [seen.setdefault(kind, set()) for kind in kinds]
        if any(len(commands) < 2 and command not in commands for commands in on):
            found.append(seed)
            for commands in on:
                commands.add(command)
    return found


def run(seed: int, kinds: tuple[str, ...] | None = None, command: str | None = None) -> Finding:
    """Run one seed.

    Parameters
    ----------
    seed : int
    kinds : tuple of str, optional
        Faults to put on; by the seed otherwise, none to three.
    command : str, optional
    """
    rng = generator(seed)
    drawn, chosen = draw(seed, rng)
    command = command or drawn
    chosen = chosen if kinds is None else [*kinds]
    stroke = "long" if command == "execute file" else str(rng.choice(["stroke", "short"]))
    wrong = Wrong()
    records = command == "record"
    hand = Push(rng) if records and rng.random() < 0.6 else None
    # What is pressed on is where the plan says.
    ground = Plate(START, np.array([0.0, 0.0, 1.0])) if command.endswith("pressed") else None
    parameters = LabParameters(START, ground=ground, seed=seed)
    bench = Bench(parameters, hand, seed)  # type: ignore[arg-type]
    output = folder() / f"out-{seed}.{'json' if command == 'calibrate' else 'parquet'}"
    with ExitStack() as stack:
        for kind in chosen:
            KINDS[kind](bench, rng, wrong, stack)
        stack.enter_context(bench.laid_out())
        # Its thread knows the machine's clock alone.
        for module in ("control.watchdog", "workflows.record"):
            watched = f"dmpcli.{module}.watched"
            stack.enter_context(mock.patch(watched, lambda servo: servo))
        stack.enter_context(_signals(bench))
        stack.enter_context(_goals(bench, np.random.default_rng([seed, 0x61])))
        result = CliRunner().invoke(app, _words(command, stroke, output))
        rest = _at_rest(bench) if not isinstance(result.exception, EndlessError) else True
    finding = Finding(
        seed, command, stroke, "; ".join(wrong.words) or "nothing", result.exit_code, result.stderr
    )
    try:
        finding.wrong = list(_judged(finding, result, bench, wrong, output, rest, hand))
    finally:
        for left in folder().glob(f"*out-{seed}*"):
            left.unlink()
    return finding


def _words(command: str, stroke: str, output: Path) -> list[str]:
    made = folder()
    # Of this process alone: an arm has one owner on a computer, and several processes run seeds.
    host = f"127.77.{os.getpid() // 256 % 256}.{os.getpid() % 256}"
    robot = f"elite://{host}?lookahead=0.1" + ("&mode=file" if command.endswith("file") else "")
    words = ["-o", str(output), "--robot", robot, "--tool", str(made / "pen.json")]
    felt = ["--sensor", "netft://127.0.0.1"]
    if command == "record":
        return ["record", *words, *felt, "--duration", "1.3"]
    if command == "calibrate":
        few = ["--poses", "8", "--tilt", "20", "--dwell", "0.25"]
        return ["calibrate", *words, *felt, *few, "--save", str(output.with_suffix(".parquet"))]
    words = ["execute", str(made / f"{stroke}.parquet"), *words]
    if command.endswith("file"):
        words += ["--allow-file-mode", "--ignore-events"]
    if command.endswith("felt"):
        words += felt
    if command == MOVED:
        words += ["--goal-from", "udp://:9870"]
    if command.endswith("pressed"):
        words += [*felt, "--coupling", "force", "--force-setpoint", "2"]
        words += ["--config", str(made / "pressed.toml")]
    return words


@contextmanager
def _goals(bench: Bench, rng: np.random.Generator) -> Iterator[None]:
    """Somebody moves the goal by up to 15 mm, mostly in its plane; some datagrams are damaged."""
    stroke = _plan("stroke")[-1]
    letters: list[tuple[float, bytes]] = []
    t = float(rng.uniform(0.0, 0.3))
    for number in range(1, int(rng.integers(2, 30))):
        way = rng.uniform(-1.0, 1.0, 3) * 10.0 ** rng.uniform(-1.0, 1.2)
        way[2] *= rng.random() < 0.1
        content = goal_sources.DATAGRAM.pack(b"DMPg", number, *(stroke + way))
        how = rng.random()
        if how < 0.1:
            content = content[: int(rng.integers(40))]
        elif how < 0.2:
            content = rng.bytes(goal_sources.DATAGRAM.size)
        elif how < 0.25:
            content = goal_sources.DATAGRAM.pack(b"DMPg", number, np.nan, *stroke[1:])
        letters += [(t, content)] * int(rng.choice([1, 1, 1, 2]))
        t += float(rng.exponential(0.1))

    def receive() -> goal_sources.Letter | None:
        due = bench.entered and letters and bench.world.now() >= bench.entered + letters[0][0]
        return (letters.pop(0)[1], ("127.0.0.1", 5000)) if due else None

    made = goal_sources.DatagramGoals("udp", receive, 0.2)
    with mock.patch.object(goal_sources, "datagrams", return_value=made):
        yield


@contextmanager
def _signals(bench: Bench) -> Iterator[None]:
    """Signals reach the interruption that is entered, as the system's would."""
    entered: list[Interruption] = []
    enter, leave = Interruption.__enter__, Interruption.__exit__

    def entering(self: Interruption) -> Interruption:
        entered.append(self)
        return enter(self)

    def leaving(self: Interruption, *why: Any) -> None:
        entered.remove(self)
        leave(self, *why)

    bench.signal = lambda number: entered and entered[-1].receive(number)
    with (
        mock.patch.object(Interruption, "__enter__", entering),
        mock.patch.object(Interruption, "__exit__", leaving),
    ):
        yield


def _at_rest(bench: Bench) -> bool:
    """Whether the arm stands, truly, soon after the command has ended."""
    bench.world.advance(bench.world.now() + _AFTER)
    before = bench.lab.controller.arm.posture.position
    moved = 0.0
    for _ in range(5):
        bench.world.advance(bench.world.now() + 0.1)
        bench.lab.frame()
        now = bench.lab.controller.arm.posture.position
        moved = max(moved, float(np.linalg.norm(now - before)) / 0.1)
        before = now
    return moved <= _REST


def _judged(
    finding: Finding,
    result: Any,
    bench: Bench,
    wrong: Wrong,
    output: Path,
    rest: bool,
    hand: object,
) -> Iterator[str]:
    code, told = finding.code, finding.told
    if code not in ALLOWED:
        yield f"exit {code}"
        if result.exception is not None:
            yield "".join(traceback.format_exception(*result.exc_info))[-1500:]
    rest = rest or "rest" in wrong.hides
    last = told.strip().splitlines()[-1] if told.strip() else ""
    if not rest and _UNSURE not in last:
        yield "the arm moves on, and the last line does not say so"
    if not rest and "stop" not in wrong.hides:
        yield "the arm moves on, and could have been told to stop"
    if not rest and code in (0, 2, 3):
        yield f"the arm moves on, and the exit code is {code}"
    on = any(bench.lab.controller.outputs.values())
    if on and (_LEFT_ON not in told or code == 0):
        yield f"an output was left on, and exit {code} does not tell it"
    yield from _steps(finding, bench)
    if code == 0:
        yield from _done(finding, bench, output, wrong)
    if "disk" not in wrong.hides:
        yield from _kept(finding, bench, output)
    if finding.command == "record" and hand is None:
        travel = _travel(bench)
        if travel > 15.0:
            yield f"nobody pulls, and the arm moves by {travel:.1f} mm"


def _positions(bench: Bench) -> tuple[Floats, Floats]:
    """Times and TCP positions of the set-points that were taken, shape (S,) and (S, 3)."""
    if not bench.sent:
        return np.zeros(0), np.zeros((0, 3))
    joints = np.array([joints for _, joints in bench.sent])
    at = chain.forward(model(ROBOT_MODEL), joints)
    position, rotation = at.position, at.rotation
    return np.array([t for t, _ in bench.sent]), position + rotation @ PEN.tcp_position


def _steps(finding: Finding, bench: Bench) -> Iterator[str]:
    """No set-point steps further than the plan does, nor leaves it."""
    _, sent = _positions(bench)
    if len(sent) < 2:
        return
    steps = np.linalg.norm(np.diff(sent, axis=0), axis=1)
    if finding.command == "calibrate":
        # The tool is turned about its tip.
        away = np.linalg.norm(sent - sent[0], axis=1).max()
        if away > 0.1:
            yield f"a set-point leads the tip {away:.2f} mm away"
        return
    if finding.command == "record":
        if steps.max() > 0.02 * 250.0 * 1.01:
            yield f"a set-point steps by {steps.max():.2f} mm"
        return
    if finding.command == MOVED:
        # However the goal jumps, within the limits of `execute`.
        bent = np.linalg.norm(np.diff(sent, 2, axis=0), axis=1).max(initial=0.0) / 0.02**2
        if steps.max() > 0.02 * 250.0 * 1.01 or bent > 1.1 * 2250.0:
            yield f"a set-point steps by {steps.max():.2f} mm, by {bent:.0f} mm/s²"
        return
    plan = _plan(finding.stroke)
    # A soft start and the way back on the same path are slower than the plan.
    most = 1.02 * np.linalg.norm(np.diff(plan, axis=0), axis=1).max() + 0.01
    if finding.command != "execute pressed" and steps.max() > most:
        yield f"a set-point steps by {steps.max():.3f} mm, the plan by {most:.3f}"
    off = sent if finding.command != "execute pressed" else sent * [1.0, 1.0, 0.0]
    line = _fine(plan if finding.command != "execute pressed" else plan * [1.0, 1.0, 0.0])
    away = np.linalg.norm(off[:, None] - line[None], axis=2).min(axis=1).max()
    if away > 0.1:
        yield f"a set-point is {away:.2f} mm off the plan"


def _left(finding: Finding, bench: Bench) -> float:
    """Until when set-points were left to be sent, s after the first one: then a signal stops."""
    if finding.command not in ("execute", "execute felt"):
        # What is pressed leaves beside the plan; a controller plays by itself; a recording ends
        # when its time is over.
        return bench.ended - bench.entered - _ENDING
    t, sent = _positions(bench)
    there = np.linalg.norm(sent - _plan(finding.stroke)[-1], axis=1) < 1e-3
    return float(t[int(np.argmax(there))]) - bench.entered - 0.02 if there.any() else np.inf


@cache
def _plan(name: str) -> Floats:
    kept = record.decode(file_io.read(str(folder() / f"{name}.parquet")), schemas.TRAJECTORY)
    return np.column_stack([kept.columns[name] for name in "xyz"]).astype(float)


def _fine(path: Floats) -> Floats:
    u = np.linspace(0.0, len(path) - 1.0, 20 * len(path))
    return np.column_stack([np.interp(u, np.arange(len(path)), column) for column in path.T])


def _travel(bench: Bench) -> float:
    """How far the set-points led the arm, mm."""
    _, sent = _positions(bench)
    return float(np.linalg.norm(sent - sent[0], axis=1).max()) if len(sent) else 0.0


def _done(finding: Finding, bench: Bench, output: Path, wrong: Wrong) -> Iterator[str]:
    """Exit 0: it was done, and it was done right."""
    if not output.exists():
        yield "exit 0 without a file"
        return
    stop = bench.must_stop + (
        [] if finding.command in ("execute", MOVED, "execute file") else bench.must_stop_with_sensor
    )
    lasts = bench.ended - bench.entered if bench.ended else 0.0
    if any(after < lasts - 0.15 for after in stop):
        yield f"exit 0, and the arm had to stop {min(stop):.2f} s in, of {lasts:.2f}"
    left = _left(finding, bench)
    if any(after < left for after in bench.must_heed):
        yield f"exit 0, and a signal came {min(bench.must_heed):.2f} s in, of {left:.2f}"
    if finding.command in ("record", "calibrate"):
        return
    kept = record.decode(file_io.read(str(output)), schemas.RUN)
    if not kept.provenance.facts["completed"]:
        yield "exit 0 of a run that says it is not complete"
    at, goal = bench.lab.controller.arm.posture.position, _plan(finding.stroke)[-1]
    if finding.command == MOVED:
        goal = np.array(kept.provenance.facts["goals"]["last"])
    away = float(np.linalg.norm(at - goal))
    if finding.command != "execute pressed" and away > 1.0:
        yield f"exit 0, and the arm stands {away:.2f} mm from the goal"
    if finding.command != "execute file" and not bench.lab.controller.outputs:
        yield "exit 0, and an output of the stroke was never switched on"


def _kept(finding: Finding, bench: Bench, output: Path) -> Iterator[str]:
    """What was logged is there: in the file or in the journal."""
    if len(bench.sent) < 15 or finding.command == "calibrate":
        return
    journals = [p for p in output.parent.glob(f"*out-{finding.seed}*") if p != output]
    if not output.exists() and not journals:
        yield f"{len(bench.sent)} set-points were sent, and nothing is kept"
    if output.exists():
        schema = schemas.DEMONSTRATION if finding.command == "record" else schemas.RUN
        record.decode(file_io.read(str(output)), schema)

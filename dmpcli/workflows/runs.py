"""The Python API of what moves an arm, the mock's or a real one: `record` and `execute`.

What ends a run ends the call: a limit or an instrument by its error, Ctrl-C by KeyboardInterrupt
and another signal by SystemExit, once the arm stands still and what was logged is kept.
"""

import contextlib
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, overload

from dmpcli.control.execution_plan import CheckedPlan
from dmpcli.errors import InputError
from dmpcli.records import record as records
from dmpcli.records.file_io import Source
from dmpcli.records.record import Record
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.settings.layers import resolve
from dmpcli.settings.record import RecordSettings
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.workflows import execute as executing
from dmpcli.workflows import record as recording
from dmpcli.workflows import values
from dmpcli.workflows.execute import ExecutionRequest
from dmpcli.workflows.record import RecordingRequest
from dmpcli.workflows.run_output import FinishedRun
from dmpcli.workflows.values import Demonstration, Run, TrajectoryBatch


def record(
    output: str | Path | None = None,
    *,
    sensor: str = "mock:",
    robot: str = "mock:",
    tool: str | Path | None = None,
    realtime: bool = False,
    allow_mixed: bool = False,
    force: bool = False,
    preset: str = "drag",
    config: str | Path | None = None,
    **settings: Any,
) -> Demonstration:
    """Record one stroke that a hand drags the tool along.

    Parameters
    ----------
    output : str or Path, optional
        File to write; real instruments need one, as what they measure cannot be made again.
    sensor, robot : str
        URLs.
    tool, realtime, allow_mixed, force, preset, config
        As the options of ``dmpcli record``.
    **settings
        Its other options, with underscores, and the keys of its TOML section.

    Raises
    ------
    InputError, InstrumentError, RefusedError
        As ``dmpcli record``.
    """
    resolved = resolve(RecordSettings, settings, preset, _path(config))
    name = None if output is None else str(output)
    request = RecordingRequest(name, sensor, robot, _path(tool), realtime, allow_mixed, force)
    made = _whole(recording.record(resolved, request, settings))
    return values.demonstration(Source(name or "demonstration", records.encode(made)), None)


@overload
def execute(trajectory: str | Path | Trajectory, output: str | Path, **said: Any) -> Run: ...
@overload
def execute(
    trajectory: str | Path | Trajectory,
    output: None = None,
    *,
    dry_run: Literal[True],
    **said: Any,
) -> list[CheckedPlan]: ...
@overload
def execute(trajectory: str | Path | Trajectory, output: None = None, **said: Any) -> Run: ...
def execute(
    trajectory: str | Path | Trajectory,
    output: str | Path | None = None,
    *,
    id: str | Sequence[str] = (),  # noqa: A002
    robot: str = "mock:",
    sensor: str | None = None,
    tool: str | Path | None = None,
    robot_model: str | None = None,
    coupling: Literal["force"] | None = None,
    goal_from: str | Path | None = None,
    dry_run: bool = False,
    realtime: bool = False,
    allow_mixed: bool = False,
    allow_file_mode: bool = False,
    force: bool = False,
    preset: str | None = None,
    config: str | Path | None = None,
    **settings: Any,
) -> Run | list[CheckedPlan]:
    """Check a trajectory, or those of a batch, then stream them.

    Parameters
    ----------
    trajectory : Trajectory, TrajectoryBatch, str or Path
        Or the name of its file or folder.
    output : str or Path, optional
        Run file; real instruments need one, as what they measure cannot be made again.
    id : str or sequence of str
        Which of several strokes, in this order; all by default.
    robot, sensor : str
        URLs.
    dry_run : bool
        Move nothing; return each stroke as planned, with its checks.
    goal_from : str or Path, optional
        Where the goal moves meanwhile: a file, or ``udp://HOST:PORT``.
    tool, robot_model, coupling, realtime, allow_mixed, allow_file_mode, force, preset, config
        As the options of ``dmpcli execute``.
    **settings
        Its other options, with underscores, and the keys of its TOML section.

    Raises
    ------
    InputError, RefusedError, InstrumentError
        As ``dmpcli execute``.
    """
    resolved = resolve(ExecuteSettings, settings, preset, _path(config))
    executing.check_said(settings, sensor is not None, coupling is not None)
    with contextlib.ExitStack() as stack:
        given: str | Source
        if isinstance(trajectory, str | Path):
            given = str(trajectory)
        elif isinstance(trajectory, TrajectoryBatch):
            given = str(stack.enter_context(values.folder_of(trajectory)))
        else:
            given = _drawn(trajectory)
        request = ExecutionRequest(
            given,
            (id,) if isinstance(id, str) else tuple(id),
            None if output is None else str(output),
            robot,
            sensor or ("mock:" if coupling else None),
            _path(tool),
            robot_model,
            coupling is not None,
            realtime,
            allow_mixed,
            force,
            dry_run,
            allow_file_mode,
            goal_from=None if goal_from is None else str(goal_from),
        )
        done = executing.execute(resolved, request)
    if done.run is None:
        return done.checked
    return values.of_run(_whole(done.run))


def _drawn(value: Any) -> Source:
    if not isinstance(value, Trajectory):
        raise InputError(f"{type(value).__name__} is no trajectory; `generalize` draws one")
    return values.source_of(value)


def _path(name: str | Path | None) -> Path | None:
    return None if name is None else Path(name)


def _whole(run: FinishedRun) -> Record:
    """Return what was logged to the end; what a signal ended stays with the file."""
    if run.signal == signal.SIGINT:
        raise KeyboardInterrupt(run.reason)
    if run.signal is not None:
        raise SystemExit(128 + run.signal)
    assert run.record is not None
    return run.record

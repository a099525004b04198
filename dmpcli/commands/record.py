"""``dmpcli record``: drag the tool along a stroke once, and keep what it did."""

from pathlib import Path
from typing import Annotated

import typer

from dmpcli.commands.options import AllowMixed, Quiet, Realtime, Robot, Sensor
from dmpcli.messages import on_terminal
from dmpcli.settings.options import Given, with_options
from dmpcli.settings.record import RecordSettings


@with_options
def command(
    *,
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="FILE", help="Demonstration; - is stdout.")
    ],
    sensor: Sensor = "mock:",
    robot: Robot = "mock:",
    tool: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Tool file.  [default: the mock knows its own]"),
    ] = None,
    settings: RecordSettings,
    given: Given,
    realtime: Realtime = False,
    allow_mixed: AllowMixed = False,
    force: Annotated[
        bool, typer.Option("--force", help="Replace a recording from real instruments.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Record one stroke that a hand drags the tool along."""
    on_terminal(quiet)
    from dmpcli.workflows.record import RecordingRequest, record

    request = RecordingRequest(output, sensor, robot, tool, realtime, allow_mixed, force)
    finished = record(settings, request, given)
    if finished.signal is not None:
        raise typer.Exit(128 + finished.signal)

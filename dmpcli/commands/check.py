"""``dmpcli check``: whether robot and sensor answer, and what they say."""

from pathlib import Path
from typing import Annotated

import typer

from dmpcli.commands.options import ROBOTS, SENSORS, Quiet, urls
from dmpcli.messages import on_terminal
from dmpcli.settings.check import CheckSettings
from dmpcli.settings.options import with_options


@with_options
def command(
    *,
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            help=f"The arm: {ROBOTS}.  [default: mock: if no sensor is named either]",
            autocompletion=urls("robot"),
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            help=f"The force sensor: {SENSORS}  [default: mock: if no robot is named either]",
            autocompletion=urls("sensor"),
        ),
    ] = None,
    tool: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Tool file: the pose told is then its TCP's, and compared."
        ),
    ] = None,
    settings: CheckSettings,
    quiet: Quiet = False,
) -> None:
    """Connect to robot and sensor, read them and tell; nothing moves."""
    on_terminal(quiet)
    from dmpcli.messages import tell
    from dmpcli.workflows.check import CheckRequest, check

    if robot is None and sensor is None:
        robot = sensor = "mock:"
    check(settings, CheckRequest(robot, sensor, tool))
    tell("ready; nothing was moved")

"""``dmpcli execute``: stream a trajectory to the servo interface, after careful checks."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from dmpcli.commands.options import ARMS, SENSORS, AllowMixed, Quiet, Realtime, Robot, urls
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.settings.options import Given, choice, with_options


@with_options
def command(
    *,
    trajectory: Annotated[
        str, typer.Argument(metavar="TRAJECTORY", help="File or batch folder; - is stdin.")
    ],
    output: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Run file; - is stdout. Needed but for --dry-run.",
        ),
    ] = None,
    robot: Robot = "mock:",
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            help=f"The force sensor: {SENSORS}  [default: none; with --coupling force mock:]",
            autocompletion=urls("sensor"),
        ),
    ] = None,
    tool: Annotated[Path | None, typer.Option(metavar="FILE", help="Tool file.")] = None,
    robot_model: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Check the joints of this arm too: ec66, ur5e.",
            autocompletion=choice(*ARMS),
        ),
    ] = None,
    coupling: Annotated[
        Literal["force"] | None,
        typer.Option(
            metavar="force",
            help="Press on the surface, eq. (10).",
            autocompletion=choice("force"),
        ),
    ] = None,
    goal_from: Annotated[
        str | None,
        typer.Option(
            metavar="SOURCE",
            help="Let the goal move while it is drawn, on a plane: a file of t x y z, or "
            "udp://HOST:PORT.",
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only check; print the verdict, send nothing.")
    ] = False,
    stroke_ids: Annotated[
        list[str] | None,
        typer.Option(
            "--id", metavar="ID", help="Which of several strokes, in this order.  [default: all]"
        ),
    ] = None,
    settings: ExecuteSettings,
    given: Given,
    realtime: Realtime = False,
    allow_mixed: AllowMixed = False,
    allow_file_mode: Annotated[
        bool,
        typer.Option(
            "--allow-file-mode",
            help="Let the controller play the plan, though the arm draws on if the link is lost.",
        ),
    ] = False,
    ignore_events: Annotated[
        bool,
        typer.Option(
            "--ignore-events", help="Switch no outputs, though the trajectory asks for it."
        ),
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing recording.")] = False,
    quiet: Quiet = False,
) -> None:
    """Check a trajectory, then stream it; Ctrl-C decelerates, a second one stops at once."""
    on_terminal(quiet)
    from dmpcli.workflows.execute import ExecutionRequest, check_said, execute

    check_said(given, sensor is not None, coupling is not None)
    if output is None and not dry_run:
        raise InputError("-o: name the run file, or ask for the checks alone with --dry-run")
    request = ExecutionRequest(
        trajectory,
        tuple(stroke_ids or ()),
        output,
        robot,
        sensor or ("mock:" if coupling else None),
        tool,
        robot_model,
        coupling is not None,
        realtime,
        allow_mixed,
        force,
        dry_run,
        allow_file_mode,
        ignore_events,
        goal_from,
    )
    run = execute(settings, request).run
    if run is not None and run.signal is not None:
        raise typer.Exit(128 + run.signal)

"""The front door: one line per subcommand; nothing heavy is loaded until a command runs."""

import os
import signal
import sys
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from dmpcli.commands import (
    calibrate,
    execute,
    fit,
    generalize,
    inspect,
    record,
    recover,
    register,
    report,
    simulate,
    touch,
)
from dmpcli.commands.pose_words import joined
from dmpcli.errors import DmpError
from dmpcli.version import __version__


class Group(TyperGroup):
    """Turns a user's mistake into one message and its exit code; a defect keeps its traceback."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words after the program's name; poses of six words become one value."""
        return super().parse_args(ctx, joined(args))

    def invoke(self, ctx: Any) -> Any:
        """Run the subcommand."""
        try:
            return super().invoke(ctx)
        except DmpError as error:
            print(f"dmpcli: {error}", file=sys.stderr)  # noqa: T201
            sys.exit(error.exit_code)
        except BrokenPipeError:
            sys.exit(128 + signal.SIGPIPE)


app = typer.Typer(
    name="dmpcli",
    cls=Group,
    help="Turn one drag-taught stroke into the same stroke anywhere.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("record")(record.command)
app.command("fit")(fit.command)
app.command("generalize")(generalize.command)
app.command("execute")(execute.command)
app.command("report")(report.command)
app.command("inspect")(inspect.command)
app.command("recover")(recover.command)
app.command("register")(register.command)
app.command("simulate")(simulate.command)
app.command("calibrate")(calibrate.command)
app.command("touch")(touch.command)


def _version(asked: bool) -> None:
    if asked:
        print(f"dmpcli {__version__}")  # noqa: T201
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Turn one drag-taught stroke into the same stroke anywhere."""


def main() -> None:
    """Console entry point."""
    # Before numpy is loaded: with more threads the last bits of a product depend on the number of
    # cores, and these matrices are too small to gain from them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # By default Python ends without cleaning up; half-written files would stay.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    app()

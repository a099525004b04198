"""The front door: one line per subcommand; nothing heavy is loaded until a command runs."""

import functools
import importlib
import keyword
import os
import signal
import sys
from collections.abc import Callable
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.exceptions import TyperException

from dmpcli.commands.help_page import HelpedCommand, width
from dmpcli.commands.pose_arguments import joined
from dmpcli.commands.shared_options import shared
from dmpcli.errors import DmpError, UnconfirmedStopError, printable
from dmpcli.messages import prepare_streams, say
from dmpcli.version import __version__

CONTEXT = {"help_option_names": ["-h", "--help"]}

COMMANDS = {
    "record": "Record one stroke that a hand drags the tool along.",
    "fit": "Learn a skill from one or several demonstrations.",
    "generalize": "Draw a skill at new start and goal points.",
    "execute": "Check a trajectory, then stream it; Ctrl-C decelerates, a second one stops at once.",  # noqa: E501
    "report": "Compare strokes: wave heights, deviation, smoothness, ends, deadlines.",
    "import": "Make demonstrations of other programs' recordings, drawings and robot programs.",
    "export": "Write a motion as other programs read it: tables, bags, polylines, robot programs.",
    "inspect": "Say what a file is: schema, columns, units, ranges, provenance; how fit reads it.",
    "recover": "Make the file that a crash kept `record` or `execute` from writing.",
    "register": "Find where a part lies from points touched on it.",
    "simulate": "Serve a force/torque sensor and an EC66 arm that share one physics, until Ctrl-C.",
    "calibrate": "Identify what hangs on the sensor from static poses, with nothing touching the tool.",  # noqa: E501
    "touch": "Lead the tip to a point by pendant or hand; Enter takes it, at rest, and q ends.",
    "check": "Connect to robot and sensor, read them and tell; nothing moves.",
    "presets": "Say which presets there are and what they set; or print one.",
    "info": "Tell versions, extras and machine, as the report of a bug needs them.",
}
"""Each subcommand in one sentence; its module of `dmpcli.commands` has its name."""


def module_of(command: str) -> str:
    """Return the module of a subcommand; a word of Python's own cannot be a module's name."""
    return f"dmpcli.commands.{command}" + ("_" if keyword.iskeyword(command) else "")


class LazyCommand(TyperCommand):
    """Stands for a subcommand until it is called or asked; then its module is loaded."""

    def make_context(
        self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any
    ) -> Any:
        """Parse the words after the subcommand's name, by what its module declares.

        Parameters
        ----------
        info_name : str or None
            What usage lines call it.
        args : list of str
            The words; the parser takes them out.
        parent : Context, optional
            Of the program.
        **extra
            Settings of the context.
        """
        name = str(self.name)
        made, words = _made(importlib.import_module(module_of(name)).command, name)
        words[:] = args
        return made.make_context(info_name, args, parent, **{"max_content_width": width()} | extra)


@functools.cache
def _made(command: Callable[..., None], name: str) -> tuple[Any, list[str]]:
    """Return a subcommand with all its options, and where the words that it is called with go.

    To make it takes longer than many a call, and a process may call it often.
    """
    whole = typer.Typer(
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings=CONTEXT,
    )
    words: list[str] = []
    whole.command(name, cls=HelpedCommand)(shared(command, name, words))
    return typer.main.get_command(whole), words


def _show_defect(error: DmpError) -> None:
    """Show the traceback of a defect before what outranks it: an arm that may still move."""
    defect = error.__cause__ if isinstance(error, UnconfirmedStopError) else None
    if isinstance(defect, Exception) and not isinstance(defect, DmpError | typer.Exit):
        import traceback

        traceback.print_exception(defect)


class Group(TyperGroup):
    """Turns a user's mistake into one message and its exit code; a defect keeps its traceback."""

    def __init__(self, **said: Any) -> None:
        super().__init__(**said)
        self.commands = {
            name: LazyCommand(name, help=text, short_help=text) for name, text in COMMANDS.items()
        }

    def make_context(
        self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any
    ) -> Any:
        """Parse the words, with help as wide as the terminal.

        Parameters
        ----------
        info_name : str or None
            What usage lines call the program.
        args : list of str
            The words; the parser takes them out.
        parent : Context, optional
        **extra
            Settings of the context, the width of help among them.
        """
        return super().make_context(
            info_name, args, parent, **{"max_content_width": width()} | extra
        )

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words after the program's name; poses of six words become one value."""
        try:
            return super().parse_args(ctx, joined(args))
        except TyperException as error:
            error.message = printable(error.message)
            raise

    def invoke(self, ctx: Any) -> Any:
        """Run the subcommand."""
        try:
            return super().invoke(ctx)
        except DmpError as error:
            _show_defect(error)
            say(f"dmpcli: {error}")
            sys.exit(error.exit_code)
        except TyperException as error:
            error.message = printable(error.message)
            raise
        except BrokenPipeError:
            sys.exit(128 + signal.SIGPIPE)


app = typer.Typer(
    name="dmpcli",
    cls=Group,
    help="Turn one drag-taught stroke into the same stroke anywhere.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings=CONTEXT,
)


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
    prepare_streams()
    # Before numpy is loaded: with more threads the last bits of a product depend on the number of
    # cores, and these matrices are too small to gain from them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # By default Python ends without cleaning up; half-written files would stay.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    sys.unraisablehook = _send_again
    app()


def _send_again(ignored: Any) -> None:
    """Send a signal once more that came as an object was cleared away: Python ignores it there."""
    if not isinstance(ignored.exc_value, SystemExit | KeyboardInterrupt):
        sys.__unraisablehook__(ignored)
        return
    from threading import Timer

    asked = isinstance(ignored.exc_value, KeyboardInterrupt)
    later = Timer(0.05, os.kill, (os.getpid(), signal.SIGINT if asked else signal.SIGTERM))
    later.daemon = True
    later.start()

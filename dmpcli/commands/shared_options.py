"""What every subcommand takes: ``--log``, ``--json`` and, if it has settings, ``--print-config``.

A command that prints JSON of its own by ``--json`` keeps it. Of any other, the JSON says how it
ended, everything that it told, and what its output file is.
"""

import contextlib
import inspect
import json
import logging
import shlex
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dmpcli.errors import DmpError, InputError, printable
from dmpcli.messages import LOG, logged
from dmpcli.version import __version__

if TYPE_CHECKING:
    from dmpcli.settings.options import Described

Log = Annotated[
    Path | None,
    typer.Option("--log", metavar="FILE", help="Append every message to this file, with its time."),
]
AsJson = Annotated[
    bool,
    typer.Option("--json", help="Print how it ended, what was told and what was written, as JSON."),
]
PrintConfig = Annotated[
    bool,
    typer.Option(
        "--print-config", help="Print every setting and where it comes from; do nothing else."
    ),
]


def shared(command: Callable[..., None], name: str, words: Sequence[str]) -> Callable[..., None]:
    """Return a command that takes the options that all have.

    Parameters
    ----------
    command : callable
        As its module declares it.
    name : str
    words : sequence of str
        Behind its name on the command line, for the log.
    """
    signature = inspect.signature(command)
    parameters = [*signature.parameters.values()]
    own_json = "as_json" in signature.parameters
    describe: Described | None = getattr(command, "described", None)
    if not own_json:
        parameters.append(_parameter("as_json", AsJson, False))
    parameters.append(_parameter("log", Log, None))
    if describe is not None:
        parameters.append(_parameter("print_config", PrintConfig, False))

    def run(**said: Any) -> None:
        log, asked = said.pop("log"), said.pop("print_config", False)
        as_json = said["as_json"] if own_json else said.pop("as_json")
        line = shlex.join(["dmpcli", name, *map(_printed, words)])
        with logged(log, f"{line} (dmpcli {__version__})"):
            if asked and describe is not None:
                _print(describe(name, said, as_json))
            elif as_json and not own_json:
                with _as_json(name, str(said.get("output") or "")):
                    command(**said)
            else:
                command(**said)

    run.__doc__, run.__module__, run.__name__ = command.__doc__, command.__module__, "command"
    run.__dict__.update(__signature__=inspect.Signature(parameters), __wrapped__=command)
    return run


def _printed(word: str) -> str:
    """Return a word of the command line as a log may keep it: without credentials."""
    if "://" not in word:
        return word
    from dmpcli.records.storage import hidden

    return hidden(word)


def _parameter(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
    )


class _Gatherer(logging.Handler):
    """Keeps what is told, and the facts that come with it."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.told: list[dict[str, str]] = []
        self.facts: dict[str, Any] = {}

    def emit(self, record: logging.LogRecord) -> None:
        self.told.append({"level": record.levelname.lower(), "text": record.getMessage()})
        self.facts |= getattr(record, "facts", {})


@contextlib.contextmanager
def _as_json(name: str, output: str) -> Iterator[None]:
    """Print one JSON document at the end, however it comes."""
    if output == "-":
        raise InputError("--json: standard output holds the file; name one with -o")
    gatherer, code, error = _Gatherer(), 1, None
    LOG.addHandler(gatherer)
    try:
        yield
        code = 0
    except DmpError as failure:
        code, error = failure.exit_code, str(failure)
        raise
    except typer.Exit as end:
        code = end.exit_code
        raise
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
        raise
    except BaseException as defect:
        error = f"{type(defect).__name__}: {defect}"
        raise
    finally:
        LOG.removeHandler(gatherer)
        document = {"schema": "outcome", "version": 1, "command": name, "exit_code": code}
        document |= {"error": error, "messages": gatherer.told} | gatherer.facts
        document["output"] = _described(output) if code == 0 else None
        _print(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def _described(output: str) -> Any:
    """Return what ``inspect --json`` says of the output, if it is one file or folder."""
    from dmpcli.records.storage import located

    if not output or not (place := located(output)).exists():
        return None
    from dmpcli.reporting import inspection
    from dmpcli.workflows.inspect import inspect as inspected

    try:
        return json.loads(inspection.as_json(inspected(output)))
    except DmpError:  # a file of another program
        return {"file": output, "bytes": place.stat().st_size}


def _print(text: str) -> None:
    from dmpcli.records import file_io

    file_io.say(printable(text).encode())

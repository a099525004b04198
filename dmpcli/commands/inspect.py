"""``dmpcli inspect``: what a file is."""

from typing import Annotated

import typer

from dmpcli.errors import InputError
from dmpcli.messages import on_terminal
from dmpcli.settings.options import choice, with_options
from dmpcli.settings.recording import RecordingOptions

_WIDTH = 80


@with_options
def command(
    *,
    file: Annotated[
        str | None,
        typer.Argument(
            metavar="FILE",
            help="A file of ours, a mesh, or a CSV or Parquet from elsewhere, of s3:// too; - is "
            "standard input.",
            show_default=False,
        ),
    ] = None,
    schema: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Print the JSON Schema of skill, plane, cylinder, sphere or tool files instead.",
            autocompletion=choice(
                "skill", "plane", "cylinder", "sphere", "tool", "pose", "manifest"
            ),
        ),
    ] = None,
    skill: Annotated[
        str | None,
        typer.Option(
            "--for",
            metavar="FILE",
            help="With a mesh: the skill to be drawn on it; propose places where generalize does.",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    form: RecordingOptions,
) -> None:
    """Say what a file is: schema, columns, units, ranges, provenance; how fit reads it."""
    on_terminal(quiet=False)
    from dmpcli.records import file_io
    from dmpcli.reporting import inspection

    if schema is not None:
        file_io.say(inspection.json_schema(schema))
        return
    if file is None:
        raise InputError("FILE is missing: name a file, or - for standard input")
    from dmpcli.records.storage import located
    from dmpcli.workflows.inspect import inspect

    learned = None if skill is None else located(skill)
    found = inspect(file, form.as_layout(), form.as_words(), learned)
    text = inspection.as_json(found) if as_json else inspection.as_text(found, _WIDTH).encode()
    file_io.say(text)

"""``dmpcli inspect``: what a file is."""

from typing import Annotated

import typer

from dmpcli.errors import InputError

_WIDTH = 100


def command(
    file: Annotated[
        str | None,
        typer.Argument(
            metavar="FILE",
            help="Any file of ours, or a CSV or Parquet from elsewhere; - is standard input.",
            show_default=False,
        ),
    ] = None,
    schema: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Print the JSON Schema of skill or plane files instead."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Say what a file is: schema, columns, units, ranges, provenance."""
    import sys

    from dmpcli.figures import inspection
    from dmpcli.records import streams

    if schema is not None:
        sys.stdout.buffer.write(inspection.json_schema(schema))
        return
    if file is None:
        raise InputError("FILE is missing: name a file, or - for standard input")
    found = inspection.inspected(streams.read(file))
    if as_json:
        sys.stdout.buffer.write(inspection.as_json(found))
    else:
        sys.stdout.buffer.write(inspection.as_text(found, _WIDTH).encode())

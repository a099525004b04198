"""``dmpcli info``: what the report of a bug needs."""

import json
from typing import Annotated

import typer

from dmpcli.messages import on_terminal


def command(
    *, as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False
) -> None:
    """Tell versions, extras and machine, as the report of a bug needs them."""
    on_terminal(quiet=False)
    from dmpcli.records import file_io
    from dmpcli.workflows.info import as_text, info

    found = info()
    text = json.dumps(found, indent=2, ensure_ascii=False) + "\n" if as_json else as_text(found)
    file_io.say(text.encode())

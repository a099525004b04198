"""``dmpcli presets``: which sets of settings come with the program."""

import json
import tomllib
from typing import Annotated, Any

import typer

from dmpcli.messages import on_terminal
from dmpcli.settings.layers import preset_names, preset_text
from dmpcli.settings.options import choice


def command(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="Print this one as the TOML file that it is, to begin one of your own.",
            show_default=False,
            autocompletion=lambda incomplete: choice(*preset_names())(incomplete),
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Say which presets there are and what they set; or print one."""
    on_terminal(quiet=False)
    from dmpcli.records import file_io

    if name is not None and not as_json:
        file_io.say(preset_text(name).encode())
        return
    found = {one: described(one) for one in ([name] if name else preset_names())}
    if as_json:
        file_io.say((json.dumps(found, indent=2, ensure_ascii=False) + "\n").encode())
        return
    lines: list[str] = []
    for one, content in found.items():
        lines.append(f"{one}: {content['words']}")
        for section, values in content["sections"].items():
            keys = ", ".join(values) or "nothing: the defaults hold"
            lines.append(f"  [{section}] {keys}")
    lines.append("dmpcli presets NAME prints one; --preset takes a name or a file like it.")
    file_io.say(("\n".join(lines) + "\n").encode())


def described(name: str) -> dict[str, Any]:
    """Return what a preset is for, in its own words, and what its sections set.

    Parameters
    ----------
    name : str

    Raises
    ------
    InputError
        There is none of that name.
    """
    text = preset_text(name)
    comment = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        comment.append(line.removeprefix("#").strip())
    content = tomllib.loads(text)
    sections = {key: values for key, values in content.items() if key != "units"}
    return {"words": " ".join(comment), "units": content["units"], "sections": sections}

"""Write the reference pages of docs/ from the program: commands, presets, files.

    python -m tools.reference

A test holds the pages against it.
"""

import json
from pathlib import Path
from typing import Any

import typer

from dmpcli import cli
from dmpcli.commands.examples import EXAMPLES
from dmpcli.commands.presets import described
from dmpcli.records import json_schema, schemas
from dmpcli.settings.layers import preset_names, preset_text

FOLDER = Path(__file__).parents[1] / "docs" / "reference"
MADE = "<!-- made by tools/reference.py: make reference -->\n"


def pages() -> dict[str, str]:
    """Return each page by its file's name."""
    return {"commands.md": commands(), "presets.md": presets(), "files.md": files()}


def commands() -> str:
    """Every subcommand: its arguments, options with default and unit, and examples."""
    lines = [MADE, "# Commands\n"]
    lines.append(
        "What `dmpcli COMMAND --help` says. A form in capitals is a unit (`MM`, `RAD/S^2`) or what "
        "is to be named (`FILE`, `URL`); NUMBER has no unit, INTEGER is a count. Exit codes: "
        "[README](../../README.md#exit-codes).\n"
    )
    group: Any = typer.main.get_command(cli.app)
    for name, words in cli.COMMANDS.items():
        context = group.commands[name].make_context(name, [], resilient_parsing=True)
        command = context.command
        arguments = [one for one in command.params if one.param_type_name == "argument"]
        options = [one for one in command.params if one.param_type_name == "option"]
        named = " ".join(one.metavar or one.name.upper() for one in arguments)
        lines += [f"## {name}\n", f"{words}\n", f"`dmpcli {name} {named} [OPTIONS]`\n"]
        more = (command.help or "").partition("\n\n")[2].replace("\n", " ").strip()
        if more:
            lines.append(f"{more}\n")
        lines += ["| | what | default |", "| --- | --- | --- |"]
        for one in arguments:
            lines.append(f"| `{one.metavar or one.name.upper()}` | {_cell(one.help)} | needed |")
        for one in options:
            form, text = one.get_help_record(context)
            what, _, default = text.partition("  [")
            default = default.removeprefix("default: ").removesuffix("]")
            said = "needed" if default == "required" else default
            lines.append(f"| `{_cell(form)}` | {_cell(what)} | {_cell(said)} |")
        lines.append("\n```sh")
        for example in EXAMPLES[name]:
            lines += [f"# {example.words}", example.line]
        lines.append("```\n")
    return "\n".join(lines)


def presets() -> str:
    """Every preset as the file that it is."""
    lines = [MADE, "# Presets\n"]
    lines.append(
        "`--preset NAME` takes one of these, or a file of their form; `dmpcli presets` lists them. "
        "Options beat `--config FILE`, which beats the preset, which beats the defaults; "
        "`--print-config` says of every setting which of them it comes from.\n"
    )
    for name in preset_names():
        words = described(name)["words"]
        lines += [f"## {name}\n", f"{words}\n", "```toml", preset_text(name).rstrip(), "```\n"]
    return "\n".join(lines)


def files() -> str:
    """The columns of every Parquet file and the fields of every JSON file."""
    lines = [MADE, "# Files\n"]
    lines.append(
        f"Lengths in mm, angles in rad, time in s, in the robot's base frame; Euler angles are "
        f"{schemas.EULER}. Parquet fields carry their unit in their metadata, files their schema, "
        "options and the SHA-256 of their inputs. What other programs read and write: "
        "[formats](../formats.md).\n"
    )
    for schema in schemas.SCHEMAS.values():
        lines += [f"## {schema.name} (Parquet, version {schema.version})\n"]
        lines += [f"{schema.meaning[0].upper()}{schema.meaning[1:]}.\n"]
        lines += ["| column | unit | type | needed | what |", "| --- | --- | --- | --- | --- |"]
        for name, column in schema.columns.items():
            needed = "yes" if column.required else ""
            row = (f"`{name}`", column.unit, column.type, needed, column.meaning)
            lines.append(f"| {' | '.join(row)} |")
        lines.append("")
    for name in json_schema.FILES:
        lines += _json_file(name)
    return "\n".join(lines)


def _json_file(name: str) -> list[str]:
    whole = json.loads(json_schema.text(name))
    lines = [f"## {name} (JSON)\n"]
    if whole.get("description"):
        lines.append(" ".join(whole["description"].split("\n\n")[0].split()) + "\n")
    lines.append(f"`dmpcli inspect --schema {name}` prints the whole schema.\n")
    lines += ["| field | type | needed | what |", "| --- | --- | --- | --- |"]
    for field, about in whole.get("properties", {}).items():
        needed = "yes" if field in whole.get("required", ()) else ""
        what = _cell(about.get("description"))
        lines.append(f"| `{field}` | {_cell(_type(about))} | {needed} | {what} |")
    return [*lines, ""]


def _type(about: dict[str, Any]) -> str:
    if "const" in about:
        return f"`{about['const']}`"
    if "$ref" in about:
        return str(about["$ref"]).rpartition("/")[2]
    if "enum" in about:
        return ", ".join(f"`{one}`" for one in about["enum"])
    if "anyOf" in about:
        return " or ".join(_type(one) for one in about["anyOf"])
    kind = str(about.get("type", ""))
    if kind == "array" and "items" in about:
        return f"list of {_type(about['items'])}"
    return kind


def _cell(text: str | None) -> str:
    return " ".join(str(text or "").replace("|", "\\|").split())


def main() -> None:
    """Write the pages."""
    FOLDER.mkdir(exist_ok=True)
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

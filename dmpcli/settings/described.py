"""Every setting of a command with its value, its unit and where it comes from.

As TOML it is a file that ``--config`` takes; what no file can say is a comment in it.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dmpcli.settings.layers import UNITS, origins, resolve
from dmpcli.settings.model import Setting, Settings, number, settings_of

Model = tuple[type[Settings], *tuple[Any, ...]]
"""A settings model and what `resolve` takes beside it."""


Row = dict[str, Any]
"""A setting: its section ("" of one that no file can say), key, value, unit, source, and what holds
where it is not set."""


def text(command: str, models: Sequence[Model], as_json: bool, others: Sequence[Row] = ()) -> str:
    """Return all settings as one text.

    Parameters
    ----------
    command : str
        The subcommand.
    models : sequence
        Its settings models, each with its layers.
    as_json : bool
        Else TOML.
    others : sequence of dict
        What no model holds: files, instruments, switches.

    Raises
    ------
    InputError
        As `resolve`.
    """
    rows = [row for kind, *layers in models for row in _rows(kind, layers)]
    rows = sorted([*rows, *others], key=lambda row: not row["section"])
    if as_json:
        document = {"schema": "settings", "version": 1, "command": command, "settings": rows}
        return json.dumps(document, indent=2, ensure_ascii=False) + "\n"
    read = any(row["section"] for row in rows)
    lines = [f"# dmpcli {command}: every setting, and where it comes from"]
    lines[0] += "; --config reads this." if read else "."
    if read:
        lines += ["[units]", *(f'{what} = "{unit}"' for what, unit in UNITS.items())]
    section = None
    for row in rows:
        if row["section"] != section:
            section = row["section"]
            lines += ["", f"[{section}]" if section else "# Of the command line alone:"]
        beside = "; ".join(part for part in (row["unit"], row["source"]) if part)
        if row["value"] is None:
            said = f": {row['unset']}" if row["unset"] else ""
            lines.append(f"# {row['key']} is not set{said}  # {beside}")
            continue
        comment = "" if section else "# "
        lines.append(f"{comment}{row['key']} = {_toml(row['value'])}  # {beside}")
    return "\n".join(lines) + "\n"


def _rows(kind: type[Settings], layers: Sequence[Any]) -> list[Row]:
    values = resolve(kind, *layers).as_options()
    all_values = {one.name: getattr(resolve(kind, *layers), one.name) for one in settings_of(kind)}
    values = {name: values.get(name, all_values[name]) for name in all_values}
    source = origins(kind, *layers)
    return [
        {
            "section": kind.section,
            "key": one.name if kind.section else one.flag,
            "value": plain(values[one.name]),
            "unit": _unit(one),
            "source": source[one.name],
            "unset": one.shown_default if values[one.name] in (None, ()) else "",
        }
        for one in settings_of(kind)
    ]


def _unit(setting: Setting) -> str:
    """Return the unit of the field: an option in degrees stands for one in rad."""
    if setting.option is None:
        return ""
    return "rad" if setting.option.factor != 1.0 else setting.option.unit


def plain(value: Any) -> Any:
    """Return a value as JSON and TOML have it; an empty list is None."""
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, tuple | list):
        return [plain(one) for one in value] or None
    return value


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, float):
        shown = number(value) if float(number(value)) == value else repr(value)
        return shown if set(shown) & set(".en") else f"{shown}.0"
    return json.dumps(value, ensure_ascii=False)

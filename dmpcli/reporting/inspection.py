"""What a file is: schema, columns, units, ranges, provenance; and what a foreign one could be."""

import json
import math
import textwrap
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from dmpcli.arrays import Floats
from dmpcli.errors import InputError, counted, printable
from dmpcli.records import (
    json_files,
    layouts,
    mesh,
    mesh_formats,
    pose,
    record,
    recordings,
    schemas,
    skill,
    surface,
    tolerance_mark,
    tool,
)
from dmpcli.records import json_schema as publish
from dmpcli.records import tables as records_tables
from dmpcli.records.file_io import Source
from dmpcli.records.trajectory_reader import rows_by_id, stored
from dmpcli.reporting import recording_summary, skill_words, tables, typed
from dmpcli.reporting.stroke_measures import Row

NAME, VERSION = "inspection", 1

_GUESSES = {
    "t": ("t", "time", "timestamp", "t_s", "time_s", "seconds"),
    "x": ("x", "x_mm", "px", "pos_x", "actual_tcp_pose_0"),
    "y": ("y", "y_mm", "py", "pos_y", "actual_tcp_pose_1"),
    "z": ("z", "z_mm", "pz", "pos_z", "actual_tcp_pose_2"),
}
"""Names under which other programs store what `fit` needs; compared without case."""


def inspected(source: Source, layout: layouts.Layout | None = None, options: str = "") -> Row:
    """Describe one file.

    Parameters
    ----------
    source : Source
    layout : Layout, optional
        How a recording of another program is read.
    options : str
        That say it, as they are typed.

    Returns
    -------
    dict
        ``file, sha256, bytes, format, ours, schema, version, summary`` and, where it has them,
        ``rows, duration, rate, strokes, columns, provenance, content, mapping, recording``.

    Raises
    ------
    InputError
        Damaged, of a newer version, or neither Parquet nor text; a skill or surface with a wrong
        field; a mesh that is not safe to mend.
    """
    content = source.content
    head: Row = {"file": Path(source.name).name, "sha256": source.sha256, "bytes": len(content)}
    if record.is_ours(source):
        return head | {"format": "Parquet"} | _ours(source)
    if records_tables.is_parquet(source):
        return head | {"format": "Parquet"} | _foreign(source, layout, options)
    if content.lstrip()[:1] == b"{" and not mesh_formats.is_gltf(source):
        return head | {"format": "JSON"} | _json(source)
    if source.name.endswith(".toml"):
        return head | {"format": "TOML"} | _toml(source)
    kind = mesh_formats.format_of(source)
    if kind is not None:
        return head | {"format": kind} | _mesh(source)
    return head | {"format": "CSV"} | _foreign(source, layout, options)


def as_json(found: Row) -> bytes:
    """Return the description as a JSON file."""
    document = {"schema": NAME, "version": VERSION} | {"found": found}
    text = json.dumps(_finite(document), indent=2, ensure_ascii=False, allow_nan=False)
    return (printable(text) + "\n").encode()


def _finite(value: Any) -> Any:
    """Return a value for JSON, which has no word for what is not finite."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def as_text(found: Row, width: int) -> str:
    """Return the description for people, without terminal codes."""
    kind = f"{found['schema']}, version {found['version']}" if found["ours"] else "not dmpcli's"
    lines: list[Table | str] = [f"{found['file']}: {found['format']}, {kind}", found["summary"]]
    if "rows" in found:
        lines.append(_extent(found))
    for line in found.get("told", ()):
        lines += typed.wrapped(line, width) if typed.is_typed(line) else [line]
    if found.get("mark"):
        lines += textwrap.wrap(tolerance_mark.text(found["file"], found["mark"]), width)
    said = {key: value for key, value in found.get("provenance", {}).items() if value}
    said |= {"sha256": found["sha256"]} | found.get("content", {})
    wide = min(max(len(key) for key in said), _WIDEST)
    for key, value in said.items():
        text, indent = f"{key:<{wide}}  {_flat(value)}", " " * (wide + 2)
        lines += textwrap.wrap(text, width, subsequent_indent=indent, break_on_hyphens=False)
    if found.get("columns"):
        lines += ["", _columns(found["columns"])]
    if "recording" in found:
        lines += ["", *recording_summary.lines(found["recording"], width)]
    if "mapping" in found and "refused" in found["recording"] and "advice" not in found:
        advice = _advice(found)
        lines += textwrap.wrap(advice, width) if _AS_IT_IS not in advice else []
    return tables.plain(lines, width)


def _ours(source: Source) -> Row:
    found = record.decode(source)
    if found.schema is schemas.TRAJECTORY:
        for name, rows in rows_by_id(found.columns["id"]).items():
            stored(found, name, rows)  # what could not be drawn is not described as if it could
    columns = []
    for name, values in found.columns.items():
        column = found.schema.columns[name]
        is_number = values.dtype.kind in "fi"
        numbers = np.array(values, dtype=float) if is_number else np.full(len(values), np.nan)
        if values.dtype.kind == "i":
            # The reader's stand-in for a missing count.
            numbers = np.where(numbers < 0, np.nan, numbers)
        columns.append(_column(name, numbers) | {"unit": column.unit, "meaning": column.meaning})
    p = found.provenance
    return {
        "ours": True,
        "schema": found.schema.name,
        "version": found.schema.version_of(found.columns),
        "summary": f"{found.schema.meaning[0].upper()}{found.schema.meaning[1:]}.",
        "mark": tolerance_mark.of_facts(p.facts),
        "rows": len(found),
        **_timing(found),
        **_recorded(source, found),
        "columns": columns,
        "provenance": {
            "tool": p.tool,
            "command": p.command,
            "options": p.options,
            "inputs": list(p.inputs),
            "facts": p.facts,
            "frame": schemas.FRAME,
            "euler": schemas.EULER,
        },
    }


def _recorded(source: Source, found: record.Record) -> Row:
    """Describe a demonstration as its readers see it."""
    if found.schema is not schemas.DEMONSTRATION:
        return {}
    return {"recording": recording_summary.summary(source, None, "")}


def _timing(found: record.Record) -> Row:
    """Duration, rate and number of strokes, where there is time."""
    if "t" not in found.columns:
        return {}
    t = found.t
    # A run has no id between its strokes.
    names = {name for name in found.columns.get("id", ()) if name is not None}
    steps = np.diff(t)
    steps = steps[steps > 0.0]
    # The mean: the steps of a recording over the wire are not alike.
    timing: Row = {"rate": float(len(steps) / steps.sum()) if len(steps) else None}
    if len(names) <= 1 or found.schema is schemas.RUN:
        timing["duration"] = float(t[-1] - t[0])
    if len(names) > 1:
        timing["strokes"] = len(names)
    return timing


def _json(source: Source) -> Row:
    content = json_files.json_document(source)
    name, version = content.get("schema"), content.get("version")
    if name == skill.SCHEMA:
        return _skill(source, content)
    if name is None and _by_hand(source, content):
        name, version = surface.kind_of(content), content.get("version", 1)
    if not isinstance(name, str):
        name = None
    if name in _READERS:
        _READERS[name](source)
    ours = name in _MEANINGS
    return {
        "ours": ours,
        "schema": name if ours else None,
        "version": version if ours else None,
        "summary": _MEANINGS[str(name)] if ours else "A JSON file from elsewhere.",
        "content": {k: v for k, v in content.items() if k not in ("schema", "version")},
    }


def _skill(source: Source, content: dict[str, Any]) -> Row:
    """Describe a skill: what it keeps, what it was taught on, and its mark."""
    _, file = skill.decode(source)
    facts = {k: v for k, v in content.items() if k not in ("schema", "version")}
    return {
        "ours": True,
        "schema": skill.SCHEMA,
        "version": content["version"],
        "summary": _MEANINGS["skill"],
        "told": skill_words.lines(file),
        "mark": tolerance_mark.of_file(file),
        "content": facts,
    }


def _by_hand(source: Source, content: dict[str, Any]) -> bool:
    """Tell whether it is a surface that people wrote, without a schema."""
    kind = surface.kind_of(content)
    if kind is None:
        return False
    try:
        surface.DECODERS[kind](source)
    except InputError:
        return False
    return True


_READERS: dict[Any, Callable[[Source], object]] = {
    **surface.DECODERS,
    "tool": tool.geometry,
    "pose": pose.decode,
}
"""Their readers name what is wrong with a damaged file."""

_MEANINGS = {
    "skill": "What fit learned of a stroke, all that generalize needs.",
    "plane": "A plane in the robot's base frame, mm.",
    "cylinder": "An endless cylinder in the robot's base frame, mm.",
    "sphere": "A sphere in the robot's base frame, mm.",
    "tool": "Where the tool's tip and the sensor sit on the flange, and the payload.",
    "pose": "Where a part's own frame lies in the robot's base frame.",
    "report": "What report measured.",
    "inspection": "What inspect found in a file.",
}


def _toml(source: Source) -> Row:
    try:
        content = tomllib.loads(source.content.decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{source.name}: is not TOML: {error}") from None
    sections = [key for key, value in content.items() if isinstance(value, dict)]
    ours = "units" in sections and len(sections) > 1
    return {
        "ours": ours,
        "schema": "preset" if ours else None,
        "version": 1 if ours else None,
        "summary": "Settings of " + ", ".join(s for s in sections if s != "units") + "."
        if ours
        else "A TOML file from elsewhere: a preset has [units].",
        "content": {
            f"[{section}] {key}": value
            for section in sections
            for key, value in content[section].items()
        },
    }


def _mesh(source: Source) -> Row:
    content = mesh.description(source)
    unit = content["likely_unit"]
    guess = f"its size suggests {unit}" if unit else "its size suggests none"
    return {
        "ours": False,
        "schema": None,
        "version": None,
        "summary": f"A triangle mesh, to draw on with --surface. It does not tell its unit: {guess}"
        "; lengths below are in its own.",
        "told": [f"room: {one}" for one in content["room"]],
        "content": {key: value for key, value in content.items() if key != "room"},
    }


def _foreign(source: Source, layout: layouts.Layout | None, options: str) -> Row:
    advice, table = None, None
    try:
        export = recordings.export_of(source)
        table = records_tables.read(source, decimal=None) if export is None else export[1]
    except records_tables.HeadlessError as error:
        advice = str(error).partition(": ")[2]
        try:
            recordings.read(source)
        except InputError as refused:
            # The reader of recordings knows which option names the columns.
            advice = str(refused).partition(": ")[2]
        unnamed = [f"column {i}" for i in range(1, error.count + 1)]
        table = records_tables.read(source, unnamed, None)
    names = list(table.columns)
    return {
        "ours": False,
        "schema": None,
        "version": None,
        "summary": "A table from elsewhere.",
        "rows": len(table),
        "columns": [_column(name, table.floats(name)) for name in names],
        "mapping": _mapping(names),
        "layouts": layouts.suited(names),
        "recording": recording_summary.summary(source, layout, options),
    } | ({} if advice is None else {"advice": advice})


def _column(name: str, values: Floats) -> Row:
    present = values[np.isfinite(values)]
    return {
        "name": name,
        "missing": len(values) - len(present),
        "text": len(present) == 0 and len(values) > 0,
        "least": float(present.min()) if len(present) else None,
        "largest": float(present.max()) if len(present) else None,
    }


def _mapping(names: Sequence[str]) -> dict[str, str | None]:
    """Guess which column holds t, x, y and z."""
    lower = {name.lower(): name for name in reversed(names)}
    suits = layouts.suited(names)
    known = layouts.LAYOUTS[suits[0]] if suits else layouts.Layout()
    mapping: dict[str, str | None] = {}
    for wanted, guesses in _GUESSES.items():
        guessed = next((lower[guess] for guess in guesses if guess in lower), None)
        try:
            column = layouts.found(known, names, wanted)
        except InputError:
            column = None
        mapping[wanted] = guessed if column is None else column.name
    return mapping


def _extent(found: Row) -> str:
    text = counted(found["rows"], "row")
    if found.get("strokes"):
        text += f", {found['strokes']} strokes"
    if found.get("duration") is not None:
        text += f", {found['duration']:.3f} s"
    if found.get("rate"):
        text += f" at {found['rate']:.6g} Hz"
    return text


_WIDEST = 40
"""Characters of a key that values are indented by: a longer one would leave them no room."""

LISTED = 500
"""Columns that the description for people lists; the other form has all."""


def _columns(columns: Sequence[Row]) -> Table:
    table = Table(box=None, pad_edge=False)
    for title, justify in (
        ("column", "left"),
        ("unit", "left"),
        ("least", "right"),
        ("largest", "right"),
        ("missing", "right"),
        ("meaning", "left"),
    ):
        table.add_column(title, justify=justify)  # type: ignore[arg-type]
    for column in columns[:LISTED]:
        table.add_row(
            column["name"],
            column.get("unit", ""),
            *(_number(column[k]) for k in ("least", "largest")),
            "-" if column["text"] else str(column["missing"]),
            column.get("meaning", ""),
        )
    if len(columns) > LISTED:
        table.add_row(f"and {len(columns) - LISTED} more", "", "", "", "", "")
    return table


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"


_AS_IT_IS = "fit reads it as it is"


def _advice(found: Row) -> str:
    mapping, suits = found["mapping"], found["layouts"]
    if "advice" in found:
        return f"fit and report need names: {found['advice']}."
    if suits:
        ways = " or ".join(f"--layout {name}" for name in suits)
        return f"fit and report could read it with {ways}."
    missing = [wanted for wanted, name in mapping.items() if name is None]
    if missing == ["t"]:
        return (
            "fit needs t, x, y and z; no column looks like t: say which with --map t=COLUMN, or "
            "the rate of the rows with --sample-rate HZ"
        )
    if missing:
        return (
            f"fit needs t, x, y and z; no column looks like {', '.join(missing)}: "
            "say which with --map, as in --map t=COLUMN"
        )
    if all(layouts.parted(name)[0] == wanted for wanted, name in mapping.items()):
        told = all(layouts.parted(name)[1] for name in mapping.values())
        return f"{_AS_IT_IS}{'' if told else ', if lengths are in mm and times in s'}."
    how = " ".join(f"--map {wanted}={name}" for wanted, name in mapping.items() if name != wanted)
    return f"fit could read it with {how}; it also takes --length-unit and --time-unit."


def _flat(value: Any) -> str:
    if isinstance(value, dict):
        return "  ".join(
            f"{key}=({_flat(item)})" if isinstance(item, dict) else f"{key}={_flat(item)}"
            for key, item in value.items()
        )
    if isinstance(value, list):
        nested: list[Any] = [x for x in value if isinstance(x, list)]
        nested += [y for x in value if isinstance(x, dict) for y in x.values()]
        if len(value) > 6 or any(isinstance(item, list | dict) for item in nested):
            return f"{_size(value)} values"
        if value and isinstance(value[0], dict):
            return "; ".join(_flat(item) for item in value)
        return "[" + ", ".join(_flat(item) for item in value) + "]"
    if isinstance(value, float):
        return f"{value:.6g}"
    return "-" if value is None else str(value)


def _size(value: Any) -> str:
    sizes = []
    while isinstance(value, list):
        sizes.append(str(len(value)))
        value = value[0] if value else None
    return " x ".join(sizes)


def json_schema(name: str) -> bytes:
    """Return the published JSON Schema of one of our JSON files.

    Raises
    ------
    InputError
        There is none of that name.
    """
    if name not in publish.FILES:
        raise InputError(f"--schema {name}: no such schema; there are {', '.join(publish.FILES)}")
    return publish.text(name).encode()

"""Settings of a command: options beat ``--config``, which beats the preset, which beats defaults.

A preset is one TOML file with a section per command (``[record]``, ``[fit]``, ...) and a
``[units]`` section that states the units its author had in mind; units other than the program's
are refused by name. Presets that come with the program are addressed by name.
"""

import difflib
import tomllib
from collections.abc import Mapping
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from dmpcli.errors import InputError
from dmpcli.settings.model import Settings, number, settings_of

if TYPE_CHECKING:
    from pydantic import TypeAdapter, ValidationError

LARGEST = 2**18
"""Bytes of a file of settings; ours have one or two thousand."""

_DEEPEST = 64

UNITS = {"length": "mm", "angle": "rad", "time": "s", "force": "N", "torque": "N·m"}


S = TypeVar("S", bound=Settings)


def resolve(
    kind: type[S],
    options: Mapping[str, Any],
    preset: str | None = None,
    config: Path | None = None,
) -> S:
    """Merge preset, configuration file and command-line options, and check the result.

    Parameters
    ----------
    kind : type
        The settings model; its defaults hold where nothing else is said.
    options : mapping
        Command-line options by field name; None means not given.
    preset : str, optional
        Name of a preset of ours, or a path that ends in ``.toml``.
    config : Path, optional
        A TOML file of the same form.

    Raises
    ------
    InputError
        A file is missing or is not TOML, states other units, lacks the section, names an unknown
        key, or a value is of the wrong type, out of range, NaN or infinite.
    """
    from pydantic import ValidationError

    merged, origin = _layered(kind, preset, config)
    given = {key: value for key, value in options.items() if value is not None}
    try:
        checked: S = _adapter(kind).validate_python(merged | given)  # type: ignore[arg-type]
    except ValidationError as error:
        raise InputError(_first(error, kind, given, origin)) from None
    return checked


def origins(
    kind: type[Settings],
    options: Mapping[str, Any],
    preset: str | None = None,
    config: Path | None = None,
) -> dict[str, str]:
    """Return where each setting comes from, by name: an option, a file, a preset, the default.

    Parameters
    ----------
    kind : type
        The settings model.
    options : mapping
        Command-line options by field name; None means not given.
    preset : str, optional
    config : Path, optional
        As `resolve` takes them; of the two, the file counts.

    Raises
    ------
    InputError
        A file as in `resolve`; values are not judged here.
    """
    _, origin = _layered(kind, preset, config)
    found = {one.name: origin.get(one.name, "default") for one in settings_of(kind)}
    flags = {one.name: one.flag for one in settings_of(kind)}
    given = {key: f"option {flags[key]}" for key, value in options.items() if value is not None}
    return found | given


def _layered(
    kind: type[Settings], preset: str | None, config: Path | None
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return what preset and file say, and which of them says it."""
    merged: dict[str, Any] = {}
    origin: dict[str, str] = {}
    for label, values in (
        *([_preset(preset, kind.section)] if preset else []),
        *([_toml_section(str(config), _read(config), kind.section)] if config else []),
    ):
        merged |= values
        origin |= dict.fromkeys(values, label)
    return merged, origin


@lru_cache
def _adapter(kind: Any) -> "TypeAdapter[Any]":
    from pydantic import TypeAdapter

    return TypeAdapter(kind)


def preset_names() -> list[str]:
    """Names of the presets that come with the program."""
    names = [file.name for file in (resources.files("dmpcli") / "presets").iterdir()]
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml"))


def _preset(name: str, section: str) -> tuple[str, dict[str, Any]]:
    if name.endswith(".toml"):
        return _toml_section(name, _read(Path(name)), section)
    if name not in preset_names():
        raise InputError(
            f"--preset {name}: no such preset; there are {', '.join(preset_names())}, "
            "or give a file that ends in .toml"
        )
    return _toml_section(f"preset {name}", preset_text(name), section)


def preset_text(name: str) -> str:
    """Return a preset of ours as the TOML file that it is.

    Raises
    ------
    InputError
        There is none of that name.
    """
    if name not in preset_names():
        raise InputError(f"{name}: no such preset; there are {', '.join(preset_names())}")
    return (resources.files("dmpcli") / "presets" / f"{name}.toml").read_text(encoding="utf-8")


def _read(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            content = stream.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise InputError(f"{path}: is larger than {LARGEST} bytes, and no file of settings")
        return content.decode("utf-8").replace("\r\n", "\n")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the name") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as text: {error}") from None


def _parsed(label: str, text: str) -> dict[str, Any]:
    """Parse TOML; whatever its parser meets is an error of the file."""
    # A key of n parts takes it n² steps.
    deep = next((n for n, x in enumerate(text.split("\n"), 1) if x.count(".") > _DEEPEST), None)
    if deep is not None:
        raise InputError(f"{label}: line {deep}: has more than {_DEEPEST} points; split the line")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{label}: is not TOML of ours: it is nested too deep") from None
    # TOMLDecodeError, and what int or datetime say of numbers and dates beyond their bounds.
    except (ValueError, OverflowError, TypeError, LookupError, AttributeError) as error:
        raise InputError(f"{label}: is not TOML: {error}") from None


def _toml_section(label: str, text: str, section: str) -> tuple[str, dict[str, Any]]:
    document = _parsed(label, text)
    units = document.get("units", {})
    for quantity, unit in units.items() if isinstance(units, dict) else [("units", units)]:
        if UNITS.get(quantity) != unit:
            raise InputError(
                f"{label}: [units] {quantity} = {unit!r}: this program's are "
                + ", ".join(f"{q} in {u}" for q, u in UNITS.items())
            )
    if section not in document:
        raise InputError(
            f"{label}: has no [{section}] section; it has "
            + ", ".join(f"[{name}]" for name in document)
        )
    if not isinstance(document[section], dict):
        raise InputError(f"{label}: {section} is not a section; write [{section}]")
    return label, dict(document[section])


def _first(
    error: "ValidationError",
    kind: type[Settings],
    options: Mapping[str, Any],
    origin: Mapping[str, str],
) -> str:
    """One line for the first thing wrong, naming where it was said."""
    detail = error.errors()[0]
    message = detail["msg"].removeprefix("Value error, ")
    message = message[:1].lower() + message[1:]
    if not detail["loc"]:  # settings that fit their ranges but not each other
        return f"[{kind.section}] {message}" if kind.section else message
    first, *rest = detail["loc"]
    if first in options:
        return _of_option(kind, str(first), detail["input"], message)
    where, shown = origin.get(str(first), "defaults"), f"[{kind.section}] {first}"
    if detail["type"] == "missing":
        if rest:
            return f"{where}: {shown}: has too few entries, [{rest[0]}] is missing"
        return f"{shown}: is not set; give a preset that sets it"
    # Of a choice between types pydantic also names the type that it tried.
    shown = f"{where}: {shown}" + "".join(f"[{part}]" for part in rest if isinstance(part, int))
    if detail["type"] == "unexpected_keyword_argument":
        return f"{shown}: no such setting"
    return f"{shown} = {detail['input']!r}: {message}"


def _of_option(kind: type[Settings], name: str, value: Any, message: str) -> str:
    """Say what an option must be; one that is also a TOML key as it would be written there."""
    setting = next((one for one in settings_of(kind) if one.name == name), None)
    if setting is None:  # the command line has refused it before; a keyword comes so far
        near = difflib.get_close_matches(name, [one.name for one in settings_of(kind)], 1)
        return f"{name}: no such option" + "".join(f"; did you mean {one}?" for one in near)
    if setting.option is not None and setting.option.factor != 1.0:
        value /= setting.option.factor
    shown = number(value) if isinstance(value, float) else value
    given = f" = {value!r}" if kind.section else f" {shown}"
    return f"{setting.flag}{given}: " + (f"must be {setting.range}" if setting.range else message)

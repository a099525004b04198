"""The command line of a command, from its own parameters and those of its settings models.

A parameter whose type is a `Settings` model stands for an option per field::

    @with_options
    def command(*, output: Output, settings: FitSettings, given: Given) -> None:

`settings` comes checked, from options, ``--config`` and ``--preset`` (which are options too, where
the model has a TOML section); `given` holds what the command line itself says, by field name.
"""

import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, NewType, Protocol, get_args, get_origin

import typer

from dmpcli.settings.layers import preset_names, resolve
from dmpcli.settings.model import Setting, Settings, settings_of


class Described(Protocol):
    """Says every setting of a command and where it comes from, as TOML or JSON."""

    def __call__(
        self, name: str, said: dict[str, Any], as_json: bool, others: Sequence[dict[str, Any]]
    ) -> str:
        """Return the text.

        Parameters
        ----------
        name : str
            Of the command.
        said : dict
            What the command line says, by parameter.
        as_json : bool
        others : sequence of dict
            As `described.text` has them, of what is no setting of a model.
        """


Given = NewType("Given", dict[str, Any])
"""What the command line itself says of the settings, by field name."""


class Only:
    """Names of the fields that are options of this command, where not all of a model are.

    Parameters
    ----------
    *names : str
    """

    def __init__(self, *names: str) -> None:
        self.names = names


def with_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command as Typer takes it: models made options, and options made models."""
    models: dict[str, type[Settings]] = {}
    options: dict[str, Setting] = {}
    parameters: list[inspect.Parameter] = []
    section: type[Settings] | None = None
    wants_given = ""
    for parameter in inspect.signature(command).parameters.values():
        kind, only = _opened(parameter.annotation)
        if kind is Given:
            wants_given = parameter.name
        elif isinstance(kind, type) and issubclass(kind, Settings):
            models[parameter.name] = kind
            shown = [
                one
                for one in settings_of(kind)
                if one.option is not None and (only is None or one.name in only)
            ]
            options |= {one.name: one for one in shown}
            parameters += [_parameter(one.name, *_typed(one)) for one in shown]
            if kind.section:
                section = kind
        else:
            parameters.append(parameter)
    if section is not None:
        parameters += _layers(section)

    def parted(said: dict[str, Any]) -> tuple[dict[str, Any], dict[str, tuple[Any, ...]]]:
        """Take the settings out of what was said; return those given, and each model's layers."""
        preset, config = (said.pop(name, None) for name in ("preset", "config"))
        given = {name: _converted(one, said.pop(name)) for name, one in options.items()}
        given = {name: value for name, value in given.items() if value is not None}
        layers: dict[str, tuple[Any, ...]] = {}
        for name, kind in models.items():
            own = {one.name: given[one.name] for one in settings_of(kind) if one.name in given}
            layers[name] = (own, preset, config) if kind.section else (own,)
        return given, layers

    def described(
        name: str, said: dict[str, Any], as_json: bool, others: Sequence[dict[str, Any]]
    ) -> str:
        from dmpcli.settings.described import text

        _, layers = parted(said)
        return text(name, [(models[key], *layers[key]) for key in models], as_json, others)

    def run(**said: Any) -> None:
        given, layers = parted(said)
        for name, kind in models.items():
            said[name] = resolve(kind, *layers[name])
        if wants_given:
            said[wants_given] = given
        command(**said)

    run.__doc__, run.__module__, run.__name__ = command.__doc__, command.__module__, "command"
    run.__dict__.update(__signature__=inspect.Signature(parameters), __wrapped__=command)
    run.__dict__.update(described=described, settings=frozenset(options))
    return run


def _opened(kind: Any) -> tuple[Any, tuple[str, ...] | None]:
    """Return what a parameter's annotation is, and which fields of a model it shows."""
    if get_origin(kind) is Annotated and isinstance(get_args(kind)[1], Only):
        return get_args(kind)[0], get_args(kind)[1].names
    return kind, None


def choice(*words: str) -> Callable[[str], list[str]]:
    """Return what completes some words in the shell."""

    def complete(incomplete: str) -> list[str]:
        return [word for word in words if word.startswith(incomplete)]

    return complete


def _parameter(name: str, kind: Any, option: Any, default: Any = None) -> inspect.Parameter:
    annotation = Annotated[kind, option]
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
    )


def _typed(setting: Setting) -> tuple[Any, Any]:
    """Return the type and the option that Typer makes of a setting."""
    option, base, flag = setting.option, setting.base, setting.flag
    assert option is not None
    if base is bool and setting.default:
        flag = f"{flag}/--no-{flag.removeprefix('--')}"
    default = setting.shown_default
    made = typer.Option(
        flag,
        metavar=setting.metavar,
        help=f"{setting.help}  [default: {default}]" if default else setting.help,
        show_default=False,
        autocompletion=choice(*setting.choices) if setting.choices else None,
    )
    if get_origin(base) is tuple:
        if get_args(base)[1] is ...:
            return list[str] | None, made
        return tuple[(float,) * len(get_args(base))] | None, made  # type: ignore[misc]
    return (base if base in (bool, int, float, Path) else str) | None, made


def _converted(setting: Setting, value: Any) -> Any:
    """Return what the option says in the field's unit; None if it says nothing."""
    if value is None or value == []:
        return None
    if isinstance(value, list):
        return tuple(value)
    factor = setting.option.factor if setting.option else 1.0
    return value if factor == 1.0 else value * factor


def _layers(kind: type[Settings]) -> list[inspect.Parameter]:
    def presets(incomplete: str) -> list[str]:
        return choice(*preset_names())(incomplete)

    return [
        _parameter(
            "preset",
            str | None,
            typer.Option(
                metavar="NAME|FILE",
                help=f"Its [{kind.section}] section holds settings; a file ends in .toml.",
                autocompletion=presets,
            ),
            kind.preset,
        ),
        _parameter(
            "config",
            Path | None,
            typer.Option(metavar="FILE", help="A TOML file; its section beats the preset's."),
        ),
    ]

"""How a setting is declared, and what its declaration says.

A model is a frozen dataclass; the annotation of a field holds everything there is to say of it::

    rate: Annotated[float, Ge(0.001), Le(10_000), Option("Samples per second.", "Hz")] = 50.0

pydantic reads type and range when values are checked (`layers`), the command line reads all of it
(`options`). A field without `Option` is a key of the TOML section alone. No numerics are loaded
here, so that ``--help`` and completion need not wait.
"""

import types
from collections.abc import Sequence
from dataclasses import MISSING, asdict, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt

_LONGEST = 60
"""Letters of a metavar: more leave no room for the text in a line of help."""


@dataclass(frozen=True)
class Option:
    """How a setting stands on the command line.

    Attributes
    ----------
    help : str
        One sentence, without default and, if the metavar states it, without unit.
    unit : str
        Of the number as the option takes it.
    flag : str
        Where it is not the field's name.
    metavar : str
        Where neither unit nor choices make one.
    unset : str
        What holds by default, in words, where the default is None or empty.
    choices : tuple of str
        Words to complete, where the field takes others too.
    factor : float
        The option's unit in that of the field: pi / 180 of one in rad that takes degrees.
    """

    help: str
    unit: str = ""
    flag: str = ""
    metavar: str = ""
    unset: str = ""
    choices: tuple[str, ...] = ()
    factor: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Base of all settings: unknown keys, NaN and infinity are errors.

    Attributes
    ----------
    section : str
        Of the TOML files that may say them; empty if only the command line does.
    preset : str or None
        Name of the preset that holds unless another is named.
    """

    section: ClassVar[str] = ""
    preset: ClassVar[str | None] = None
    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid", "allow_inf_nan": False}

    def as_options(self) -> dict[str, Any]:
        """Return the settings as JSON values, as provenance keeps them."""
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in asdict(self).items()
        }


@dataclass(frozen=True)
class Setting:
    """What one field's declaration says.

    Attributes
    ----------
    name : str
    base : Any
        Its type, without None and ranges.
    ranges : tuple
        `annotated_types` bounds.
    default : Any
        `dataclasses.MISSING` if there is none.
    option : Option or None
    """

    name: str
    base: Any
    ranges: tuple[Any, ...]
    default: Any
    option: Option | None

    @property
    def flag(self) -> str:
        """The option as it is typed."""
        said = self.option.flag if self.option else ""
        return said or f"--{self.name.replace('_', '-')}"

    @property
    def choices(self) -> tuple[str, ...]:
        """The words that it may be, or that it may be beside others."""
        words = self.option.choices if self.option else ()
        for part in _parts(self.base):
            words += get_args(part) if get_origin(part) is Literal else ()
        return words

    @property
    def metavar(self) -> str | None:
        """The form of the value: its unit, its choices, or what it names; None for a switch.

        Choices too many for a line of help stand in its text, which is wrapped.
        """
        said = "" if self.option is None else self.option.metavar
        if self.base is bool:
            return None
        forms = [*self.choices]
        for part in _parts(self.base):
            form = {int: "INTEGER", float: "NUMBER", Path: "FILE"}.get(part, "")
            unit = self.option.unit if self.option and part is float else ""
            forms.append(said or _capital(unit) or form)
        form = "|".join(form for form in forms if form) or "NAME"
        return form if len(form) <= _LONGEST else self.name.rstrip("_").upper()

    @property
    def help(self) -> str:
        """What it is for, and its choices where they stand nowhere else."""
        assert self.option is not None
        listed = self.metavar is None or all(word in self.metavar for word in self.choices)
        return (
            self.option.help if listed else f"{self.option.help} One of {', '.join(self.choices)}."
        )

    @property
    def shown_default(self) -> str:
        """What holds where nothing is said, with the unit if the metavar does not state it."""
        option, value = self.option, self.default
        if option is None or value is MISSING:
            return ""
        if option.unset or value is None or value == ():
            return option.unset
        if isinstance(value, bool):
            return self.flag.removeprefix("--") if value else ""
        if isinstance(value, str | Path):
            return str(value)
        text = " ".join(number(one / option.factor) for one in _listed(value))
        stated = not option.unit or _capital(option.unit) in str(self.metavar).split("|")
        return text if stated else f"{text} {option.unit}"

    @property
    def range(self) -> str:
        """What a value must be, in words; empty if there is no bound."""
        if self.choices:
            words = [*self.choices, *([bounds] if (bounds := self._bounds) else [])]
            return " or ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)
        return self._bounds

    @property
    def _bounds(self) -> str:
        factor = self.option.factor if self.option else 1.0
        bounds: dict[type, str] = {}
        for bound in self.ranges:
            value = getattr(bound, type(bound).__name__.lower())
            bounds[type(bound)] = number(value / factor)
        low, above = bounds.get(Ge), bounds.get(Gt)
        high, below = bounds.get(Le), bounds.get(Lt)
        if low and high:
            text = f"{low} to {high}"
        else:
            parts = [low and f"{low} or more", above and f"above {above}"]
            parts += [high and f"up to {high}", below and f"below {below}"]
            text = " and ".join(part for part in parts if part)
        return f"{text} {self.option.unit}".rstrip() if text and self.option else text


def settings_of(kind: type[Settings]) -> tuple[Setting, ...]:
    """Return what a model declares, in its order."""
    hints = get_type_hints(kind, include_extras=True)
    return tuple(_setting(field.name, hints[field.name], field.default) for field in fields(kind))


def number(value: float) -> str:
    """Return a number as people write it: 50, 0.785, 1e-09."""
    return f"{value:.10g}"


def _setting(name: str, hint: Any, default: Any) -> Setting:
    base, said = _opened(hint)
    option = next((one for one in said if isinstance(one, Option)), None)
    ranges = tuple(one for one in said if isinstance(one, Ge | Gt | Le | Lt))
    return Setting(name, base, ranges, default, option)


def _opened(hint: Any) -> tuple[Any, list[Any]]:
    """Take None and annotations off a type; return it, and what the annotations say."""
    if get_origin(hint) is Annotated:
        inner, *said = get_args(hint)
        base, more = _opened(inner)
        return base, [*more, *said]
    if get_origin(hint) in (Union, types.UnionType):
        opened = [_opened(part) for part in get_args(hint) if part is not types.NoneType]
        said = [one for _, more in opened for one in more]
        bases = tuple(base for base, _ in opened)
        return (bases[0] if len(bases) == 1 else Union[bases]), said  # noqa: UP007
    return hint, []


def _parts(base: Any) -> tuple[Any, ...]:
    return get_args(base) if get_origin(base) is Union else (base,)


def _listed(value: Any) -> Sequence[float]:
    return value if isinstance(value, tuple) else (value,)


def _capital(unit: str) -> str:
    """Return a unit as a metavar: rad/s² as RAD/S^2."""
    for sign, word in {"°": "deg", "%": "percent", "²": "^2", "³": "^3", "·": "*"}.items():
        unit = unit.replace(sign, word)
    return unit.upper()

"""A setting is declared once: help, completion, messages and TOML keys say what its model says."""

import importlib
import inspect
import math
import tomllib
from dataclasses import MISSING
from importlib import resources
from typing import Annotated, Any, Literal, get_args, get_origin

import pytest
import typer
from annotated_types import Ge, Le
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from dmpcli import cli
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.options import FitOptions
from dmpcli.errors import InputError
from dmpcli.records import layouts
from dmpcli.settings.calibrate import CalibrateSettings
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.settings.fit import FitSettings
from dmpcli.settings.generalize import GeneralizeSettings
from dmpcli.settings.layers import resolve
from dmpcli.settings.model import Option, Settings, settings_of
from dmpcli.settings.options import Only, with_options
from dmpcli.settings.record import RecordSettings
from dmpcli.settings.recording import RecordingOptions
from dmpcli.surfaces import registration

GROUP: Any = typer.main.get_command(cli.app)
SECTIONS = [CalibrateSettings, ExecuteSettings, FitSettings, GeneralizeSettings, RecordSettings]


def command_of(name):
    return GROUP.commands[name].make_context(name, [], resilient_parsing=True).command


def declared(name):
    """The settings that are options of a command, each as its model declares it."""
    module = importlib.import_module(cli.module_of(name))
    for parameter in inspect.signature(inspect.unwrap(module.command)).parameters.values():
        kind, only = parameter.annotation, None
        if get_origin(kind) is Annotated and isinstance(get_args(kind)[1], Only):
            kind, only = get_args(kind)[0], get_args(kind)[1].names
        if isinstance(kind, type) and issubclass(kind, Settings):
            for one in settings_of(kind):
                if one.option is not None and (only is None or one.name in only):
                    yield one


OPTIONS = [(name, one) for name in cli.COMMANDS for one in declared(name)]


def parameter(name, flag):
    [found] = [one for one in command_of(name).params if flag in one.opts]
    return found


def completed(words, incomplete):
    """What the shell is offered behind some words of the command line."""
    done = CliRunner().invoke(
        cli.app,
        prog_name="dmpcli",
        env={
            "_DMPCLI_COMPLETE": "complete_bash",
            "COMP_WORDS": " ".join(["dmpcli", *words, incomplete]),
            "COMP_CWORD": str(1 + len(words)),
        },
    )
    return done.stdout.split()


def test_all_models_are_options_of_some_command():
    assert len(OPTIONS) > 90
    assert {name for name, _ in OPTIONS} >= {"fit", "generalize", "record", "execute", "calibrate"}


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_the_front_door_says_of_a_command_what_the_command_says(command):
    first = command_of(command).help.replace("\n", " ").split("  ")[0]
    assert first.startswith(cli.COMMANDS[command])


@pytest.mark.slow
@pytest.mark.parametrize(("command", "one"), OPTIONS, ids=lambda v: getattr(v, "flag", v))
def test_help_states_unit_and_default_of_every_option(command, one):
    found = parameter(command, one.flag)
    assert found.metavar == one.metavar
    assert found.help.startswith(one.option.help)
    if one.shown_default:
        assert found.help.endswith(f"[default: {one.shown_default}]")
    if one.option.unit and one.base is float:
        assert one.metavar == one.metavar.upper()
    elif one.option.unit:
        assert one.shown_default.endswith(f" {one.option.unit}")


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_every_number_is_declared_in_a_model_with_a_unit_and_a_default(command):
    models = {one.name: one for one in declared(command)}
    module = importlib.import_module(cli.module_of(command))
    for name, one in inspect.signature(module.command).parameters.items():
        kind = get_args(one.annotation)[0]
        if kind in (int, float) or {int, float} & {*get_args(kind)}:
            assert models[name].metavar, name
            assert models[name].shown_default, name


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_no_help_text_states_a_default_by_hand(command):
    for one in command_of(command).params:
        text = (getattr(one, "help", None) or "").partition("  [default: ")[0]
        assert "(default" not in text
        assert "Default:" not in text


CHOICES = [(command, one) for command, one in OPTIONS if one.choices]


@pytest.mark.parametrize(("command", "one"), CHOICES, ids=lambda v: getattr(v, "flag", v))
def test_choices_complete(command, one):
    found = parameter(command, one.flag)
    context = GROUP.make_context("dmpcli", [command], resilient_parsing=True)
    offered = [item.value for item in found.shell_complete(context, "")]
    assert offered == [*one.choices]


def test_the_shell_is_offered_commands_options_choices_and_presets():
    assert completed([], "gen") == ["generalize"]
    assert "--tolerance" in completed(["fit"], "--")
    assert completed(["fit", "a.csv", "--regression"], "r") == ["ridge"]
    assert completed(["record", "--preset"], "") == ["default", "drag", "paper"]
    pose = ["register", "p.stl", "t.csv", "--initial", "1", "2", "3", "0", "0", "0"]
    assert completed([*pose, "--guess"], "n") == ["near", "none"]


@pytest.mark.parametrize("kind", SECTIONS)
def test_every_key_of_a_section_is_read_from_toml(kind, tmp_path):
    needed = {one.name: (1.0,) * 6 for one in settings_of(kind) if one.default is MISSING}
    wanted = kind(**needed)
    lines = [f"[{kind.section}]"]
    for name, value in wanted.as_options().items():
        if value is not None:
            lines.append(
                f"{name} = {str(value).lower() if value in (True, False) else repr(value)}"
            )
    path = tmp_path / "all.toml"
    path.write_text("\n".join(lines))
    assert tomllib.loads(path.read_text())
    assert resolve(kind, {}, None, path) == wanted


@pytest.mark.parametrize("kind", SECTIONS)
def test_keys_of_the_presets_are_keys_of_their_models(kind):
    for file in (resources.files("dmpcli") / "presets").iterdir():
        section = tomllib.loads(file.read_text(encoding="utf-8")).get(kind.section, {})
        assert section.keys() <= {one.name for one in settings_of(kind)}


def test_models_and_mathematics_have_the_same_defaults():
    assert FitSettings().choices() == FitOptions()
    assert GeneralizeSettings().style() == GeneralizeOptions()
    assert [one.default for one in declared("register") if one.name == "max_error"] == [
        registration.LIMIT
    ]


def test_the_words_of_recordings_are_those_that_their_reader_knows():
    known = {one.name: one.choices for one in settings_of(RecordingOptions)}
    assert known["layout"] == (*layouts.LAYOUTS,)
    assert known["length_unit"] == (*layouts.LENGTH,)
    assert known["time_unit"] == (*layouts.TIME,)
    assert known["angle_unit"] == (*layouts.ANGLE,)
    assert known["repeated_stamps"] == layouts.REPEATED


def test_a_wrong_choice_names_the_choices_and_a_wrong_number_its_range():
    with pytest.raises(InputError, match=r"^--regression = 'x': must be lwr or ridge$"):
        resolve(FitSettings, {"regression": "x"})
    with pytest.raises(InputError, match=r"^--rate = 0.0: must be 0.001 to 10000 Hz$"):
        resolve(GeneralizeSettings, {"rate": 0.0})
    with pytest.raises(InputError, match=r"^--from = -1.0: must be 0 or more s$"):
        resolve(FitSettings, {"start": -1.0})


@pytest.mark.slow
@given(st.floats(3.0, 89.0))
def test_an_angle_given_in_degrees_is_kept_in_radians(degrees):
    tilt = next(one for one in settings_of(CalibrateSettings) if one.name == "tilt")
    assert (tilt.metavar, tilt.shown_default, tilt.range) == (
        "DEG",
        "45",
        "2.864788976 to 89.95437384 °",
    )
    kept = []

    @with_options
    def command(*, settings: CalibrateSettings) -> None:
        kept.append(settings.tilt)

    said = dict.fromkeys(inspect.signature(command).parameters)
    command(**said | {"tilt": degrees})
    assert kept == [math.radians(degrees)]


def test_a_field_without_option_is_a_key_alone():
    found = {one.name: one.option for one in settings_of(ExecuteSettings)}
    assert found["lead_speed"] is None
    assert isinstance(found["speed"], Option)
    assert not [one for one in command_of("execute").params if one.name == "lead_speed"]


def test_a_declaration_says_all_of_an_option():
    from dataclasses import dataclass

    @dataclass(frozen=True, kw_only=True)
    class Example(Settings):
        rate: Annotated[float, Ge(1), Le(9), Option("How often.", "1/s²")] = 3.0
        word: Annotated[Literal["a", "b"] | None, Option("Which.", unset="a")] = None

    globals()["Example"] = Example
    rate, word = settings_of(Example)
    assert (rate.flag, rate.metavar, rate.shown_default) == ("--rate", "1/S^2", "3")
    assert (rate.range, word.range) == ("1 to 9 1/s²", "a or b")
    assert (word.metavar, word.shown_default) == ("a|b", "a")

"""What --help says: every default and unit, in full width, nothing cut."""

import os
import re
import subprocess
import sys
from typing import Union, get_args, get_origin

import pytest
import typer

from dmpcli import cli
from tests.commands.running import invoke
from tests.settings.test_options import OPTIONS

GROUP = typer.main.get_command(cli.app)

UNITLESS = {
    ("record", "--periods"): "a count, in parts",
    ("simulate", "--periods"): "a count, in parts",
    ("fit", "--basis"): "a count",
    ("fit", "--damping"): "of eq. (1), without a unit by its phase",
    ("fit", "--tau"): "a share of the duration",
    ("fit", "--alpha-1"): "of eq. (2), without a unit by its phase",
    ("generalize", "--scale"): "a ratio",
    ("execute", "--speed"): "a ratio",
    ("calibrate", "--condition"): "a ratio",
}
"""Numbers that have no unit, and why. INTEGER is a count, a port or a seed."""

NOTHING = {
    "--body", "--border-margin", "--columns", "--config", "--coupling", "--drawn", "--episode",
    "--event", "--for", "--force-setpoint", "--from", "--goal", "--goal-from",
    "--goal-orientation", "--keep-out", "--log", "--map", "--orientation", "--output", "--pairs",
    "--part", "--preset", "--robot-model", "--save", "--schema", "--start",
    "--start-orientation", "--surface", "--surface-cache", "--surface-pose", "--tool",
    "--workspace",
}  # fmt: skip
"""Options without which nothing is: no such file is read or written, no such check is made."""


def options_of(name):
    context = GROUP.commands[name].make_context(name, [], resilient_parsing=True)
    return context, [one for one in context.command.params if one.param_type_name == "option"]


def test_no_option_lacks_its_default():
    missing = []
    for name in cli.COMMANDS:
        context, options = options_of(name)
        for option in options:
            shown = option.get_help_record(context)[1]
            if (
                "[default: " not in shown
                and "[required]" not in shown
                and option.opts != ["--help"]
            ):
                missing.append((name, option.opts))
    assert missing == []


def test_none_is_the_default_of_what_does_nothing_unless_it_is_given_alone():
    """What holds without an option stands in its help; that it is nothing, of these alone."""
    found, declared = set(), {(name, one.flag): one.default for name, one in OPTIONS}
    for name in cli.COMMANDS:
        context, options = options_of(name)
        for option in options:
            if option.get_help_record(context)[1].endswith("[default: none]"):
                assert option.default is None, (name, option.opts)
                found.add(max(option.opts, key=len))
            elif "[default: off]" in option.get_help_record(context)[1]:
                assert option.is_flag, (name, option.opts)
                off = declared.get((name, max(option.opts, key=len)), option.default)
                assert off is False, (name, option.opts)
    assert found == NOTHING


def test_no_number_lacks_its_unit():
    """Its form is its unit; a point's stands in its words; a count or ratio says that it is one."""
    missing, seen = [], 0
    for command, one in OPTIONS:
        parts = get_args(one.base) if get_origin(one.base) is Union else (one.base,)
        if not {int, float} & {*parts}:
            continue
        seen += 1
        form = one.metavar.split("|")[-1]
        bare = (command, one.flag) in UNITLESS
        if bare != (not one.option.unit) and form != "INTEGER":
            missing.append((command, one.flag, form))
        units = r"(MM|RAD|DEG|S|HZ|N|N\*M|KG|PERCENT)(/(MM|S|RAD|N|M)(\^\d)?)?"
        if one.option.unit and not re.fullmatch(units, form):
            missing.append((command, one.flag, form))
    for name in cli.COMMANDS:
        context, options = options_of(name)
        for option in options:
            # A normal is a direction.
            if " " in str(option.metavar) and "--normal" not in option.opts:
                seen += 1
                if not re.search(r"\b(mm|rad)\b", option.get_help_record(context)[1]):
                    missing.append((name, option.opts))
    assert missing == []
    assert seen > 90


@pytest.mark.slow
@pytest.mark.parametrize("columns", ["80", "200"])
def test_summaries_are_whole_and_lines_take_the_width_of_the_terminal(columns):
    def shown(*words):
        done = subprocess.run(
            [sys.executable, "-m", "dmpcli", *words],
            env=os.environ | {"COLUMNS": columns},
            capture_output=True,
            check=True,
        )
        return done.stdout.decode()

    widest = max(len(line) for line in shown("fit", "--help").split("Examples:")[0].splitlines())
    assert int(columns) - 25 < widest <= int(columns)
    whole = " ".join(shown("--help").split())
    for words in cli.COMMANDS.values():
        assert " ".join(words.split()) in whole


def test_a_narrow_pipe_gets_eighty_columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "20")
    from dmpcli.commands import help_page

    assert help_page.width() == 80


def test_the_foot_of_help_shows_what_to_type():
    text = invoke("execute", "--help").stdout
    assert text.count("\n  # ") >= 3

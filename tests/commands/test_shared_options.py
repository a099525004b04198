"""--json, --log and --print-config, which every command takes alike."""

import json
import re
import tomllib
from pathlib import Path

import pytest

from dmpcli import cli
from dmpcli.settings.fit import FitSettings
from dmpcli.settings.generalize import GeneralizeSettings
from dmpcli.settings.layers import preset_names, resolve
from dmpcli.settings.record import RecordSettings
from tests.commands.running import ended, invoke

STAMP = r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z"
LINE = ["--reference", "line", "--duration", "1.5"]
LINE += ["--start", "-551", "131", "-17.56", "--goal", "-561", "131", "-17.56"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_every_command_takes_json_and_log(command):
    text = invoke(command, "--help").stdout
    assert "--json" in text
    assert "--log FILE" in text


def test_json_says_how_it_ended_what_was_told_and_what_was_written():
    done = ended("record", "-o", "demo.parquet", *LINE, "--json")
    said = json.loads(done.stdout)
    assert (said["schema"], said["command"], said["exit_code"]) == ("outcome", "record", 0)
    assert said["error"] is None
    assert said["output"]["found"]["schema"] == "demonstration"
    assert [one["text"] for one in said["messages"]] == done.stderr.strip().split("\n")
    done = ended("fit", "demo.parquet", "-o", "s.json", "--json", "-q")
    assert done.stderr == ""
    said = json.loads(done.stdout)
    assert "reproduction RMS" in said["messages"][-1]["text"]
    assert said["output"]["found"]["content"]["model"] == "modified"


def test_json_tells_of_a_failure_with_its_exit_code():
    done = ended("fit", "none.csv", "-o", "s.json", "--json", expect=2)
    said = json.loads(done.stdout)
    assert said["exit_code"] == 2
    assert done.stderr == f"dmpcli: {said['error']}\n"
    assert said["output"] is None


def test_json_of_a_verdict_holds_its_checks():
    ended("record", "-o", "demo.parquet", *LINE)
    ended("fit", "demo.parquet", "-o", "s.json")
    ease = ["--ease-in", "0.5", "--ease-out", "0.5"]
    ended("generalize", "s.json", "-o", "t.parquet", "--reproduce", *ease)
    said = json.loads(ended("execute", "t.parquet", "--dry-run", "--json").stdout)
    [stroke] = said["strokes"]
    assert all(check["passed"] for check in stroke["checks"])
    assert {"quantity", "value", "limit", "unit"} <= stroke["checks"][0].keys()
    done = ended("execute", "t.parquet", "--dry-run", "--json", "--max-speed", "0.1", expect=3)
    said = json.loads(done.stdout)
    assert not all(check["passed"] for check in said["strokes"][0]["checks"])


def test_json_and_a_file_do_not_share_standard_output():
    done = ended("record", "-o", "-", *LINE, "--json", expect=2)
    assert "--json: standard output holds the file" in done.stderr


def test_log_keeps_every_message_with_its_time_also_when_quiet():
    ended("record", "-o", "demo.parquet", *LINE, "--log", "a.log", "-q")
    ended("fit", "none.csv", "-o", "s.json", "--log", "a.log", expect=2)
    lines = Path("a.log").read_text().splitlines()
    assert all(re.match(rf"{STAMP} (info|warning|error) ", line) for line in lines)
    words = [re.sub(rf"{STAMP} ", "", line) for line in lines]
    assert words[0].startswith("info    dmpcli record -o demo.parquet --reference line")
    assert any("rows, " in line for line in words)
    assert words[-3].startswith("info    dmpcli fit none.csv")
    assert words[-2] == "error   none.csv: no such file; check the name"
    assert words[-1] == "info    exit code 2"


def test_a_log_that_cannot_be_written_is_told_before_anything_is_done():
    done = ended("record", "-o", "demo.parquet", *LINE, "--log", "no/such.log", expect=2)
    assert "--log no/such.log: cannot be written" in done.stderr


def test_a_log_that_breaks_ends_nothing():
    done = ended("record", "-o", "demo.parquet", *LINE, "--log", "/dev/full")
    assert done.stderr.count("--log /dev/full") == 1


@pytest.mark.parametrize(
    ("command", "kind"),
    [("fit", FitSettings), ("generalize", GeneralizeSettings), ("record", RecordSettings)],
)
def test_print_config_is_a_file_that_config_reads(command, kind, folder):
    done = ended(command, "--print-config")
    assert set(tomllib.loads(done.stdout)) >= {"units", kind.section}
    (folder / "all.toml").write_text(done.stdout)
    preset = kind.preset
    assert resolve(kind, {}, None, folder / "all.toml") == resolve(kind, {}, preset)


def test_print_config_names_the_source_of_every_setting(folder):
    (folder / "run.toml").write_text("[fit]\ntau = 0.6\n")
    words = ["--preset", "paper", "--config", "run.toml", "--damping", "15"]
    text = ended("fit", *words, "--print-config").stdout
    assert re.search(r"^basis = 80  # preset paper$", text, re.M)
    assert re.search(r"^tau = 0\.6  # run\.toml$", text, re.M)
    assert re.search(r"^damping = 15\.0  # option --damping$", text, re.M)
    assert re.search(r"^model = \"modified\"  # default$", text, re.M)
    assert re.search(r"^# tolerance is not set: 0\.1, or .*  # mm; default$", text, re.M)
    assert re.search(r"^# --layout is not set", text, re.M)
    rows = json.loads(ended("fit", *words, "--print-config", "--json").stdout)["settings"]
    assert {row["source"] for row in rows} == {
        "preset paper",
        "run.toml",
        "option --damping",
        "option --preset",
        "option --config",
        "default",
    }


def test_print_config_of_a_wrong_setting_says_so():
    assert "--damping" in ended("fit", "--print-config", "--damping", "0", expect=2).stderr


def test_presets_are_listed_printed_and_told_as_json():
    text = ended("presets").stdout
    assert all(f"{name}: " in text for name in preset_names())
    printed = ended("presets", "paper").stdout
    assert tomllib.loads(printed)["fit"]["basis"] == 80
    told = json.loads(ended("presets", "--json").stdout)
    assert told["drag"]["sections"]["record"]["control_rate"] == 50.0
    assert "there are default, drag, paper" in ended("presets", "none", expect=2).stderr

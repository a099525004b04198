"""What holds for every command: JSON, settings with their sources, and completion."""

import json
import os
import pty
import select
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest
import typer

from dmpcli import cli
from tests.commands.running import ended, invoke
from tests.commands.test_examples import lay_out
from tests.commands.virtual_lab import Lab
from tests.settings.test_options import completed

GROUP = typer.main.get_command(cli.app)
LINE = "--reference line --duration 1.5 --start -551 131 -17.56 --goal -561 131 -17.56"
EASE = "--ease-in 0.5 --ease-out 0.5"
TOLD = {
    "record": f"-o demo.parquet {LINE}",
    "fit": "demo.parquet -o skill.json",
    "generalize": f"skill.json -o traj.parquet --reproduce {EASE}",
    "execute": "traj.parquet -o run.parquet",
    "report": "demo.parquet traj.parquet",
    "import": "log.csv -o log.parquet --map t=time --map x=tx --map y=ty --map z=tz "
    "--length-unit m",
    "export": "run.parquet -o run.tum",
    "inspect": "skill.json",
    "recover": "cut.parquet.journal -o cut.parquet",
    "register": "block.stl touched.csv -o pose.json",
    "calibrate": "-o tool.json",
    "touch": "-o points.csv --every 0.2 --count 2",
    "check": "",
    "presets": "",
    "info": "",
}
"""A line of each command that succeeds; in this order each finds the files that it reads."""

WRONG = {
    "simulate": "--drawn no/such/folder/x.parquet",
    "calibrate": "-o no/such/folder/tool.json",
    "touch": "-o no/such/folder/points.csv",
    "check": "--robot nowhere://x",
    "presets": "none",
    "info": None,
    "record": "-o no/such/folder/x.parquet",
    "execute": "none.parquet --dry-run",
    "report": "none.parquet",
    "inspect": "none.parquet",
    "register": "none.stl none.csv -o pose.json",
    "recover": "none.journal -o x.parquet",
}
"""A line of each command that is refused; of others, an input that is not there."""


def of(name):
    context = GROUP.commands[name].make_context(name, [], resilient_parsing=True)
    return [one for one in context.command.params if one.name != "help"]


def flag(one):
    if one.param_type_name == "argument":
        return one.metavar or one.name.upper()
    return max(one.opts, key=len)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("every")
    lay_out(made)
    return made


@pytest.fixture(scope="module")
def told(folder):
    """What each command prints with --json."""
    here, found = Path.cwd(), {}
    os.chdir(folder)
    try:
        for name, words in TOLD.items():
            found[name] = ended(name, *words.split(), "--json").stdout
    finally:
        os.chdir(here)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", TOLD)
def test_json_is_one_document_and_nothing_else(name, told):
    document = json.loads(told[name])
    if name not in ("report", "inspect", "presets", "info"):
        assert (document["schema"], document["command"]) == ("outcome", name)
        assert document["exit_code"] == 0
        assert document["messages"]


@pytest.mark.slow
def test_json_of_simulate_is_a_line_with_its_urls_while_it_serves():
    with Lab("--json") as lab:
        said = json.loads(lab.line)
        assert said["schema"] == "lab"
        assert said["sensor"].startswith("netft://127.0.0.1:")
        assert said["robot"].startswith("elite://127.0.0.1:")
    assert lab.rest == ""


@pytest.mark.parametrize("name", [name for name in cli.COMMANDS if name != "info"])
def test_json_of_what_is_refused_says_so(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = WRONG.get(name, "none.csv -o x.parquet" if name != "fit" else "none.csv -o x.json")
    done = invoke(name, *words.split(), "--json")
    said = json.loads(done.stdout)
    assert said["exit_code"] == done.exit_code
    assert done.exit_code in (2, 4)
    assert said["error"] in done.stderr
    assert said["output"] is None


def test_json_shares_standard_output_with_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for words in (["calibrate", "-o", "tool.json", "--save", "-"], ["touch", "-o", "-"]):
        assert "--json: standard output holds the file" in ended(*words, "--json", expect=2).stderr
    assert "--drawn -" in ended("simulate", "--drawn", "-", expect=2).stderr


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_print_config_shows_every_setting_with_its_source(name):
    """Without the files that the command needs, as TOML and as JSON."""
    text = ended(name, "--print-config").stdout
    assert tomllib.loads(text) is not None
    rows = json.loads(ended(name, "--print-config", "--json").stdout)["settings"]
    assert all(row["source"] for row in rows)
    keys = {row["key"] for row in rows}
    for one in of(name):
        if one.name in ("as_json", "print_config"):
            continue
        # A setting that a file can say has the file's key.
        assert keys & {flag(one), one.name}, one.opts
        where = [row for row in rows if row["key"] in (flag(one), one.name)]
        assert len(where) == 1, one.opts
        if where[0]["value"] is None:
            assert f"# {where[0]['key']} is not set" in text


def test_print_config_tells_who_named_an_instrument_a_file_and_a_switch():
    words = ["execute", "traj.parquet", "--robot", "elite://h", "--dry-run", "--print-config"]
    rows = json.loads(ended(*words, "--json").stdout)["settings"]
    found = {row["key"]: (row["value"], row["source"]) for row in rows}
    assert found["TRAJECTORY"] == ("traj.parquet", "argument TRAJECTORY")
    assert found["--robot"] == ("elite://h", "option --robot")
    assert found["--dry-run"] == (True, "option --dry-run")
    assert found["--realtime"] == (False, "default")
    assert found["--sensor"] == (None, "default")
    assert "# --sensor is not set: none; with --coupling force mock:  # default" in (
        ended(*words).stdout
    )


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_where_a_file_is_named_nothing_is_offered_so_that_the_shell_offers_files(name):
    named = [one for one in of(name) if one.param_type_name == "argument" and name != "presets"]
    if named:
        assert completed([name], "") == []
    for one in of(name):
        if one.param_type_name == "option" and "FILE" in (one.metavar or "").split("|"):
            # Where words may stand too, they are offered, and files where none begins so.
            begun = "" if one.metavar == "FILE" else "no_word"
            assert completed([name, flag(one)], begun) == [], flag(one)


class Bash:
    """A shell at a terminal, as a person has it."""

    def __init__(self, folder):
        self.keys, side = pty.openpty()
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        self.process = subprocess.Popen(
            ["bash", "--norc", "--noprofile", "-i"],
            stdin=side, stdout=side, stderr=side, cwd=folder, start_new_session=True,
            env={"PATH": path, "HOME": str(folder), "PS1": "> ", "TERM": "dumb", "SHELL": "bash"},
        )  # fmt: skip
        os.close(side)

    def types(self, keys, until, patience=60.0):
        """Type keys and read until something stands there; return what was read."""
        os.write(self.keys, keys.encode())
        said, end = "", time.monotonic() + patience
        while until not in said:
            assert time.monotonic() < end, f"{keys!r}: {until!r} is not in {said!r}"
            if select.select([self.keys], [], [], 1.0)[0]:
                said += os.read(self.keys, 4096).decode()
        return said

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        os.close(self.keys)


@pytest.mark.slow
def test_a_shell_completes_commands_options_choices_and_files(tmp_path):
    (tmp_path / "mine of today.csv").touch()
    (tmp_path / "part.stl").touch()
    with Bash(tmp_path) as shell:
        shell.types("dmpcli --install-completion\n", "Completion will take effect")
        shell.types("source ~/.bashrc; echo re''ady\n", "ready")
        shell.types("dmpcli gen\t", "generalize ")
        shell.types("\025dmpcli fit mi\t", "mine\\ of\\ today.csv ")
        shell.types("--reg\t", "ression ")
        shell.types("r\t", "idge ")
        shell.types("--surface p\t", "part.stl ")
        shell.types("\025dmpcli record --preset pa\t", "paper ")
        shell.types("\025dmpcli check --robot el\t", "ite://")

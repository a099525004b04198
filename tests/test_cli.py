"""The front door: what it loads, what it says, how it ends."""

import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import dmpcli
from dmpcli import cli
from dmpcli.errors import DmpError, InputError, InstrumentError, RefusedError

COMMANDS = ["record", "fit", "generalize", "execute", "report", "inspect", "register"]
ROOT = Path(__file__).parents[1]
HEAVY = {"numpy", "scipy", "pandas", "pyarrow", "matplotlib", "rich", "pydantic"}


def loaded_by(code):
    script = f"import sys\n{code}\nprint(*sorted({{m.split('.')[0] for m in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
    return set(done.stdout.decode().splitlines()[-1].split())


@pytest.mark.parametrize("args", [["--help"], ["--version"], []])
def test_the_front_door_loads_nothing_heavy(args):
    code = f"import dmpcli.cli\ntry:\n    dmpcli.cli.app({args!r})\nexcept SystemExit:\n    pass"
    assert not HEAVY & loaded_by(code)


@pytest.mark.slow
def test_generalize_and_execute_load_no_scipy_and_no_pandas(tmp_path):
    skill, drawn, run = (str(tmp_path / name) for name in ("s.json", "t.parquet", "r.parquet"))
    reference = str(ROOT / "sample_runs" / "reference.parquet")
    done = CliRunner().invoke(cli.app, ["fit", reference, "-o", skill])
    assert done.exit_code == 0
    for args in (
        ["generalize", skill, "-o", drawn, "--reproduce"],
        ["execute", drawn, "-o", run],
        ["record", "-o", run, "--duration", "2"],
    ):
        loaded = loaded_by(f"from dmpcli import cli\ncli.app({args!r}, standalone_mode=False)")
        assert not {"scipy", "pandas", "matplotlib"} & loaded


def test_version_is_the_packages():
    done = CliRunner().invoke(cli.app, ["--version"])
    assert done.stdout.strip() == f"dmpcli {dmpcli.__version__}"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command):
    done = CliRunner().invoke(cli.app, [command, "--help"])
    assert done.exit_code == 0
    assert "Usage:" in done.stdout


def test_a_wrong_command_is_exit_code_2_on_standard_error():
    done = CliRunner().invoke(cli.app, ["generalise"])
    assert done.exit_code == 2
    assert "generalize" in done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize(
    ("error", "code"), [(DmpError, 2), (InputError, 2), (RefusedError, 3), (InstrumentError, 4)]
)
def test_errors_have_the_exit_codes_of_the_contract(monkeypatch, error, code):
    def fail(*_, **__):
        raise error("a.csv: is wrong")

    monkeypatch.setattr("dmpcli.records.file_io.read", fail)
    done = CliRunner().invoke(cli.app, ["inspect", "a.csv"])
    assert done.exit_code == code
    assert done.stderr == "dmpcli: a.csv: is wrong\n"


def test_a_defect_of_ours_keeps_its_traceback_and_is_exit_code_1(monkeypatch):
    def fail(*_, **__):
        raise ZeroDivisionError("ours")

    monkeypatch.setattr("dmpcli.records.file_io.read", fail)
    done = CliRunner().invoke(cli.app, ["inspect", "a.csv"])
    assert done.exit_code == 1
    assert isinstance(done.exception, ZeroDivisionError)

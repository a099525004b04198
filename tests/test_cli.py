"""The front door: what it loads, what it says, how it ends."""

import os
import signal
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_report_without_figures_loads_nothing_that_draws():
    reference = str(ROOT / "sample_runs" / "reference.parquet")
    words = ["report", reference, "--json"]
    loaded = loaded_by(
        f"from dmpcli import cli\ncli.app({words!r}, standalone_mode=False)\nprint()"
    )
    assert not {"matplotlib", "pandas"} & loaded


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


def test_a_command_that_is_called_again_has_its_own_words_and_wants_its_files(tmp_path):
    """Its options are made once in a process."""
    log = str(tmp_path / "log")
    for words in (["--print-config"], ["--print-config", "--basis", "77"]):
        done = CliRunner().invoke(cli.app, ["fit", *words, "--log", log])
        assert done.exit_code == 0
        assert ("basis = 77" in done.stdout) == ("77" in words)
    first, second = Path(log).read_text().splitlines()[::2]
    assert "--basis" not in first
    assert "fit --print-config --basis 77 --log" in second
    assert CliRunner().invoke(cli.app, ["fit"]).exit_code == 2
    assert CliRunner().invoke(cli.app, ["fit", "--print-config"]).exit_code == 0


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


CURSOR = "\x1b[2J\x1b]0;owned\x07\x9b1m\r"


def test_control_characters_of_names_are_shown_and_not_obeyed(tmp_path):
    """In a file's name, an option's, an id, a column; on both streams, as text and as JSON."""
    file = tmp_path / f"a{CURSOR}.csv"
    rows = "".join(f"{0.02 * i},{i},0,0,{i}\n" for i in range(20))
    file.write_bytes(f"t,x,y,z,col{CURSOR[:-1]}\n{rows}".encode())
    for words in (
        ["inspect", str(file)],
        ["inspect", str(file), "--json"],
        ["inspect", str(tmp_path / f"none{CURSOR}")],
        ["inspect", f"--none{CURSOR}"],
        [f"none{CURSOR}"],
        ["fit", str(file), "-o", str(tmp_path / f"s{CURSOR}.json")],
        ["report", str(file), str(file)],
    ):
        done = CliRunner().invoke(cli.app, words)
        assert done.exit_code in (0, 2, 3), words
        for said in (done.stdout, done.stderr):
            assert not set(said) & set(CURSOR) - set("2J]0;owned[1m"), words
        # The parser of the command line has its own way to show them.
        assert r"\u001b" in done.stdout + done.stderr or r"\x1b" in done.stderr, words


def test_an_id_that_would_be_obeyed_is_refused(tmp_path):
    file = tmp_path / "pairs.csv"
    file.write_text('id,x0,y0,z0,xg,yg,zg\n"a\ndmpcli: all drawn",0,0,0,50,0,0\n')
    skill = ROOT / "sample_runs" / "reference.parquet"
    done = CliRunner().invoke(cli.app, ["fit", str(skill), "-o", str(tmp_path / "s.json")])
    words = [
        "generalize",
        str(tmp_path / "s.json"),
        "--pairs",
        str(file),
        "-o",
        str(tmp_path / "b"),
    ]
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == 2
    assert "column 'id', line 2: 'a\\ndmpcli: all drawn' holds a control character" in done.stderr


LINE = ["--reference", "line", "--duration", "1.5", "--start", "-551", "131", "-17.56"]
LINE += ["--goal", "-561", "131", "-17.56"]


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(["record", "-o", "-", *LINE], marks=pytest.mark.slow),
        ["inspect", "none.csv"],
    ],
    ids=["record", "inspect"],
)
def told(request, tmp_path_factory):
    """A command, and how it ends for somebody who reads all that it says."""
    command = [sys.executable, "-m", "dmpcli", *request.param]
    folder = tmp_path_factory.mktemp("told")
    return command, subprocess.run(command, cwd=folder, capture_output=True, check=False)


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("how", ["closed", "broken"])
def test_whoever_closes_standard_error_changes_no_output_and_no_exit_code(how, told, tmp_path):
    command, sound = told
    assert sound.stderr
    if how == "closed":
        done = subprocess.run(
            command,
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            preexec_fn=lambda: os.close(2),
            check=False,
        )
    else:
        reader, writer = os.pipe()
        os.close(reader)
        with os.fdopen(writer, "wb") as broken:
            done = subprocess.run(
                command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=broken, check=False
            )
    assert (done.returncode, done.stdout) == (sound.returncode, sound.stdout)


def test_a_closed_standard_error_is_no_file_of_the_run(tmp_path):
    """The next file that is opened would get its number, and what libraries complain of."""
    code = (
        "import os, sys\n"
        "from dmpcli.messages import prepare_streams, say\n"
        "prepare_streams()\n"
        "file = open('journal', 'wb')\n"
        "os.write(2, b'a library complains'); say('so do we')\n"
        "file.write(b'%d' % (file.fileno() > 2))\n"
    )
    command = [sys.executable, "-c", code]
    subprocess.run(command, cwd=tmp_path, preexec_fn=lambda: os.close(2), check=True)
    assert (tmp_path / "journal").read_bytes() == b"1"


@pytest.mark.slow
def test_a_reader_of_standard_output_that_has_gone_is_still_told_by_the_exit_code(tmp_path):
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "dmpcli", "record", "-o", "-", *LINE]
    with os.fdopen(writer, "wb") as broken:
        done = subprocess.run(
            command, cwd=tmp_path, stdout=broken, stderr=subprocess.PIPE, check=False
        )
    assert done.returncode == 128 + signal.SIGPIPE
    assert b"Traceback" not in done.stderr

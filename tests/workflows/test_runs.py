"""What moves an arm and what measures strokes gives by the API what it gives by command."""

import json
import os
import signal
import threading
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import dmpcli
from dmpcli.cli import app
from dmpcli.control.servo_loop import ServoLoop
from dmpcli.records import file_io

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "sample_runs" / "reference.parquet"
BENCH = ROOT / "sample_runs" / "bench.stl"
START, GOAL = (-551.0, 331.4, -17.56), (-640.0, 331.4, -17.56)
EASED = {"ease_in": 0.5, "ease_out": 0.5}


def command(*words):
    return CliRunner().invoke(app, [*map(str, words), "-q"])


def done(*words):
    result = command(*words)
    assert result.exit_code == 0, result.stderr
    return result


@pytest.fixture(scope="module")
def taught():
    return dmpcli.record(duration=3.0, seed=7)


@pytest.fixture(scope="module")
def skill(taught):
    return dmpcli.fit(taught)


@pytest.fixture(scope="module")
def drawn(skill):
    return dmpcli.generalize(skill, START, GOAL, **EASED)


@pytest.mark.slow
def test_a_recording_has_the_bytes_that_record_writes(tmp_path, taught):
    done("record", "-o", tmp_path / "a.parquet", "--duration", "3", "--seed", "7")
    dmpcli.write(taught, tmp_path / "b.parquet")
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    named = dmpcli.record(tmp_path / "c.parquet", duration=3.0, seed=7)
    assert (tmp_path / "c.parquet").read_bytes() == (tmp_path / "a.parquet").read_bytes()
    np.testing.assert_array_equal(named.position, taught.position)


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], {}),
        (["--coupling", "force", "--force-setpoint", "3"], {"coupling": "force"}),
        (["--speed", "0.5", "--clearance", "15", "--id", "1"], {"id": "1", "clearance": 15.0}),
    ],
    ids=["plain", "force", "lifted"],
)
def test_a_run_has_the_bytes_that_execute_writes(tmp_path, drawn, words, said):
    if "coupling" in said:
        said = said | {"force_setpoint": 3.0}
    if "clearance" in said:
        said = said | {"speed": 0.5}
    dmpcli.write(drawn, tmp_path / "t.parquet")
    done("execute", tmp_path / "t.parquet", "-o", tmp_path / "a.parquet", *words)
    run = dmpcli.execute(drawn, tmp_path / "b.parquet", **said)
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    kept = dmpcli.execute(tmp_path / "t.parquet", **said)
    dmpcli.write(kept, tmp_path / "c.parquet")
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "c.parquet").read_bytes()
    read = dmpcli.read(tmp_path / "a.parquet")
    np.testing.assert_array_equal(read.position, run.position)


@pytest.mark.slow
def test_a_batch_is_executed_and_reported_as_its_folder(tmp_path, skill):
    many = dmpcli.generalize(skill, [START, START, START], [GOAL, GOAL, START], **EASED)
    dmpcli.write(many, tmp_path / "batch")
    done("execute", tmp_path / "batch", "-o", tmp_path / "a.parquet")
    for batch in (many, dmpcli.read(tmp_path / "batch"), tmp_path / "batch"):
        dmpcli.write(dmpcli.execute(batch), tmp_path / "b.parquet")
        assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    said = dmpcli.report(many, names=["batch"]).document
    assert said == json.loads(done("report", tmp_path / "batch", "--json").stdout)


def test_a_dry_run_moves_nothing_and_returns_plans_with_their_checks(drawn, monkeypatch):
    monkeypatch.setattr(ServoLoop, "run", lambda *_: pytest.fail("something moved"))
    [one] = dmpcli.execute(drawn, dry_run=True)
    assert one.failure is None
    assert {check.quantity for check in one.checks} >= {"speed", "acceleration", "jerk"}
    with pytest.raises(dmpcli.RefusedError, match="speed"):
        dmpcli.execute(drawn, dry_run=True, max_speed=5.0)


@pytest.mark.slow
def test_what_execute_and_record_refuse_raises_the_same_text(tmp_path, drawn):
    path = tmp_path / "t.parquet"
    dmpcli.write(drawn, path)
    cases = [
        (["--force-setpoint", "3"], {"force_setpoint": 3.0}, dmpcli.InputError),
        (["--max-force", "3"], {"max_force": 3.0}, dmpcli.InputError),
        (["--speed", "20"], {"speed": 20.0}, dmpcli.InputError),
        (["--id", "9"], {"id": ["9"]}, dmpcli.InputError),
        (["--robot", "moc:"], {"robot": "moc:"}, dmpcli.InputError),
        (["--max-speed", "5"], {"max_speed": 5.0}, dmpcli.RefusedError),
        (["--robot", "elite://127.0.0.1:1"], {"robot": "elite://127.0.0.1:1"}, None),
    ]
    for words, said, kind in cases:
        result = command("execute", path, "-o", tmp_path / "r.parquet", *words)
        with pytest.raises(dmpcli.DmpError) as raised:
            dmpcli.execute(path, tmp_path / "r.parquet", **said)
        assert type(raised.value) is (kind or dmpcli.InstrumentError)
        assert result.exit_code == raised.value.exit_code
        assert result.stderr.endswith(f"dmpcli: {raised.value}\n"), words
        assert not (tmp_path / "r.parquet").exists()
    for words, said in [
        (["--duration", "0.01"], {"duration": 0.01}),
        (["--reference", "square"], {"reference": "square"}),
        (["--robot", "elite://10.0.0.7"], {"robot": "elite://10.0.0.7"}),
    ]:
        result = command("record", "-o", tmp_path / "d.parquet", *words)
        with pytest.raises(dmpcli.InputError) as raised:
            dmpcli.record(tmp_path / "d.parquet", **said)
        assert result.stderr == f"dmpcli: {raised.value}\n"


def test_what_cannot_be_made_again_needs_a_file(drawn):
    with pytest.raises(dmpcli.InputError, match="output: name a file, for a run cannot be made"):
        dmpcli.execute(drawn, robot="elite://10.0.0.7")
    with pytest.raises(dmpcli.InputError, match="output: name a file, for a recording cannot"):
        dmpcli.record(
            robot="elite://10.0.0.7", sensor="netft://10.0.0.8", tool=ROOT / "pyproject.toml"
        )


@pytest.mark.parametrize(
    ("number", "kind"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, SystemExit)]
)
def test_a_signal_ends_the_call_once_the_run_is_kept(tmp_path, drawn, monkeypatch, number, kind):
    run = ServoLoop.run

    def signalled(loop, interruption):
        os.kill(os.getpid(), number)
        return run(loop, interruption)

    monkeypatch.setattr(ServoLoop, "run", signalled)
    handler = signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        with pytest.raises(kind):
            dmpcli.execute(drawn, tmp_path / "r.parquet")
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    finally:
        signal.signal(signal.SIGTERM, handler)


def test_beside_the_main_thread_only_simulated_time_runs(drawn):
    ended = {}

    def call(name, **said):
        try:
            ended[name] = dmpcli.execute(drawn, **said)
        except dmpcli.InputError as error:
            ended[name] = str(error)

    for name, said in (("simulated", {}), ("real", {"realtime": True})):
        thread = threading.Thread(target=call, args=(name,), kwargs=said)
        thread.start()
        thread.join()
    assert len(ended["simulated"]) > 100
    assert "main thread" in ended["real"]


@pytest.mark.slow
def test_a_report_has_the_values_and_files_that_report_writes(tmp_path, skill, drawn):
    dmpcli.write(skill, tmp_path / "skill.json")
    dmpcli.write(drawn, tmp_path / "drawn.parquet")
    files = [REFERENCE, tmp_path / "drawn.parquet", tmp_path / "skill.json"]
    shown = done("report", *files, "--surface", BENCH, "-o", tmp_path / "a")
    read = [dmpcli.read(file) for file in files]
    made = dmpcli.report(*read, surface=dmpcli.read_surface(BENCH), output=tmp_path / "b")
    assert made.json() == (tmp_path / "a" / "report.json").read_bytes()
    assert f"{made}" == shown.stdout
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "b").iterdir())
    for name in (name for name in names if not name.endswith(".png")):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    by_name = dmpcli.report(*files, surface=dmpcli.read_surface(BENCH))
    assert by_name.document == made.document


def test_values_without_a_file_are_called_what_they_are(taught, drawn):
    made = dmpcli.report(taught, drawn, drawn)
    assert [row["stroke"] for row in made.strokes] == [
        "demonstration",
        "trajectory",
        "trajectory 2",
    ]
    named = dmpcli.report(taught, drawn, names=("taught", "drawn"))
    assert named.document["reference"] == "taught"
    for strokes, said, words in [
        ((), {}, "no stroke to report"),
        ((taught, drawn), {"names": ("one", "one")}, "different names"),
        ((3.0,), {}, "float is no demonstration"),
        ((taught,), {"output": REFERENCE}, "is a file, -o needs"),
    ]:
        with pytest.raises(dmpcli.InputError, match=words):
            dmpcli.report(*strokes, **said)


def test_inspect_says_what_the_command_says(tmp_path, drawn):
    dmpcli.write(drawn, tmp_path / "t.parquet")
    said = json.loads(
        CliRunner().invoke(app, ["inspect", str(tmp_path / "t.parquet"), "--json"]).stdout
    )
    assert dmpcli.inspect(tmp_path / "t.parquet") == said["found"]
    assert dmpcli.inspect(drawn)["sha256"] == file_io.read(tmp_path / "t.parquet").sha256
    with pytest.raises(dmpcli.InputError, match="no such file"):
        dmpcli.inspect(tmp_path / "none")

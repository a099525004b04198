import os
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.control import demonstration_log
from dmpcli.errors import InputError, InstrumentError
from dmpcli.messages import on_terminal
from dmpcli.records import file_io, journal, record, schemas
from dmpcli.records.journal import Journal
from dmpcli.records.record import Provenance, Record
from dmpcli.records.row_buffer import RowBuffer
from dmpcli.workflows.run_output import RunOutput
from tests.control.drag_fakes import rehearse

KNOWN = Provenance("record", {"seed": 1}, (), {"simulated": True})


def recover(*arguments, code=0):
    result = CliRunner().invoke(app, ["recover", *map(str, arguments)])
    assert result.exit_code == code, (result.stderr, result.exception)
    return result


def refused(*arguments):
    lines = recover(*arguments, code=2).stderr.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


@pytest.fixture(scope="module")
def drawn():
    """A whole recording."""
    _, recorder, _ = rehearse(seed=1, duration=3.0)
    return recorder.log


def crashed(path, whole, count):
    """The journal of a recording that broke off after so many rows."""
    rows = RowBuffer(whole.groups)
    kept = Journal(path, rows, schemas.DEMONSTRATION, KNOWN)
    rows.extend(whole.whole(0, count), {})
    kept._end_thread()
    kept._write_rows()
    os.close(kept._file)
    return path


def test_the_rows_that_were_kept_are_those_of_the_whole_run_to_the_last_bit(drawn, tmp_path):
    path, out = crashed(tmp_path / "a.parquet.journal", drawn.rows, 100), tmp_path / "a.parquet"
    told = recover(path, "-o", out).stderr
    assert "100 rows, 1.98 s, as far as the journal goes" in told
    back, whole = record.decode(file_io.read(out)), drawn.columns()
    assert set(back.columns) == set(whole)
    for name, column in back.columns.items():
        assert column.tobytes() == whole[name][:100].tobytes(), name
    facts = back.provenance.facts
    assert facts["ended"] == "recovered after a crash"
    assert facts["recovered"] == {"rows": 100, "seconds": 1.98}
    assert facts["simulated"] is True
    assert back.provenance.options == {"seed": 1}
    assert path.exists()


def test_it_gives_the_same_bytes_each_time_and_pipes(drawn, tmp_path):
    path = crashed(tmp_path / "a.journal", drawn.rows, 50)
    recover(path, "-o", tmp_path / "a.parquet", "-q")
    piped = CliRunner().invoke(app, ["recover", "-", "-o", "-", "-q"], input=path.read_bytes())
    assert piped.stdout_bytes == (tmp_path / "a.parquet").read_bytes()


def test_a_broken_end_is_left_out_and_said(drawn, tmp_path):
    path = crashed(tmp_path / "a.journal", drawn.rows, 50)
    with path.open("ab") as file:
        file.write(bytes(4096))
    assert "4096 bytes of a broken end left out" in recover(path, "-o", tmp_path / "a").stderr


def test_from_the_journal_of_a_run_that_ended_the_very_file_is_made(drawn, tmp_path, monkeypatch):
    """The output's folder is full when the run ends; afterwards there is room."""
    out = tmp_path / "a.parquet"
    keeper = RunOutput(str(out), realtime=True)
    rows = RowBuffer(drawn.rows.groups)
    keeper.begin(rows, schemas.DEMONSTRATION, KNOWN)
    rows.extend(drawn.rows.whole(0, 70), {})
    facts = KNOWN.facts | {"ended": "duration", "missed": 1}
    whole = Record(
        schemas.DEMONSTRATION, demonstration_log.columns(rows), replace(KNOWN, facts=facts)
    )

    def full(path, content):
        raise InputError(f"{path}: cannot be written: No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(file_io, "write", full)
        with pytest.raises(InputError, match=r"(?s)No space left.*dmpcli recover"):
            keeper.keep(whole, None)
    os.close(keeper._journal._file)
    assert not out.exists()
    path = f"{out}.journal"
    assert "70 rows, 1.38 s, all of the run" in recover(path, "-o", out).stderr
    assert out.read_bytes() == record.encode(whole)


def test_another_failure_is_told_after_the_one_of_the_file(drawn, tmp_path, monkeypatch, capsys):
    on_terminal(quiet=False)
    keeper = RunOutput(str(tmp_path / "a"), realtime=True)
    rows = RowBuffer(drawn.rows.groups)
    keeper.begin(rows, schemas.DEMONSTRATION, KNOWN)
    rows.extend(drawn.rows.whole(0, 5), {})
    (tmp_path / "a").mkdir()
    whole = Record(schemas.DEMONSTRATION, demonstration_log.columns(rows), KNOWN)
    keeper.keep(whole, InstrumentError("the sensor is silent"))
    assert "dmpcli recover" in capsys.readouterr().err
    keeper.drop()


def test_simulated_time_has_no_journal_and_a_pipe_says_so(drawn, tmp_path, capsys):
    on_terminal(quiet=False)
    keeper = RunOutput(str(tmp_path / "a"), realtime=False)
    keeper.begin(drawn.rows, schemas.DEMONSTRATION, KNOWN)
    assert list(tmp_path.iterdir()) == []
    RunOutput("-", realtime=True).begin(drawn.rows, schemas.DEMONSTRATION, KNOWN)
    assert "no journal" in capsys.readouterr().err
    assert keeper.hindrance() is None


def test_a_journal_without_rows_another_file_and_none_are_named(drawn, tmp_path):
    empty = crashed(tmp_path / "empty.journal", drawn.rows, 0)
    assert "holds no row" in refused(empty, "-o", tmp_path / "out")
    other = tmp_path / "other.parquet"
    columns = {name: values[:5] for name, values in drawn.columns().items()}
    other.write_bytes(record.encode(Record(schemas.DEMONSTRATION, columns, KNOWN)))
    assert "is no journal of dmpcli" in refused(other, "-o", tmp_path / "out")
    assert "no such file" in refused(tmp_path / "none.journal", "-o", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_is_there_is_replaced_only_when_asked(drawn, tmp_path):
    path, out = crashed(tmp_path / "a.journal", drawn.rows, 20), tmp_path / "a.parquet"
    out.write_bytes(b"older")
    assert "--force" in refused(path, "-o", out)
    assert out.read_bytes() == b"older"
    recover(path, "-o", out, "--force")
    assert len(record.decode(file_io.read(out))) == 20


@pytest.mark.parametrize("command", ["inspect", "fit", "report", "execute"])
def test_other_commands_say_that_it_is_a_journal_and_what_to_do(drawn, tmp_path, command):
    path = crashed(tmp_path / "a.parquet.journal", drawn.rows, 20)
    other = path.rename(tmp_path / "renamed")
    for name in (crashed(path, drawn.rows, 20), other):
        extra = ["-o", tmp_path / "out"] if command in ("fit", "execute") else []
        result = CliRunner().invoke(app, [command, *map(str, (name, *extra))])
        assert result.exit_code == 2
        assert f"{name}: is the journal of a run; make its file with" in result.stderr
        assert f"'dmpcli recover {name} -o FILE'" in result.stderr


def test_the_clock_stays_in_the_journal(drawn, tmp_path):
    path, out = crashed(tmp_path / "a.journal", drawn.rows, 20), tmp_path / "a.parquet"
    recover(path, "-o", out)
    assert len(journal.read(file_io.read(path, journal=True)).rows.numbers("clock")) == 20
    assert "clock" not in record.decode(file_io.read(out)).columns


@pytest.mark.parametrize("failure", [None, InstrumentError("the arm is gone")])
def test_a_real_run_replaces_no_file_that_appeared_meanwhile(failure, drawn, tmp_path, caplog):
    out = tmp_path / "run.parquet"
    keeper = RunOutput(str(out), realtime=True, replaces=False)
    keeper.check()
    keeper.begin(drawn.rows, schemas.DEMONSTRATION, KNOWN)
    out.write_bytes(b"theirs")
    whole = Record(schemas.DEMONSTRATION, drawn.columns(), KNOWN)
    on_terminal(quiet=True)
    told = "appeared meanwhile and is not replaced; what was measured is kept in .*run-1.parquet"
    if failure is None:
        with pytest.raises(InputError, match=told):
            keeper.keep(whole, failure)
    else:
        keeper.keep(whole, failure)
    assert out.read_bytes() == b"theirs"
    kept = tmp_path / "run-1.parquet"
    assert (keeper.kept, keeper.output) == (True, str(kept))
    back = record.decode(file_io.read(kept))
    assert back.columns["x"].tobytes() == drawn.columns()["x"].tobytes()
    assert not (tmp_path / "run.parquet.journal").exists()


@pytest.mark.parametrize("force", [False, True])
def test_record_replaces_what_appeared_only_if_it_may(force, tmp_path, monkeypatch):
    from dmpcli.control import workcell
    from dmpcli.instruments import clock as clocks

    out, begin = tmp_path / "run.parquet", RunOutput.begin

    def somebody_is_faster(keeper, *rest):
        out.write_bytes(b"theirs")
        begin(keeper, *rest)

    monkeypatch.setattr(RunOutput, "begin", somebody_is_faster)
    monkeypatch.setattr(workcell, "repeatable", lambda _: False)
    monkeypatch.setattr(clocks, "MonotonicClock", clocks.SimulatedClock)
    monkeypatch.setattr("dmpcli.workflows.record.watched", lambda servo: servo)
    words = ["record", "-o", str(out), "--reference", "line", "--duration", "1.5"]
    words += ["--start", "-551", "131", "-17.56", "--goal", "-561", "131", "-17.56"]
    words += ["--force"] if force else []
    result = CliRunner().invoke(app, words)
    assert result.exit_code == (0 if force else 2), result.stderr
    assert (out.read_bytes() == b"theirs") is not force
    assert (tmp_path / "run-1.parquet").exists() is not force

"""The installed command, killed, on a full disk, and stopped by faults: what it keeps and says."""

import resource
import signal
import subprocess
import time
from pathlib import Path

import pytest

from benchmarks import soak
from dmpcli.records import file_io, record
from tests.commands.running import ended
from tests.pipeline.conftest import DMPCLI

pytestmark = pytest.mark.slow

RECORDED = Path(__file__).parents[2] / "sample_runs" / "recorded.parquet"
EASED = ("--ease-in", "0.5", "--ease-out", "0.5")

# Busy machines are late; a robot with a long look-ahead bears it.
PATIENT = ("--robot", "mock:?lag=0.2", "--following-error", "50")


def read(path):
    return record.decode(file_io.read(path))


@pytest.fixture(scope="module")
def traj(tmp_path_factory):
    """A trajectory of ten seconds."""
    folder = tmp_path_factory.mktemp("stroke")
    skill, traj = folder / "skill.json", folder / "traj.parquet"
    ended("fit", RECORDED, "-o", skill, "-q")
    ended("generalize", skill, "-o", traj, "--reproduce", *EASED, "-q")
    return traj


@pytest.mark.thorough
def test_killed_at_random_no_more_than_a_second_is_lost(tmp_path, traj):
    recordings = [([*soak.RECORD, "--seed", str(i)], soak._LEADS) for i in range(3)]
    runs = [(["execute", str(traj), *soak.EXECUTE], 0.1)] * 2
    fates = soak.soak(tmp_path, recordings + runs, at_once=3, seed=7)
    assert not soak.faults(fates), fates
    assert any(fate.rows for fate in fates)


def limited(size, *words):
    """Run the command where no file may grow beyond `size` bytes, as on a full disk."""
    return subprocess.run(
        [DMPCLI, *map(str, words)],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)),
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.thorough
def test_a_full_disk_stops_the_recording_and_keeps_what_there_is(tmp_path):
    out = tmp_path / "demo.parquet"
    done = limited(24_000, "record", "-o", out, "--realtime", *PATIENT)
    lines = done.stderr.strip().splitlines()
    assert done.returncode == 4, done.stderr
    assert "the journal cannot be written, stopped: File too large" in lines[-1]
    if out.exists():
        demo = read(out)
        assert "File too large" in demo.provenance.facts["ended"]
        assert not (tmp_path / "demo.parquet.journal").exists()
    else:
        assert "dmpcli recover" in done.stderr
        recover = subprocess.run(
            [DMPCLI, "recover", f"{out}.journal", "-o", out], capture_output=True, check=False
        )
        assert recover.returncode == 0, recover.stderr
        demo = read(out)
        assert demo.provenance.facts["ended"] == "recovered after a crash"
    assert 0.5 < demo.t[-1] < 5.0


def test_where_only_the_file_finds_no_room_the_journal_is_whole(tmp_path, traj):
    """A folder that is taken away after the journal was opened stands for it."""
    folder = tmp_path / "out"
    folder.mkdir()
    out = folder / "run.parquet"
    words = [DMPCLI, "execute", str(traj), "-o", str(out), "--realtime", "--speed", "3", *PATIENT]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:
        assert "streaming" in process.stderr.readline()
        out.mkdir()  # nothing can be renamed onto a folder
        errors = process.communicate(timeout=60)[1]
    assert process.returncode == 2, errors
    assert f"dmpcli recover {out}.journal" in errors.splitlines()[-1]
    done = subprocess.run(
        [DMPCLI, "recover", f"{out}.journal", "-o", str(tmp_path / "kept.parquet")],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "all of the run" in done.stderr
    facts = read(tmp_path / "kept.parquet").provenance.facts
    assert facts["completed"] is True
    assert "recovered" not in facts


@pytest.mark.sweep(kept=4)
@pytest.mark.parametrize(
    ("fault", "code", "words"),
    [
        ("--robot=mock:?estop_at=3", 3, "emergency stop"),
        ("--robot=mock:?refuse_at=3", 4, "refused a set-point"),
        ("--robot=mock:?speed=5", 3, "following error"),
        ("--sensor=mock:?silent_at=3", 4, "silent"),
        ("--workspace=-560 -540 100 160 -30 0", 3, "workspace"),
        ("--max-force=2.5", 3, "--max-force"),
    ],
)
@pytest.mark.parametrize("command", ["record", "execute"])
def test_the_reason_for_a_stop_is_the_last_line_and_a_fact_of_the_file(
    in_process, tmp_path, traj, command, fault, code, words
):
    name, _, value = fault.partition("=")
    options = [name, *(value.split() if name == "--workspace" else [value])]
    if command == "execute":
        options = ["--sensor", "mock:?plate=-17", *options] if name == "--max-force" else options
    given = [command, *([traj] if command == "execute" else []), "-o", "out.parquet", *options]
    last = in_process(*given, code=code).stderr.strip().splitlines()[-1]
    assert words in last
    if command == "execute" and name == "--workspace":
        assert not (tmp_path / "out.parquet").exists(), "refused before anything moved"
        return
    facts = read(tmp_path / "out.parquet").provenance.facts
    assert f"dmpcli: {facts['ended' if command == 'record' else 'reason']}" == last


@pytest.mark.parametrize("count", [1, 2])
def test_ctrl_c_ends_a_recording_and_a_second_one_at_once(tmp_path, count):
    out = tmp_path / "demo.parquet"
    words = [DMPCLI, "record", "-o", str(out), "--realtime", *PATIENT]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:
        path = tmp_path / "demo.parquet.journal"
        deadline = time.monotonic() + 60.0
        # Two writings: the recording has rows.
        while not path.exists() or path.stat().st_size < 20_000:
            assert process.poll() is None, process.stderr.read()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        for _ in range(count):
            process.send_signal(signal.SIGINT)
            time.sleep(0.01)
        errors = process.communicate(timeout=60)[1]
    assert process.returncode == 130, errors
    how = ("after braking to rest", "at once at the second signal")
    assert errors.splitlines()[-1].removeprefix("dmpcli: SIGINT: stopped ") in how[: count + 1]
    assert f"dmpcli: {read(out).provenance.facts['ended']}" == errors.splitlines()[-1]
    assert not path.exists()

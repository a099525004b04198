"""Kill `record` and `execute` with SIGKILL at random times and see what their journals have kept.

    python -m benchmarks.soak [--kills 200] [--executions 20] [--at-once 4] [--seed 1]

A run passes when its journal can be recovered and its last row is no more than one second older
than the kill. Rows carry the loop's clock, which all processes of one machine share.
"""

import argparse
import random
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dmpcli.errors import InputError
from dmpcli.records import file_io, journal, record
from dmpcli.simulation.hand import HandParameters

MOST_LOST = 1.0
"""s."""
STARTING = 60.0
"""s: a run without a journal by then has failed."""
ATTEMPTS = 5
"""A run that stops by itself before it is killed is begun again, so many times at most."""
# Before the first row, record takes the sensor's zero and its hand sets the pen down.
_LEADS = 0.5 + HandParameters().lead_in

# Machines that are busy with this are late; a robot with a long look-ahead bears it.
RECORD = ("record", "--realtime", "-q", "--robot", "mock:?lag=0.2", "--following-error", "50")
EXECUTE = RECORD[1:]


@dataclass(frozen=True)
class Fate:
    """What became of one run.

    Attributes
    ----------
    lived : float
        From the journal's beginning to the kill, s.
    rows : int
        Recovered.
    lost : float
        From the last row to the kill, s; before the first row, beyond what leads to it.
    fault : str
        What went wrong; empty where nothing did.
    early : bool
        It stopped by itself before it was killed, and its file is there.
    """

    lived: float
    rows: int
    lost: float
    fault: str = ""
    early: bool = False


def kill(command: list[str], output: Path, after: float, leads: float) -> Fate:
    """Run a command, kill it, recover its journal.

    Parameters
    ----------
    command : list of str
        Without its output.
    output : Path
        In a folder of its own.
    after : float
        From the beginning of the journal to the kill, s.
    leads : float
        How long it takes from there to the first row, s.
    """
    path = output.with_name(output.name + journal.SUFFIX)
    words = [sys.executable, "-m", "dmpcli", *command, "-o", str(output)]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + STARTING
        while not path.exists() and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.002)
        began = time.monotonic()
        time.sleep(after)
        ended = process.poll() is not None
        killed = time.monotonic()
        process.kill()
        said = process.communicate()[1].strip()
    if ended or output.exists():
        # A machine that is too busy: lateness and watchdog stop the run, which loses nothing.
        whole = output.exists() and len(record.decode(file_io.read(output))) > 0
        return Fate(killed - began, 0, np.inf, f"ended before it was killed: {said}", whole)
    try:
        found = journal.read(file_io.read(path, journal=True))
    except InputError as error:
        lost = killed - began - leads
        return Fate(killed - began, 0, lost, "" if "holds no row" in str(error) else str(error))
    done = subprocess.run(
        [sys.executable, "-m", "dmpcli", "recover", str(path), "-o", str(output), "-q"],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        return Fate(killed - began, 0, np.inf, f"recover: {done.stderr.strip()}")
    kept = record.decode(file_io.read(output))
    rows, lost = len(found.rows), killed - float(found.rows.numbers("clock")[-1])
    sound = len(kept) == rows and bool((np.diff(kept.t) > 0).all())
    return Fate(
        killed - began, rows, lost, "" if sound else "its rows are not those of the journal"
    )


def soak(
    folder: Path, commands: list[tuple[list[str], float]], at_once: int, seed: int
) -> list[Fate]:
    """Kill every one of the commands, several at once.

    Parameters
    ----------
    folder : Path
        For the outputs.
    commands : list of (list of str, float)
        Each with the time from its journal's beginning to its first row, s.
    at_once : int
    seed : int
        Of the times of the kills, 0 to 6 s.
    """
    times = random.Random(seed)
    planned = [(command, leads, times.uniform(0.0, 6.0)) for command, leads in commands]

    def one(number: int) -> Fate:
        command, leads, after = planned[number]
        for attempt in range(ATTEMPTS):
            fate = kill(command, folder / f"{number}-{attempt}.parquet", after, leads)
            if not fate.early:
                break
            print(f"not killed, once more: {fate.fault}")
        return fate

    with ThreadPoolExecutor(at_once) as pool:
        return list(pool.map(one, range(len(planned))))


def stroke(folder: Path) -> Path:
    """Make a trajectory to execute, of ten seconds."""
    names = [str(folder / name) for name in ("demo.parquet", "skill.json", "traj.parquet")]
    eased = ("--reproduce", "--ease-in", "0.5", "--ease-out", "0.5")
    for words in (
        ("record", "-o", names[0], "--seed", "1", "-q"),
        ("fit", names[0], "-o", names[1], "-q"),
        ("generalize", names[1], "-o", names[2], *eased, "-q"),
    ):
        subprocess.run([sys.executable, "-m", "dmpcli", *words], check=True)
    return Path(names[2])


def faults(fates: list[Fate]) -> list[Fate]:
    """Return those that lost more than they may, or went wrong."""
    return [fate for fate in fates if fate.fault or not fate.lost <= MOST_LOST]


def main() -> int:
    """Print a summary; 1 where any run lost more than a second."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--kills", type=int, default=200)
    options.add_argument("--executions", type=int, default=20)
    options.add_argument("--at-once", type=int, default=4)
    options.add_argument("--seed", type=int, default=1)
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        runs = [([*RECORD, "--seed", str(i)], _LEADS) for i in range(given.kills)]
        if given.executions:
            traj = str(stroke(folder))
            runs += [(["execute", traj, *EXECUTE], 0.1)] * given.executions
        fates = soak(folder, runs, given.at_once, given.seed)
    bad = faults(fates)
    lost = np.array([fate.lost for fate in fates if fate.rows])
    print(f"{len(fates)} killed, {len(lost)} with rows, {len(fates) - len(lost)} before the first")
    if len(lost):
        print(
            f"lost: median {np.median(lost):.3f} s, p99 {np.quantile(lost, 0.99):.3f} s, "
            f"most {lost.max():.3f} s (at most {MOST_LOST:g} s)"
        )
    for fate in bad:
        print(f"FAILED: {fate}")
    print("failed" if bad else "passed")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

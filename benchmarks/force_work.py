"""What the force coupling costs in each cycle, beside the plain loop: ``benchmarks.force work``.

Processor time of this thread from one set-point to the next, without what the bench computes
meanwhile, over the cycles of three strokes each, in turn; the plain loop has the same arm and no
sensor.
"""

import contextlib
import io
import logging
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import dmpcli
from benchmarks.force_cases import FORCE, TOOL, Case, displaced, said_of
from benchmarks.force_runs import planned
from dmpcli.arrays import Floats
from dmpcli.bench import driver
from dmpcli.records import file_io, record, schemas

HOWS, ROUNDS = ((False,), (True,), (True, True)), 3
"""Plain, coupled, and with the normal that is felt; how often each is measured."""


@contextlib.contextmanager
def stopwatch() -> Iterator[list[float]]:
    """Note the time at each set-point that is sent, s; the bench's own does not count."""
    went_on, sent = driver.Bench.go_on, driver.BenchDriver.send
    own, noted = [0.0], []

    def go_on(self: driver.Bench) -> None:
        begun = time.thread_time()
        went_on(self)
        own[0] += time.thread_time() - begun

    def send(self: driver.BenchDriver, target: Floats) -> bool:
        noted.append(time.thread_time() - own[0])
        return sent(self, target)

    driver.Bench.go_on, driver.BenchDriver.send = go_on, send  # type: ignore[method-assign]
    try:
        yield noted
    finally:
        driver.Bench.go_on, driver.BenchDriver.send = went_on, sent  # type: ignore[method-assign]


def cycles(arm: str, coupled: bool, used: bool = False) -> Floats:
    """Time of each cycle of the stroke, s; `used` is the normal that is felt."""
    logging.disable(logging.CRITICAL)
    case = Case("", bench=displaced(0.0), arm=arm)
    url = f"bench://{arm}?" + "&".join(f"{key}={value}" for key, value in said_of(case, 0).items())
    more: dict[str, Any] = {"sensor": f"bench://{arm}", "coupling": "force"} if coupled else {}
    if coupled:
        more |= {"force_setpoint": FORCE, "normal_from_force": used}
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.redirect_stderr(io.StringIO()),
        stopwatch() as noted,
    ):
        out = Path(folder) / "run.parquet"
        dmpcli.execute(planned("plane", 0.0), out, robot=url, tool=TOOL, approach=20.0, **more)
        log = record.decode(file_io.read(out), schemas.RUN)
    drawn = np.flatnonzero(np.asarray(log.columns["phase"]) == "stroke")
    each: Floats = np.diff(noted)[drawn[0] : drawn[-1]]
    return each


def main() -> None:
    """Print what a cycle costs."""
    print("\n## work: median (95 % of all) of a cycle of the stroke, ms of one core\n")
    print("| arm | plain | coupled | beyond | --normal-from-force | beyond |")
    print("| --- |" + " ---: |" * 5)
    for arm in ("ec66", "ur5e"):
        # In turn: a machine is not as quick all the time.
        rounds = [[cycles(arm, *how) for how in HOWS] for _ in range(ROUNDS)]
        each = [1e3 * np.concatenate(one) for one in zip(*rounds, strict=True)]
        plain, coupled, used = (np.median(one) for one in each)
        said = [f"{np.median(one):.3f} ({np.quantile(one, 0.95):.3f})" for one in each]
        print(
            f"| {arm} | {said[0]} | {said[1]} | {coupled - plain:.3f} | {said[2]} "
            f"| {used - plain:.3f} |",
            flush=True,
        )

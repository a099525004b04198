"""How much later the loops of `record` and `execute` wake while somebody watches.

    python -m benchmarks.live_view [--block 30] [--blocks 5] [--rates 50 250]

Blocks with and without the live view take turns; the view draws on a pseudo-terminal that a process
of its own reads. Each block has a p99 of its waking; the median of the blocks with the view may be
at most a tenth more than of those without, or 20 µs where that is more: the clock's own steps.
Where other programs keep the processors busy, ``chrt -f 10 python -m benchmarks.live_view`` lets
the loops go first, as on a robot's computer; the view stands back there as ever.
"""

import argparse
import contextlib
import os
import pty
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import numpy as np

from benchmarks.lateness import ROBOT, Measured, Place, executing, recording
from dmpcli.arrays import Floats
from dmpcli.control import watching
from dmpcli.control.cycle import ControlLoop
from dmpcli.control.drag_loop import Recorder
from dmpcli.control.servo_loop import PlanLoop
from dmpcli.errors import DmpError
from dmpcli.simulation.mock import PEN

STEP = 2e-5


@contextlib.contextmanager
def viewed() -> Iterator[None]:
    """Have every loop that runs meanwhile watched."""
    run = ControlLoop._run

    def watch(loop: ControlLoop) -> tuple[str, DmpError | None]:
        if isinstance(loop, PlanLoop):
            view = watching.of_plan(loop)
        else:
            assert isinstance(loop, Recorder)
            view = watching.RunView("recording", loop.log.rows, loop._period)
        with watching.live(lambda: view, True) as ended:
            found = run(loop)
            ended("its time was over")
        return found

    screen, side = pty.openpty()
    reader = subprocess.Popen(["cat"], stdin=screen, stdout=subprocess.DEVNULL)
    kept = os.dup(2)
    os.dup2(side, 2)
    try:
        with (
            mock.patch.object(watching, "watched", return_value=True),
            mock.patch.object(ControlLoop, "_run", watch),
        ):
            yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        reader.kill()
        reader.wait()
        os.close(screen)
        os.close(side)


def main() -> int:
    """Print the figures; 1 where one is missed."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--block", type=float, default=30.0, metavar="S")
    options.add_argument("--blocks", type=int, default=5, metavar="N", help="of each kind")
    options.add_argument("--rates", type=float, nargs="+", default=[50.0, 250.0], metavar="HZ")
    given = options.parse_args()
    at, passed = Place(ROBOT, "mock:", PEN), True
    with tempfile.TemporaryDirectory() as name:
        for rate in given.rates:
            for command, ours in (("record", recording), ("execute", executing)):
                runs: dict[bool, list[Measured]] = {False: [], True: []}
                for block in range(2 * given.blocks):
                    seen = block % 2 == 1
                    with viewed() if seen else contextlib.nullcontext():
                        runs[seen].append(ours(1.0 / rate, given.block, Path(name), at))
                passed &= _judge(f"{command} at {rate:g} Hz", _woke(runs[False]), _woke(runs[True]))
    print("passed" if passed else "failed")
    return 0 if passed else 1


def _woke(runs: list[Measured]) -> list[Floats]:
    return [np.array(timing.wake) for timing, _ in runs]


def _judge(what: str, alone: list[Floats], watched: list[Floats]) -> bool:
    print(f"{what}, {len(alone)} blocks of each")
    p99 = {}
    for name, blocks in (("alone", alone), ("watched", watched)):
        each = np.array([np.quantile(late, 0.99) for late in blocks])
        median, worst = 1e3 * np.quantile(np.concatenate(blocks), [0.5, 1.0])
        p99[name] = float(np.median(each))
        least, most = 1e3 * each.min(), 1e3 * each.max()
        print(
            f"  {name:8s} p50 {median:6.3f}  p99 {1e3 * p99[name]:6.3f} "
            f"({least:.3f} to {most:.3f})  worst {worst:7.3f} ms"
        )
    before, after = p99["alone"], p99["watched"]
    good = after <= max(1.1 * before, before + STEP)
    print(f"  p99 {100 * (after / before - 1):+.1f} %: {'yes' if good else 'NO'}", flush=True)
    return good


if __name__ == "__main__":
    sys.exit(main())

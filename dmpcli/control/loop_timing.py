"""How punctual a loop is, and what keeps it so: nothing else runs in its cycles that can wait."""

import gc
import sys
from array import array
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

# A thread that wants to run waits so long for one that computes, s; by default it is 5 ms.
_SWITCH = 2e-4


class LoopTiming:
    """When the cycles of a loop woke, sent their set-points and had done their work.

    Attributes
    ----------
    wake, lateness, work : array of float
        Per cycle, s: from the deadline to the waking, from the deadline to the set-point's being
        sent, and from the waking to the end of all that the cycle did.
    missed : int
        Deadlines that passed without a cycle.
    """

    def __init__(self) -> None:
        self.wake, self.lateness, self.work = array("d"), array("d"), array("d")
        self.missed = 0

    def add(self, due: float, woke: float, sent: float, done: float) -> None:
        """Remember one cycle.

        Parameters
        ----------
        due, woke, sent, done : float
            s, on the loop's clock.
        """
        # Rounding may say that it was earlier.
        self.wake.append(max(woke - due, 0.0))
        self.lateness.append(max(sent - due, 0.0))
        self.work.append(done - woke)

    def facts(self) -> dict[str, dict[str, float] | int]:
        """Return median, 99th percentile and maximum of each, s; nothing before the first cycle."""
        if not self.wake:
            return {}
        from dmpcli.metrics.timing import spread  # a run in simulated time needs none

        measured = {"wake": self.wake, "lateness": self.lateness, "work": self.work}
        spreads = {name: spread(np.array(values)) for name, values in measured.items()}
        return spreads | {"missed": self.missed}

    def __str__(self) -> str:
        """Say it in one line."""
        if not self.wake:
            return "no cycle ran"
        from dmpcli.metrics.timing import spread

        late, work = spread(np.array(self.lateness)), spread(np.array(self.work))
        return (
            f"set-points {1e3 * late['p50']:.2f} ms late (median), {1e3 * late['p99']:.2f} (p99), "
            f"{1e3 * late['max']:.2f} (worst); work {1e3 * work['p50']:.2f} ms a cycle (median); "
            f"{self.missed} of {len(self.wake) + self.missed} periods missed"
        )


@contextmanager
def undisturbed() -> Iterator[None]:
    """Keep Python's own housekeeping out of a loop: no garbage collection, quick thread switches.

    What is there already is set aside, so that no later collection walks through it either.
    """
    collecting, interval = gc.isenabled(), sys.getswitchinterval()
    gc.disable()
    gc.freeze()
    sys.setswitchinterval(_SWITCH)
    try:
        yield
    finally:
        sys.setswitchinterval(interval)
        gc.unfreeze()
        if collecting:
            gc.enable()

"""Lines that stop where nothing was logged: no line joins what nobody saw in between."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from dmpcli.arrays import Booleans, Floats

LONG = 3.0
"""A step in time so many times as long as the usual one is a gap."""


def usual_step(t: Floats) -> float:
    """Return the median step of times that go on, s; 0 where none does."""
    steps = np.diff(t)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if len(steps) else 0.0


def gaps(t: Floats) -> Booleans:
    """Tell after which samples nothing was logged for a while.

    Parameters
    ----------
    t : array, shape (n,)
        s.

    Returns
    -------
    array of bool, shape (n - 1,)
    """
    made: Booleans = np.diff(t) > LONG * usual_step(t)
    return made


def line(axes: Axes, x: Floats, y: Floats, apart: Booleans, **style: Any) -> None:
    """Draw a line that is broken at gaps and where it has no value; what stands alone is a dot.

    Parameters
    ----------
    axes : Axes
    x, y : array, shape (n,)
    apart : array of bool, shape (n - 1,)
        As of `gaps`.
    **style
        ``color``, ``lw`` and what else `Axes.plot` takes.
    """
    known = np.isfinite(y)
    joined = known[1:] & known[:-1] & ~apart
    alone = known & ~(np.append(False, joined) | np.append(joined, False))
    at = np.flatnonzero(apart) + 1
    axes.plot(np.insert(x, at, np.nan), np.insert(y, at, np.nan), **style)
    if alone.any():
        dot = style.get("lw", 1.0) + 1.0
        more = {key: style[key] for key in ("color", "zorder") if key in style}
        axes.plot(x[alone], y[alone], ls="", marker=".", ms=2.0 * dot, **more)

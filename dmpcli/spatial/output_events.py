"""Outputs of a controller that are switched along a stroke: asked for by place, placed in time.

``on@12.5mm:DO1`` switches DO1 on where the tool has gone 12.5 mm of its path; the place may also
be ``start``, ``end``, ``lift`` (each time the tool leaves the work within the stroke) or ``touch``
(each time it is back on it).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError

LIFTED = 1.0
"""A tool this far off the work, mm, is lifted; nearer, it may be drawn on it."""

MOST = 100
"""Events that may be asked for."""

_NUMBER = r"(?:\d+\.?\d*|\.\d+)"
_NAME = r"[A-Za-z][A-Za-z0-9_]{0,31}"
_ASKED = re.compile(rf"(on|off)@(start|end|lift|touch|({_NUMBER})mm):({_NAME})", re.ASCII)
_STORED = re.compile(rf"(on|off) ({_NAME})(?: \+({_NUMBER}(?:e-?\d+)?))?", re.ASCII)

Place = Literal["start", "end", "lift", "touch", "distance"]


@dataclass(frozen=True)
class OutputEvent:
    """One output is switched.

    Attributes
    ----------
    t : float
        s, on the stroke's own time.
    output : str
    on : bool
    """

    t: float
    output: str
    on: bool

    @property
    def deed(self) -> str:
        """What is done, in words: on DO1."""
        return f"{'on' if self.on else 'off'} {self.output}"


@dataclass(frozen=True)
class AskedEvent:
    """What is asked for.

    Attributes
    ----------
    on : bool
    place : str
    distance : float
        Along the path, mm, where the place is one.
    output : str
    """

    on: bool
    place: Place
    distance: float
    output: str

    def __str__(self) -> str:
        """Return it as it is asked for."""
        where = f"{self.distance:g}mm" if self.place == "distance" else self.place
        return f"{'on' if self.on else 'off'}@{where}:{self.output}"


def asked(texts: Sequence[str]) -> tuple[AskedEvent, ...]:
    """Read events as an option says them.

    Raises
    ------
    InputError
        One of them is none, is there twice, or there are too many.
    """
    found: list[AskedEvent] = []
    for text in texts:
        match = _ASKED.fullmatch(text)
        if match is None:
            raise InputError(
                f"--event {text}: must be on or off, a place and an output, as in on@12.5mm:DO1; "
                "places are start, end, lift, touch, and mm along the path"
            )
        place: Place = "distance" if match[3] else match[2]  # type: ignore[assignment]
        one = AskedEvent(match[1] == "on", place, float(match[3] or 0.0), match[4])
        if one in found:
            raise InputError(f"--event {text}: is given twice")
        found.append(one)
    if len(found) > MOST:
        raise InputError(f"--event: {len(found)} of them; {MOST} are the most")
    return tuple(found)


class NotPlacedError(Exception):
    """An event has no place on a stroke; the text says why."""


def placed(
    events: Sequence[AskedEvent], t: Floats, position: Floats, height: Floats | None
) -> tuple[OutputEvent, ...]:
    """Find when a stroke is where its outputs are to be switched.

    Parameters
    ----------
    events : sequence of AskedEvent
    t : array, shape (T,)
        s.
    position : array, shape (T, 3)
        mm.
    height : array, shape (T,), or None
        Over the work, mm; needed for ``lift`` and ``touch``.

    Returns
    -------
    tuple of OutputEvent
        By time; at one time in the order in which they were asked for.

    Raises
    ------
    NotPlacedError
    """
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))])
    found: list[OutputEvent] = []
    for one in events:
        if one.place == "distance":
            if one.distance > gone[-1]:
                raise NotPlacedError(f"{one}: the path ends after {gone[-1]:.3f} mm")
            times = [float(np.interp(one.distance, gone, t))]
        elif one.place in ("start", "end"):
            times = [float(t[0] if one.place == "start" else t[-1])]
        else:
            times = _crossings(t, height, up=one.place == "lift")
            if not times:
                raise NotPlacedError(f"{one}: the tool is nowhere lifted by over {LIFTED:g} mm")
        found += [OutputEvent(when, one.output, one.on) for when in times]
    return tuple(sorted(found, key=lambda event: event.t))


def _crossings(t: Floats, height: Floats | None, up: bool) -> list[float]:
    """When the tool leaves the work, or is back on it, s."""
    if height is None:
        return []
    before, after = height[:-1], height[1:]
    crosses = (before <= LIFTED) & (after > LIFTED) if up else (before > LIFTED) & (after <= LIFTED)
    at = np.flatnonzero(crosses)
    share = (LIFTED - before[at]) / (after[at] - before[at])
    return [float(when) for when in t[at] + share * (t[at + 1] - t[at])]


def stored(events: Sequence[OutputEvent], t: Floats) -> list[str | None]:
    """Return the column of a file, one text a row: what is switched from there to the next row.

    Parameters
    ----------
    events : sequence of OutputEvent
        By time.
    t : array, shape (T,)
        Of the rows, s.

    Returns
    -------
    list of str or None
        ``on DO1 +0.0123; off DO2``: seconds after the row, where it is not at the row itself.
    """
    column: list[str | None] = [None] * len(t)
    for event in events:
        row = int(np.clip(np.searchsorted(t, event.t, side="right") - 1, 0, len(t) - 1))
        after = event.t - float(t[row])
        text = event.deed + (f" +{after:.9g}" if after > 1e-12 else "")
        before = column[row]
        column[row] = text if before is None else f"{before}; {text}"
    return column


def read(column: Sequence[str | None], t: Floats) -> tuple[OutputEvent, ...]:
    """Return the events of a file's column; see `stored`.

    Raises
    ------
    NotPlacedError
        A text is none of an event, or comes after the next row; names the row from 1.
    """
    found = []
    for row, text in enumerate(column):
        for part in text.split("; ") if text else ():
            match = _STORED.fullmatch(part)
            after = float(match[3] or 0.0) if match else 0.0
            last = row + 1 == len(t)
            if match is None or (after > 0.0 if last else after > t[row + 1] - t[row] + 1e-9):
                raise NotPlacedError(
                    f"row {row + 1}: {part[:40]!r} is not such as 'on DO1 +0.005', seconds after "
                    "the row and before the next"
                )
            found.append(OutputEvent(float(t[row]) + after, match[2], match[1] == "on"))
    return tuple(sorted(found, key=lambda event: event.t))

"""What goes wrong in the virtual lab on demand, and how what is not known of a real one behaves.

One specification is ``KIND``, ``KIND=VALUE``, ``KIND@T`` or ``KIND=VALUE@T``. T is in s after the
arm first entered servo mode, for the sensor's faults after it first streamed; without T a fault is
there from the beginning.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from dmpcli.errors import InputError
from dmpcli.simulation.elite_server.behaviour import Behaviour
from dmpcli.simulation.elite_server.controller import AUTO, TEACH

SHARES = ("loss", "duplicate", "reorder", "malformed")
"""Shares of the sensor's datagrams, 0 to 1."""

_MODES = {"teach": TEACH, "play": AUTO}

CHOICES = {
    "underrun": ("hold", "decelerate", "alarm"),
    "jump": ("alarm", "ignore", "clamp"),
    "euler": ("xyz", "zyx"),
    "newline": ("no", "yes"),
}
"""How the controller behaves where nobody could tell; the first of each is the default."""

_VALUES = {"mode": tuple(_MODES), "drop": ("both", "robot", "monitor")} | CHOICES

_EVENTS = ("estop", "collision", "mode", "refuse", "drop")
_SENSOR_EVENTS = ("silence", "saturation")

KINDS = (*SHARES, *_SENSOR_EVENTS, *_EVENTS, *CHOICES)


@dataclass(frozen=True)
class Event:
    """Something that happens to the controller.

    Attributes
    ----------
    kind : str
        ``estop``, ``collision``, ``mode``, ``refuse`` or ``drop``.
    at : float or None
        s after servo mode was first entered; None: from the beginning.
    value : str or int
        The mode switched to, or whose connections drop.
    """

    kind: str
    at: float | None
    value: str | int = ""


@dataclass(frozen=True)
class LabFaults:
    """What several specifications say together.

    Attributes
    ----------
    events : tuple of Event
    habits : Behaviour
    shares : dict
        By the names of `SHARES`.
    silence, saturation : float
        When the sensor falls silent, and when it saturates, s after it first streamed; infinite is
        never.
    """

    events: tuple[Event, ...] = ()
    habits: Behaviour = field(default_factory=Behaviour)
    shares: dict[str, float] = field(default_factory=dict)
    silence: float = math.inf
    saturation: float = math.inf


def parse(specifications: Iterable[str]) -> LabFaults:
    """Read specifications.

    Raises
    ------
    InputError
        One of them is not understood, or stands twice.
    """
    faults = LabFaults()
    seen: set[str] = set()
    for text in specifications:
        kind, value, at = _split(text)
        if kind in seen:
            raise InputError(f"--fault {text}: {kind} is given twice")
        seen.add(kind)
        faults = _with(faults, text, kind, value, at)
    return faults


def _split(text: str) -> tuple[str, str | None, float | None]:
    head, has_time, time = text.partition("@")
    kind, has_value, value = head.partition("=")
    if kind not in KINDS:
        raise InputError(f"--fault {text}: no such fault; there are {', '.join(KINDS)}")
    at = _number(text, time, "after @", 0.0, math.inf, "s") if has_time else None
    return kind, value if has_value else None, at


def _with(
    faults: LabFaults, text: str, kind: str, value: str | None, at: float | None
) -> LabFaults:
    if kind in SHARES:
        _need_no_time(text, at)
        share = _number(text, value or "", f"after {kind}=", 0.0, 1.0, "")
        return replace(faults, shares=faults.shares | {kind: share})
    if kind in CHOICES:
        _need_no_time(text, at)
        if value is None:
            raise InputError(f"--fault {text}: say which: {kind}={'|'.join(CHOICES[kind])}")
        return replace(faults, habits=_habit(faults.habits, kind, _chosen(text, kind, value)))
    if value is not None and kind not in _VALUES:
        raise InputError(f"--fault {text}: {kind} takes no value, only a time: {kind}@T")
    if kind == "silence":
        return replace(faults, silence=at or 0.0)
    if kind == "saturation":
        return replace(faults, saturation=at or 0.0)
    chosen: str | int = _chosen(text, kind, value) if kind in _VALUES else ""
    if kind == "mode":
        chosen = _MODES[str(chosen)]
    if kind == "drop" and at is None:
        raise InputError(f"--fault {text}: say when the connection drops: {kind}@T")
    return replace(faults, events=(*faults.events, Event(kind, at, chosen)))


def _chosen(text: str, kind: str, value: str | None) -> str:
    choices = _VALUES[kind]
    if value is None:
        return choices[0]
    if value not in choices:
        raise InputError(f"--fault {text}: {kind} is one of {', '.join(choices)}")
    return value


def _habit(habits: Behaviour, kind: str, value: str) -> Behaviour:
    if kind == "newline":
        return replace(habits, newline=value == "yes")
    chosen: dict[str, object] = {kind: value}
    if kind == "euler":
        return replace(habits, **chosen)  # type: ignore[arg-type]
    return replace(habits, policies=replace(habits.policies, **chosen))  # type: ignore[arg-type]


def _need_no_time(text: str, at: float | None) -> None:
    if at is not None:
        raise InputError(f"--fault {text}: holds from the beginning; leave @ out")


def _number(text: str, word: str, where: str, low: float, high: float, unit: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and low <= value <= high):
        most = f"{low:g} to {high:g}" if math.isfinite(high) else f"{low:g} or more"
        raise InputError(f"--fault {text}: {where} a number is needed, {most} {unit}".rstrip())
    return value

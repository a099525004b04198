"""Points that the tool's tip touches, taken at rest: at each Enter, or in even times."""

from collections.abc import Callable

from dmpcli.calibration.by_hand import MOVES, Keyboard, enters
from dmpcli.calibration.resting import Watcher, at_rest
from dmpcli.control.signals import Interruption
from dmpcli.errors import RefusedError, counted
from dmpcli.instruments.protocols import Clock
from dmpcli.records.points import PointFile
from dmpcli.records.static_poses import StaticPose

SETTLE, DWELL = 0.2, 0.2
"""s at rest before a point, and s over which it is averaged."""

# How long a tool that still moves is waited for.
_PATIENCE_BY_HAND, _PATIENCE = 0.6, 10.0


def by_hand(
    watcher: Watcher,
    keyboard: Keyboard,
    points: PointFile,
    most: int | None,
    interruption: Interruption,
    say: Callable[[str], None],
) -> None:
    """Take a point at each Enter, until q, `most` points, or a signal.

    Parameters
    ----------
    watcher : Watcher
    keyboard : Keyboard
    points : PointFile
    most : int or None
    interruption : Interruption
    say : callable
        Tells the person how it stands.

    Raises
    ------
    InstrumentError
        The robot fails.
    """
    say(f"touch {points.next}; Enter takes it, q and Enter ends")

    def asked() -> bool:
        return interruption.count > 0 or _enough(points, most)

    for _ in enters(keyboard, watcher.look, asked):
        point = _take(watcher, _PATIENCE_BY_HAND, asked)
        if point is None:
            say(MOVES)
            continue
        _keep(points, point, most, say)


def in_time(
    watcher: Watcher,
    clock: Clock,
    every: float,
    most: int | None,
    points: PointFile,
    interruption: Interruption,
    say: Callable[[str], None],
) -> None:
    """Take a point every so many seconds; a tool that moves then is waited for.

    Parameters
    ----------
    watcher : Watcher
    clock : Clock
    every : float
        s.
    most : int or None
        How many points; None for all of the part's.
    points : PointFile
    interruption : Interruption
    say : callable

    Raises
    ------
    RefusedError
        The tool does not come to rest.
    InstrumentError
        The robot fails.
    """

    def asked() -> bool:
        return interruption.count > 0

    begin = clock.now()
    while not asked() and not _enough(points, most):
        while clock.now() < begin + (points.count + 1) * every - 1e-9 and not asked():
            watcher.look()
        last, point = clock.now() + _PATIENCE, None
        while point is None and clock.now() < last and not asked():
            # It may set off again while the point is read.
            point = _take(watcher, last - clock.now(), asked)
        if point is not None:
            _keep(points, point, most, say)
        elif not asked():
            raise RefusedError(
                f"{points.next}: the tool still moves after {_PATIENCE:g} s; "
                f"{counted(points.count, 'point')} kept"
            )


def _take(watcher: Watcher, patience: float, asked: Callable[[], bool]) -> StaticPose | None:
    if not watcher.rests(SETTLE, patience, asked):
        return None
    point = watcher.dwell(DWELL)
    return point if at_rest(point.moved, point.turned) else None


def _keep(
    points: PointFile, point: StaticPose, most: int | None, say: Callable[[str], None]
) -> None:
    taken = points.next
    points.add(point.position, point.rotation)
    x, y, z = point.position
    following = "" if _enough(points, most) else f"; now {points.next}"
    say(f"{taken}: {x:.3f} {y:.3f} {z:.3f}{following}")


def _enough(points: PointFile, most: int | None) -> bool:
    return points.full or (most is not None and points.count >= most)

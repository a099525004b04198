"""How an arm was left: told to stop and seen at rest, or not; nothing that is told outranks that.

A stop that is acknowledged is only a promise. So the arm is watched after it, until the states that
it sends from then on show it at rest; where they do not, or it could not be told at all, the person
beside it must hear of it last and by itself, whatever else went wrong before.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

from dmpcli.control import guards
from dmpcli.control.settling import RestWindow
from dmpcli.errors import DmpError, UnconfirmedStopError
from dmpcli.instruments.protocols import Clock, Servo

WINDOW = 0.2
"""s: an arm that was told to stop must stand still for so long before it is said to rest."""

PATIENCE = 2.0
"""s that it may take to be seen so."""

_STEP = 0.01
_PRESS = "press its emergency stop"


@dataclass(frozen=True)
class StopOutcome:
    """How an arm was left.

    Attributes
    ----------
    kind : str
        Stopped and seen ``at rest``; told to stop, but ``not seen at rest``; or ``not told``.
    why : str
        What kept it from being seen, or told.
    defect : Exception or None
        Where that is one of the program or of a driver.
    """

    kind: Literal["at rest", "not seen at rest", "not told"]
    why: str = ""
    defect: Exception | None = None

    @property
    def confirmed(self) -> bool:
        """Whether the arm stands."""
        return self.kind == "at rest"

    def __str__(self) -> str:
        """Say it in one line; empty where all is well."""
        if self.confirmed:
            return ""
        remedy = "" if _PRESS in self.why else f"; {_PRESS}"
        if self.kind == "not told":
            return f"THE ARM MAY STILL MOVE: it could not be told to stop: {self.why}{remedy}"
        return (
            "THE ARM MAY STILL MOVE: it was told to stop, and was not seen at rest: "
            f"{self.why}{remedy}"
        )

    def facts(self) -> dict[str, Any]:
        """Return what a file says of it: nothing of an arm that stands."""
        return {} if self.confirmed else {"stop": {"outcome": self.kind, "why": self.why}}

    def error(self, before: str = "") -> UnconfirmedStopError:
        """Return what a command ends with where the arm may still move: what it says comes last.

        Parameters
        ----------
        before : str
            What had ended the motion.
        """
        made = UnconfirmedStopError(f"{before}\n{self}" if before else str(self))
        made.__cause__ = self.defect
        return made


AT_REST = StopOutcome("at rest")
"""Of an arm that stands, or was never moved."""


def stop(
    servo: Servo, clock: Clock, watch: bool = True, then: Callable[[], None] = lambda: None
) -> StopOutcome:
    """Stop an arm, and watch it until it rests; raises nothing.

    Parameters
    ----------
    servo : Servo
    clock : Clock
    watch : bool
        Whether it has to be seen: not one that was never moved, nor one that was seen at rest.
    then : callable
        Called as soon as it was told, or could not be; raises nothing.
    """
    failed = _told(servo)
    then()
    if failed is not None:
        return failed
    return _seen(servo, clock) if watch else AT_REST


def _told(servo: Servo) -> StopOutcome | None:
    """Tell an arm to stop; None where that went well."""
    try:
        servo.stop()
    except DmpError as failure:
        return StopOutcome("not told", str(failure))
    except Exception as defect:
        return StopOutcome("not told", _words(defect), defect)
    return None


def _seen(servo: Servo, clock: Clock) -> StopOutcome:
    begun, window = clock.now(), RestWindow(WINDOW)
    outcome = StopOutcome("not seen at rest", "it tells nothing new of where it is")
    while clock.now() - begun <= PATIENCE:
        try:
            state = servo.state()
            guards.check_pose(state)
            if state.t >= begun and window.rests(state) and not state.busy:
                return AT_REST
            if state.t >= begun:
                busy = ", and its controller is in motion" if state.busy else ""
                outcome = StopOutcome("not seen at rest", f"{window.moved}{busy}")
        except DmpError as failure:
            outcome = StopOutcome("not seen at rest", str(failure))
        except Exception as defect:
            return StopOutcome("not seen at rest", _words(defect), defect)
        clock.sleep_until(clock.now() + _STEP)
    return outcome


def _words(defect: Exception) -> str:
    return f"{type(defect).__name__}: {defect}"


@contextmanager
def outranking(known: Callable[[], StopOutcome]) -> Iterator[None]:
    """Let no other failure stand before an arm that may still move.

    Parameters
    ----------
    known : callable
        Returns how the arm was left, so far as that is known.

    Raises
    ------
    UnconfirmedStopError
        Anything was raised while the arm may still move; what it was stands before, or its
        traceback does.
    """
    try:
        yield
    except UnconfirmedStopError:
        raise
    except BaseException as error:
        outcome = known()
        if outcome.confirmed:
            raise
        raise outcome.error(str(error) if isinstance(error, DmpError) else "") from error

"""A second pair of eyes: a thread that stops the arm when the loop does not come round.

The loop's own guard sees a late cycle once it wakes; this one sees that it does not wake. It is the
last resort but one: a controller that gets no set-points has its own way to stop, and the emergency
stop stands above both. It cannot act while the whole process is held up.

All calls of the arm go through one lock, so that the watchdog never speaks into another call. Where
the loop hangs within a call, only an arm that can be halted beside it is stopped: see `Halting`.
"""

import threading
import time
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from dmpcli.arrays import Floats
from dmpcli.errors import InstrumentError, beside
from dmpcli.instruments.protocols import (
    DragTeaching,
    OutputSwitching,
    RobotState,
    Servo,
    ServoInfo,
)

LONGEST = 5
"""Periods, or one look-ahead if that is longer, after which the loop counts as hung."""

_REMEDY = "use a quieter computer or a longer lookahead"

_PATIENCE = 10.0
"""s that a loop which comes round waits to hear whether its arm was stopped meanwhile."""


@runtime_checkable
class Halting(Protocol):
    """What an arm offers besides `Servo` if it can be stopped while another call of it hangs."""

    def halt(self) -> bool:
        """Stop the arm now, by whatever way does not wait for the call that hangs.

        It is called from another thread; a connection of its own will do, or the closing of the
        one that hangs. False where there is no such way.
        """


class Watchdog:
    """A servo that is stopped when nobody asks for its state in time.

    Parameters
    ----------
    servo : Servo
    """

    def __init__(self, servo: Servo) -> None:
        self._servo = servo
        self._lock = threading.Lock()
        self._done = threading.Event()
        self._thread: threading.Thread | None = None
        self._barked = ""  # why the arm is being stopped, and then how that ended
        self._settled = threading.Event()
        self._lookahead = self._limit = self._seen = 0.0
        self._outputs: list[str] = []  # that are on

    def open(self) -> ServoInfo:
        """Connect."""
        info = self._servo.open()
        self._lookahead = info.lookahead
        return info

    def state(self) -> RobotState:
        """Return the actual pose and mode now; this is how the loop shows that it is there.

        Raises
        ------
        InstrumentError
            The loop was away too long; the text says whether the arm was stopped. Not once the
            loop has stopped it too: then only what the arm itself tells counts.
        """
        self._check()
        now = time.monotonic()
        away, self._seen = now - self._seen, now
        try:
            with self._lock:
                state = self._servo.state()
        except InstrumentError as error:
            self._check()
            if self._thread is None or away <= self._limit:
                raise
            # What it heard last is old because nobody was there to hear: not its fault.
            raise InstrumentError(f"{self._late(away)}; {_REMEDY} ({error})") from None
        self._check()
        return state

    def start(self, period: float) -> None:
        """Enter servo mode, and watch from now on."""
        with self._lock:
            self._servo.start(period)
        self._limit = max(LONGEST * period, self._lookahead)
        self._seen = time.monotonic()
        self._done.clear()
        self._thread = threading.Thread(target=self._watch, name="watchdog", daemon=True)
        self._thread.start()

    def send(self, position: Floats, rotation: Floats) -> bool:
        """Send one set-point; none after the arm was stopped."""
        self._check()
        with self._lock:
            # Not waited for in here: the watchdog may wait for the lock.
            if not self._barked:
                return self._servo.send(position, rotation)
        self._check()
        return False

    def stop(self) -> None:
        """Leave servo mode and stand still at once; the watch is over."""
        self._end()
        with self._lock:
            self._servo.stop()

    def close(self) -> None:
        """Disconnect; stops first."""
        self._end()
        with self._lock:
            self._servo.close()

    def _end(self) -> None:
        self._done.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _check(self) -> None:
        if self._barked and not self._done.is_set():
            self._settled.wait(_PATIENCE)
            raise InstrumentError(self._barked)

    def _watch(self) -> None:
        while not self._done.wait(self._limit / 4.0):
            away = time.monotonic() - self._seen
            if away > self._limit:
                why = self._late(away)
                # First, so that no set-point follows the stop.
                self._barked = f"{why}; the arm is being stopped: watch it, and its emergency stop"
                self._bark(why)
                return

    def _late(self, away: float) -> str:
        late = beside(away, self._limit, ".2f")
        return f"watchdog: the loop did not come round for {late} s, over {self._limit:g} s"

    def _bark(self, why: str) -> None:
        """Stop the arm; what fails is tried again until the loop is back, which then does it."""
        while True:
            failure = self._stop()
            if not failure:
                self._barked = f"{why}; the arm was stopped; {_REMEDY}"
            else:
                remedy = "" if "emergency stop" in failure else "; press its emergency stop"
                self._barked = f"{why}; the arm could NOT be stopped: {failure}{remedy}"
            self._settled.set()
            if not failure or self._done.wait(self._limit):
                return

    def _stop(self) -> str:
        """Try to stop the arm; return why it was not, empty where it was."""
        # A call that only takes long ends in this time; one that hangs does not.
        free = self._lock.acquire(timeout=self._limit)
        try:
            if free:
                self._servo.stop()
                self._switch_off()
            elif not (isinstance(self._servo, Halting) and self._servo.halt()):
                return "a call of it hangs, and there is no way beside that"
        except Exception as error:  # a defect must not end the watch either
            return str(error)
        finally:
            if free:
                self._lock.release()
        return ""

    def _switch_off(self) -> None:
        for name in list(self._outputs):
            self._servo.switch(name, False)  # type: ignore[attr-defined]
            self._outputs.remove(name)


class _Switches(Watchdog):
    def check_output(self, name: str) -> None:
        """Make sure that there is an output of this name."""
        self._servo.check_output(name)  # type: ignore[attr-defined]

    def switch(self, name: str, on: bool) -> None:
        """Switch an output; nothing on after the arm was stopped."""
        if on:
            self._check()
        with self._lock:
            if on and self._barked:
                return
            if on and name not in self._outputs:
                self._outputs.append(name)
            self._servo.switch(name, on)  # type: ignore[attr-defined]
            if not on and name in self._outputs:
                self._outputs.remove(name)


class _Drags(Watchdog):
    def drag(self) -> None:
        """Hand the arm over to its own drag teaching, in which no set-points are awaited."""
        with self._lock:
            self._servo.drag()  # type: ignore[attr-defined]


class _Plays(Watchdog):
    def upload(
        self, position: Floats, rotation: Floats, period: float, meanwhile: Callable[[], None]
    ) -> None:
        """Hand over a whole plan; nothing moves, and it may take its time."""
        with self._lock:
            self._servo.upload(position, rotation, period, meanwhile)  # type: ignore[attr-defined]
        self._seen = time.monotonic()

    def play(self) -> None:
        """Begin to move."""
        with self._lock:
            self._servo.play()  # type: ignore[attr-defined]
        self._seen = time.monotonic()


def watched(servo: Servo) -> Watchdog:
    """Return the servo with a watchdog; what else it offers, that offers too.

    Parameters
    ----------
    servo : Servo
    """
    kinds: list[type[Watchdog]] = [_Drags] if isinstance(servo, DragTeaching) else []
    if isinstance(servo, OutputSwitching):
        kinds.append(_Switches)
    if all(hasattr(servo, name) for name in ("upload", "play")):
        kinds.append(_Plays)
    made: Watchdog = type("Watchdog", (*kinds, Watchdog), {})(servo)
    return made

"""Switches outputs where the arm is, and off again whatever ends the run.

A set-point is reached one look-ahead after its time. An event that lies on it, or between it and
the one before, is therefore due then; it is switched in the cycle that is nearest to that.
"""

from collections import deque
from collections.abc import Sequence

from dmpcli.errors import DmpError, InputError, InstrumentError
from dmpcli.instruments.protocols import OutputSwitching, PlanPlayer, Servo
from dmpcli.planning.plan import Plan
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.trajectory import StrokeTrajectory


def names_of(strokes: Sequence[StrokeTrajectory]) -> list[str]:
    """Names of the outputs that some strokes switch, in order."""
    return list(dict.fromkeys(event.output for one in strokes for event in one.events))


def check(servo: Servo, names: Sequence[str]) -> None:
    """Refuse outputs that a robot does not switch, before it moves.

    Raises
    ------
    InputError
        Names the remedy.
    """
    if not names:
        return
    without = "--ignore-events draws without them"
    if isinstance(servo, PlanPlayer):
        raise InputError(
            f"robot: plays the plan by itself, so that nobody knows to a period where to switch "
            f"{', '.join(names)}; leave mode=file out of --robot, or {without}"
        )
    if not isinstance(servo, OutputSwitching):
        raise InputError(f"robot: its driver switches no outputs ({', '.join(names)}); {without}")
    for name in names:
        try:
            servo.check_output(name)
        except InputError as error:
            raise InputError(f"{error}; {without}") from None


class OutputSwitch:
    """The outputs of one run.

    Parameters
    ----------
    servo : OutputSwitching
    period, lookahead : float
        s.

    Attributes
    ----------
    left : str
        What may still be on after `leave`, and why; empty where all is off.
    """

    def __init__(self, servo: OutputSwitching, period: float, lookahead: float) -> None:
        self._servo, self._period, self._lookahead = servo, period, lookahead
        self._due: deque[tuple[float, OutputEvent]] = deque()
        self._on: list[str] = []
        self._last: tuple[Plan, float] | None = None
        self.left = ""

    @property
    def waiting(self) -> bool:
        """Whether the arm is on its way to a place where something is switched."""
        return bool(self._due)

    def reach(self, plan: Plan, index: float, when: float) -> None:
        """A set-point is handed over.

        Parameters
        ----------
        plan : Plan
        index : float
            Its number.
        when : float
            Its time, s, on the loop's clock; it is reached one look-ahead later.
        """
        before = -1.0
        if self._last is not None and self._last[0] is plan:
            before = self._last[1]
        self._last = plan, index
        for at, event in plan.events:
            if before < at <= index:
                early = (index - at) / max(index - before, 1.0) * self._period
                self._due.append((when - early + self._lookahead, event))

    def follow(self, plan: Plan) -> None:
        """Go on with a plan that is the same up to here, and whose end has moved."""
        if self._last is not None:
            self._last = plan, self._last[1]

    def act(self, now: float) -> tuple[str, DmpError | None]:
        """Switch what is due.

        Parameters
        ----------
        now : float
            s, on the loop's clock.

        Returns
        -------
        str
            What was switched; empty where nothing was.
        DmpError or None
            Why not all of it was.
        """
        done: list[str] = []
        while self._due and self._due[0][0] <= now + 0.5 * self._period:
            _, event = self._due.popleft()
            try:
                self._switch(event.output, event.on)
            except DmpError as failure:
                return "; ".join(done), failure
            done.append(event.deed)
        return "; ".join(done), None

    def off(self) -> str:
        """Switch all off that is on, and nothing more on; return what was switched.

        Raises
        ------
        DmpError
            The controller does not do it.
        """
        self._due.clear()
        done = []
        for name in list(self._on):
            self._switch(name, on=False)
            done.append(f"off {name}")
        return "; ".join(done)

    def leave(self) -> None:
        """Switch all off, whatever fails; raises nothing."""
        self._due.clear()
        kept = []
        for name in list(self._on):
            try:
                self._switch(name, on=False)
            except Exception as failure:  # a driver's defect must not keep the others on
                kept.append(f"{name} ({failure})")
        if kept:
            self.left = f"MAY STILL BE ON: {', '.join(kept)}; switch it off on the pendant"

    def _switch(self, name: str, on: bool) -> None:
        if on and name not in self._on:
            self._on.append(name)  # first: what fails half-way may be on
        self._servo.switch(name, on)
        if not on and name in self._on:
            self._on.remove(name)


def failed(reason: str, failure: DmpError | None, left: str) -> tuple[str, DmpError | None]:
    """Return how a run ended, with what may still be on.

    Parameters
    ----------
    reason : str
    failure : DmpError or None
    left : str
        Outputs that could not be switched off, in words; empty where there are none.

    Returns
    -------
    str
        Reason, with what is left.
    DmpError or None
        Of the same class, so of the same exit code; InstrumentError where the run itself did not
        fail.
    """
    if not left:
        return reason, failure
    text = f"{reason}; {left}"
    return text, InstrumentError(text) if failure is None else type(failure)(text)

"""What has plans drawn, and the servo loop of `execute`: one set-point per period.

The plan never jumps: every step between two set-points is one that the pre-flight checks have seen,
however late the loop is. Every cycle is logged, the last one too.
"""

from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from dmpcli.arrays import Floats
from dmpcli.control.arrival import ArrivalMonitor
from dmpcli.control.cycle import (
    ControlLoop,
    Cycle,
    LoopOutcome,
    ReadyArm,
    StopLimits,
    StoppedAtOnce,
)
from dmpcli.control.guards import LAG
from dmpcli.control.outputs import OutputSwitch, failed
from dmpcli.control.plan_cursor import PlanCursor
from dmpcli.control.run_log import Row, RunLog
from dmpcli.control.signals import Interruption
from dmpcli.control.step_limits import StepLimits, check_start
from dmpcli.errors import DmpError, InputError, RefusedError, beside
from dmpcli.instruments.protocols import RobotState
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import Plan
from dmpcli.spatial.pose import Pose

if TYPE_CHECKING:  # neither is loaded where neither is asked for
    from dmpcli.control.force_tracking import ForceInput, ForceTracker
    from dmpcli.control.goal_following import GoalFollower

DONE = "done"


class PlanLoop(ControlLoop):
    """Has one plan after the other drawn.

    Parameters
    ----------
    plan : Plan
        Checked.
    limits : Limits
    watch : StopLimits
    arm : ReadyArm
        Not yet in servo mode.
    touch : ForceInput, optional
        A sensor and, where asked, the force coupling.
    hindrance : callable, optional
        Read once a cycle; what it returns ends the run.
    then : sequence of Plan
        What is drawn after `plan`, each from where the one before it rests.
    outputs : OutputSwitch, optional
        What switches outputs along the plans.
    goals : GoalFollower, optional
        What moves the goal of `plan`, the only one then.

    Attributes
    ----------
    STREAMS : bool
        Whether the arm waits for our set-points, as in `ControlLoop`.
    PATIENCE : float
        By how much more than its look-ahead the arm may lag at a stroke's end, s.
    plan : Plan
        The one that is drawn.
    period, duration : float
        Of its cycles, and of all plans, s.
    drawn : list of str
        Ids of the strokes that were drawn to their ends.
    pressing : ForceTracker or None
        The force coupling, where there is one.
    log : RunLog
        One row per cycle; it is there whatever goes wrong.
    goals : GoalFollower or None

    Raises
    ------
    InputError
        There is a force coupling, and nobody waits for set-points.
    """

    STREAMS: ClassVar[bool]
    PATIENCE: ClassVar[float] = LAG

    def __init__(
        self,
        plan: Plan,
        limits: Limits,
        watch: StopLimits,
        arm: ReadyArm,
        touch: "ForceInput | None" = None,
        hindrance: Callable[[], DmpError | None] = lambda: None,
        then: Sequence[Plan] = (),
        outputs: OutputSwitch | None = None,
        goals: "GoalFollower | None" = None,
    ) -> None:
        super().__init__(plan.period, watch, limits.workspace, self.STREAMS, hindrance)
        self._take(arm, touch)
        self.plan, self._then = plan, deque(then)
        self.period, self.duration = plan.period, plan.period * sum(map(len, (plan, *then)))
        self.drawn: list[str] = []
        self._short: dict[str, float] = {}
        self.pressing: ForceTracker | None = touch.pressing if touch else None
        if self.pressing is not None and not self.STREAMS:
            raise InputError(
                "--coupling force: corrects each set-point as it is sent, and this robot plays the "
                "whole plan by itself; leave mode=file out of --robot"
            )
        self._touch, self._limits = touch, limits
        self._outputs, self._owed, self._switched = outputs, 0, ""
        self.goals = goals
        if goals is not None and not self.STREAMS:
            raise InputError(
                "--goal-from: moves each set-point as it is sent, and this robot plays the whole "
                "plan by itself; leave mode=file out of --robot"
            )
        self._draw(plan)
        sensed, pressed = touch is not None, self.pressing is not None
        switching, moving = outputs is not None, goals is not None
        self.log = RunLog(plan.oriented, sensed, pressed, arm.joints, switching, moving)

    def run(self, interruption: Interruption) -> LoopOutcome:
        """Go on until the arm rests at the end, or a reason to stop; the arm is stopped after.

        Parameters
        ----------
        interruption : Interruption
            The first signal ends the run, the second at once.

        Returns
        -------
        LoopOutcome
            Anything that an instrument or a limit can cause; only defects are raised. A signal
            that comes after the last set-point ends no run early, and is not told.
        """
        self._interruption = interruption
        how, failure = self._run()
        if self._cursor.braking:
            how = how or "decelerated along the path"
        failure = self._seen_back(failure) or self._untouched()
        outcome = self._outcome(how, failure, DONE)
        if self._outputs is None or not self._outputs.left:
            return outcome
        reason, failure = failed(outcome.reason, outcome.failure, self._outputs.left)
        return replace(outcome, reason=reason, failure=failure)

    def _leave(self) -> None:
        if self._outputs is not None:
            self._outputs.leave()

    def _seen_back(self, failure: DmpError | None) -> DmpError | None:
        """Return the failure; where a wall ended it, with what was felt until the arm stood."""
        pressing, touch, last = self.pressing, self._touch, self._last
        if pressing is None or touch is None or last is None:
            return failure
        if failure is None and self._rested:
            pressing.clear(touch.look_back(last.rotation), last.rotation)
        if pressing.supervisor.across is None or str(failure) != pressing.failure:
            return failure
        readings = touch.look_back(last.rotation)
        pressing.look_back(self._cursor.index, readings, touch.sensing.interval)
        return RefusedError(pressing.failure)

    def _untouched(self) -> DmpError | None:
        """Return why what was drawn does not count, though nothing else went wrong."""
        pressing = self.pressing
        if pressing is None or self._interruption.count:
            return None
        if pressing.failure:
            return RefusedError(pressing.failure)
        if not self._short:
            return None
        name, share = next(iter(self._short.items()))
        least = pressing.supervisor.policy.least_share
        more = f", and {len(self._short) - 1} more" if len(self._short) > 1 else ""
        return RefusedError(
            f"stroke {name} was in contact on {beside(100.0 * share, 100.0 * least, '.1f')} % of "
            f"it, under {100.0 * least:g} % (--min-contact){more}: it does not count as drawn"
        )

    @property
    def virtual(self) -> bool:
        """Whether what it feels with belongs to a lab that ``dmpcli simulate`` serves."""
        return self._touch is not None and self._touch.sensing.info.virtual

    def _enter(self) -> None:
        """Enter servo mode, and make sure that the arm still stands where the plan begins."""
        self._heed()
        self._start()
        # To start may take seconds.
        self._heed()
        state = self._arm.servo.state()
        check_start(state, self.plan, self._limits)
        if self.goals is not None:
            self.goals.begin(state.joints)

    def _next(self, cycle: Cycle, owed: bool = False) -> Pose:
        if owed:
            self._advance()
        if self._interruption.count > 1:
            raise StoppedAtOnce("stopped at once at the second signal")
        if self._interruption.count or self._hindrance() is not None or self._lost:
            self._switched += self._outputs.off() if self._outputs is not None else ""
            self._brake()
        elif self.goals is not None and not owed:
            moved = self.goals.step(cycle.due, self._cursor.index)
            if moved is not None:
                self._follow(moved)
        setpoint = self._setpoint(cycle)
        if self._outputs is not None and not self._cursor.waiting and not self._cursor.braking:
            self._owed = self._owed + 1 if owed else 0
            late = 0.0 if self._arm.info.queues else cycle.late
            when = cycle.due + late + self._owed * self._period
            self._outputs.reach(self.plan, self._cursor.index, when)
        return setpoint

    @property
    def _lost(self) -> bool:
        """Whether the force coupling has given up."""
        return self.pressing is not None and bool(self.pressing.failure)

    @abstractmethod
    def _brake(self) -> None:
        """Come to rest from now on."""

    @abstractmethod
    def _setpoint(self, cycle: Cycle) -> Pose:
        """Return the set-point where the plan is now, checked."""

    def _goes_on(self, cycle: Cycle) -> bool:
        """Go on until the last plan has ended, or the brake, and the arm stands still."""
        over = self._cursor.finished and (not self._then or self._cursor.braking)
        over = over and self._clear()
        self._rested = over and self._rest.reached(cycle.state)
        if self._outputs is not None and self._outputs.waiting:
            self._rested = False  # the arm is on its way to where something is switched
        self._look(cycle.state)
        if self._rested:
            if not self._cursor.braking and self._last is not None:
                self._arrival.check_rest(cycle.state, self._last)
            return False
        self._advance()
        return True

    def _clear(self) -> bool:
        """Whether the tool has come off the work as far as it shall."""
        return True

    def _advance(self) -> None:
        """Go on by one set-point; after a plan's last one to the first of the next, where it is."""
        if self._then and self._cursor.finished and not self._cursor.braking:
            self._count(over=True)
            self._draw(self._then.popleft())
        else:
            self._cursor.advance()

    def _draw(self, plan: Plan) -> None:
        """Go on with a plan, from its first set-point."""
        if self.pressing is not None and plan is not self.plan:
            self.pressing = self.pressing.on(plan)
        pressed, watch = self.pressing is not None, self._watch
        self.plan, self._counted = plan, False
        self._cursor = PlanCursor(plan, self._limits, wait=pressed)
        self._arrival = ArrivalMonitor(plan, watch.arrival, watch.arrival_angle, pressed)

    def _follow(self, plan: Plan) -> None:
        """Go on with a plan that is the same up to here, and whose end has moved."""
        self.duration += plan.period * (len(plan) - len(self.plan))
        self.plan = plan
        self._cursor.follow(plan)
        self._arrival.follow(plan)
        if self.pressing is not None:
            self.pressing.follow(plan)
        if self._outputs is not None:
            self._outputs.follow(plan)

    def _look(self, state: RobotState) -> None:
        """See how far the arm has come; count the stroke once it has had the time, or rests."""
        self._arrival.see(state, self._cursor.index)
        beyond = (self._cursor.index - self.plan.last) * self._period - self._arm.info.lookahead
        if self._rested and self._cursor.index >= self.plan.last:
            self._count(over=not self._cursor.braking)
        elif beyond > -1e-9:
            self._count(over=beyond > self.PATIENCE and not self._cursor.braking)

    def _count(self, over: bool) -> None:
        """Count the stroke as drawn if the arm has come to its end.

        Parameters
        ----------
        over : bool
            Whether it must have by now; only where nobody has looked, nobody can tell.

        Raises
        ------
        InstrumentError
            It has not.
        """
        if self._counted:
            return
        if self._arrival.arrived:
            self._counted = True
            share = 1.0 if self.pressing is None else self.pressing.tally.share(self.plan.id)
            if self.pressing and share < self.pressing.supervisor.policy.least_share:
                self._short[self.plan.id] = share
            else:
                self.drawn.append(self.plan.id)
        elif over and self._arrival.looked:
            self._arrival.refuse()

    def _record(self, cycle: Cycle, setpoint: Pose | None, lateness: float | None) -> None:
        index, state = self._cursor.index, cycle.state
        draws = self.plan.draws_at(index)
        actual = state.pose
        switched, failure = self._switched, None
        if self._outputs is not None and setpoint is not None:
            now, self._switched = self._arm.clock.now() - self._begin, ""
            done, failure = self._outputs.act(now)
            switched = "; ".join(part for part in (switched, done) if part)
        self.log.add(
            state.t,
            Row(
                # A state is as old as its controller's last report.
                t=cycle.due + cycle.late + (state.t - cycle.woke),
                t_plan=self.plan.time_at(index),
                planned=self.plan.at(index),
                sent=setpoint or self._last or actual,
                actual=actual,
                deadline=cycle.due,
                lateness=cycle.late if lateness is None else lateness,
                wrench=cycle.wrench,
                coupling=self.pressing.e if self.pressing and draws else 0.0,
                force=self.pressing.wanted(index) if self.pressing else 0.0,
                contact=self.pressing.supervisor.state if self.pressing else "",
                state=state.mode,
                phase=self._cursor.phase,
                id=self.plan.id if draws else None,
                joints=state.joints,
                event=switched,
                goal=None if self.goals is None else self.goals.goal,
                normal=self.pressing.sense.estimate if self.pressing and draws else None,
            ),
        )
        if failure is not None:
            raise failure


class ServoLoop(PlanLoop):
    """Streams: each set-point is sent in its cycle; to brake is to decelerate along the path."""

    STREAMS = True

    def _enter(self) -> None:
        super()._enter()
        self._steps = StepLimits(self._limits, self._period)
        self._over = 0.0  # s since the last plan ended

    def _brake(self) -> None:
        """Decelerate along the path from now on, if any of it is left."""
        if self._then or not self._cursor.finished:
            self._cursor.brake()

    def _clear(self) -> bool:
        """Whether a coupled tool is off the work: led by its plan, or lifted where that ends."""
        pressing, cursor = self.pressing, self._cursor
        if pressing is None or cursor.braking or self.plan.last < len(self.plan) - 1:
            return True
        self._over += self._period
        beyond = self._over - self._arm.info.lookahead
        if beyond > -1e-9:
            self._count(over=beyond > self.PATIENCE)
        return pressing.supervisor.retreated

    def _setpoint(self, cycle: Cycle) -> Pose:
        pressing, cursor = self.pressing, self._cursor
        if pressing is not None and cursor.waiting and pressing.settled:
            cursor.release()
        index = cursor.index
        setpoint = self.plan.at(index)
        if pressing is not None:
            pressed = setpoint.position + self._pressed(pressing, cycle, index)
            setpoint = Pose(pressed, setpoint.rotation)
            if pressing.supervisor.urgent:
                raise RefusedError(pressing.failure)
        self._steps.check(self._last, setpoint)
        return setpoint

    def _pressed(self, pressing: "ForceTracker", cycle: Cycle, index: float) -> Floats:
        """Return what the force coupling adds to the set-point, shape (3,), mm."""
        plan, cursor, t = self.plan, self._cursor, cycle.due
        if cursor.braking:
            return pressing.hold(index)
        if index > plan.last:
            return pressing.leave(index, t)
        if index < plan.lead:
            return pressing.come(index, cycle.wrench, t)
        if cursor.finished and self._counted:
            return pressing.retreat(index, t)
        if cycle.wrench is None:
            return pressing.hold(index)
        return pressing.displace(index, cycle.wrench, t, cycle.state.position)

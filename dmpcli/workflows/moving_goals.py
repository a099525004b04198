"""Where the goal of an execution moves: ``--goal-from``, from its text to what the loop follows."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.instruments.protocols import PlanPlayer, Servo
from dmpcli.planning.limits import limits_of
from dmpcli.planning.plan import Plan
from dmpcli.records import file_io
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance, input_of
from dmpcli.records.stroke_selection import StrokeSelection
from dmpcli.settings.execute import ExecuteSettings

if TYPE_CHECKING:  # loaded where goals are asked for
    from dmpcli.control.goal_following import GoalFollower
    from dmpcli.dmp.goal_step import GoalFilter
    from dmpcli.instruments.goal_sources import GoalSource, ScheduledGoals
    from dmpcli.kinematics.reachability import Reach

_UDP = "udp:"


@dataclass(frozen=True)
class Asked:
    """What was asked for, checked as far as it can be before anything is opened.

    Attributes
    ----------
    said : str
        A file or a URL.
    file : Source or None
    schedule : ScheduledGoals or None
        Of the file.
    filter : GoalFilter
    normal : array, shape (3,)
        Of the stroke's plane.
    """

    said: str
    file: Source | None
    schedule: "ScheduledGoals | None"
    filter: "GoalFilter"
    normal: Floats


class MovingGoals:
    """The goals of one run; where none were asked for, it does nothing.

    Parameters
    ----------
    asked : Asked, optional
    """

    def __init__(self, asked: Asked | None = None) -> None:
        self._asked = asked
        self._source: GoalSource | None = None

    def check_streams(self, robot: Servo) -> None:
        """Refuse a robot that plays the whole plan by itself, before it is opened.

        Raises
        ------
        InputError
        """
        if self._asked is not None and isinstance(robot, PlanPlayer):
            raise InputError(
                "--goal-from: moves each set-point as it is sent, and this robot plays the whole "
                "plan by itself; leave mode=file out of --robot"
            )

    def open(self) -> None:
        """Listen, where it is a URL.

        Raises
        ------
        InstrumentError
        """
        if self._asked is not None:
            from dmpcli.instruments import goal_sources

            self._source = self._asked.schedule or goal_sources.datagrams(self._asked.said)

    def close(self) -> None:
        """Listen no more."""
        if self._source is not None:
            self._source.close()

    def follower(
        self,
        plan: Plan,
        settings: ExecuteSettings,
        reach: "Reach | None",
        tell: Callable[[str], None],
    ) -> "GoalFollower | None":
        """Return what the loop asks each cycle.

        Parameters
        ----------
        plan : Plan
            Of the stroke whose goal moves.
        settings : ExecuteSettings
            Its limits hold of moved courses too.
        reach : Reach or None
            The arm whose joints are judged.
        tell : callable
            Told in words what becomes of each goal.

        Returns
        -------
        GoalFollower or None
            None where no goal moves, or nobody listens yet.

        Raises
        ------
        InputError
            The stroke is too long.
        """
        asked = self._asked
        if asked is None or self._source is None:
            return None
        from dmpcli.control.goal_following import GoalFollower, GoalOptions

        options = GoalOptions(limits_of(settings), reach, settings.goal_range, tell)
        return GoalFollower(self._source, plan, asked.filter, asked.normal, options)

    def noted(self, provenance: Provenance) -> Provenance:
        """Add it to what a run file says of how it was made: of a URL that it was one."""
        if self._asked is None:
            return provenance
        file, inputs = self._asked.file, provenance.inputs
        options: dict[str, Any] = {"goal_from": "udp" if file is None else "file"}
        if file is not None:
            inputs = (*inputs, input_of("goals", file))
        return replace(provenance, options=provenance.options | options, inputs=inputs)


def wanted(said: str | None, batch: StrokeSelection, settings: ExecuteSettings) -> MovingGoals:
    """Read and check what ``--goal-from`` says.

    Parameters
    ----------
    said : str or None
    batch : StrokeSelection
        What is to be drawn.
    settings : ExecuteSettings

    Raises
    ------
    InputError, RefusedError
        There are several strokes, or this one's goal cannot move.
    """
    if said is None:
        return MovingGoals()
    if len(batch.strokes) > 1:
        raise InputError(
            f"--goal-from: moves the goal of one stroke, and {len(batch.strokes)} are to be drawn; "
            "name one with --id"
        )
    from dmpcli.control import goal_following
    from dmpcli.instruments import goal_sources
    from dmpcli.instruments.goal_sources import ScheduledGoals

    stroke = batch.strokes[0]
    normal = goal_following.plane_of(stroke)
    filter_ = goal_following.filter_of(stroke.facts, settings.speed, settings.period)
    if said.startswith(_UDP):
        goal_sources.check(said)
        return MovingGoals(Asked(said, None, None, filter_, normal))
    from dmpcli.records import goal_table

    file = file_io.read(said)
    schedule = ScheduledGoals(file.name, *goal_table.read(file))
    return MovingGoals(Asked(said, file, schedule, filter_, normal))

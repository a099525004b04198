"""What a run of many strokes is made of: the ways, the checked plans, and what is left to draw."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dmpcli.control import execution, guards
from dmpcli.control.cycle import ReadyArm
from dmpcli.errors import InputError, RefusedError
from dmpcli.planning import transfers
from dmpcli.planning.limits import limits_of
from dmpcli.planning.plan import Plan
from dmpcli.planning.preflight import Check
from dmpcli.planning.transfers import TransferOptions
from dmpcli.records.stroke_selection import StrokeSelection, listed
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.spatial.trajectory import StrokeTrajectory

if TYPE_CHECKING:
    from dmpcli.kinematics.reachability import Reach

CLEARANCE = 20.0
"""Distance from the work in the air where none is given, mm."""

_TOLD = 8
_COME = "move the arm there, or let it go there over the work with --approach MM_PER_S"


@dataclass(frozen=True)
class CheckedPlan:
    """One stroke with its ways, and what was found of it before the arm moves.

    Attributes
    ----------
    plan : Plan
    checks : list of Check
        All of them, failed ones too.
    """

    plan: Plan
    checks: list[Check]

    @property
    def failure(self) -> Check | None:
        """The first check that failed."""
        return next((check for check in self.checks if not check.passed), None)


def lifts(batch: StrokeSelection, settings: ExecuteSettings) -> bool:
    """Tell whether the pen is to be lifted: for a batch, for several strokes, or as asked.

    The single stroke of a file ends where it ends, and the pen stays there; to its start it is led
    through the air all the same, where it stands elsewhere.
    """
    return batch.folder or len(batch.strokes) > 1 or settings.clearance is not None


def ways(settings: ExecuteSettings, lookahead: float, presses: bool) -> TransferOptions:
    """Return how the tool moves between strokes.

    Parameters
    ----------
    settings : ExecuteSettings
    lookahead : float
        By how much the arm lags its set-points, s: where a way ends they wait for it.
    presses : bool
        Whether the force coupling is on.

    Raises
    ------
    InputError
        The coupling may displace the tool by as much as the clearance.
    """
    clearance = CLEARANCE if settings.clearance is None else settings.clearance
    spare = settings.clamp if presses else 0.0
    if spare >= clearance:
        raise InputError(
            f"--clearance {clearance:g}: must be over {spare:g} mm, by which the force coupling "
            "may displace the tool (coupling_clamp)"
        )
    return TransferOptions(
        clearance,
        settings.transfer_speed,
        settings.retract_speed,
        settings.lead_speed,
        int(np.ceil(lookahead / settings.period - 1e-9)),
        spare,
    )


def prepare(
    batch: StrokeSelection,
    settings: ExecuteSettings,
    arm: ReadyArm,
    presses: bool,
    advance: Callable[[int], None],
    reach: "Reach | None" = None,
) -> list[CheckedPlan]:
    """Plan all strokes from where the arm stands, and judge each with the ways to it and off it.

    Parameters
    ----------
    batch : StrokeSelection
    settings : ExecuteSettings
    arm : ReadyArm
    presses : bool
        Whether the force coupling is on.
    advance : callable
        Told how many strokes are done.
    reach : Reach, optional
        The arm whose joints are judged too, from where they are if the state tells it.

    Raises
    ------
    InputError
        There are too many set-points, or the clearance is too small.
    RefusedError
        The arm is not ready, or the strokes lie on faces that look different ways.
    """
    strokes, state = batch.strokes, arm.servo.state()
    leave = lifts(batch, settings)
    guards.check_ready(state)
    standing = execution.standing(strokes[0], settings, state)
    near = all(check.passed for check in standing)
    if not leave and (near or settings.approach is None):
        return [CheckedPlan(*execution.prepare(strokes[0], settings, state, reach))]
    between = ways(settings, arm.info.lookahead, presses)
    start, limits = state.pose, limits_of(settings)
    if settings.approach is None:
        standing = [replace(check, remedy=_COME) for check in standing]
    else:
        standing = []
    joints = None if reach is None else reach.standing(state.joints, start)
    judged: list[CheckedPlan] = []
    made = transfers.plans(
        strokes,
        settings.period,
        settings.speed,
        limits,
        start,
        near,
        between,
        settings.approach,
        leave,
    )
    for stroke, plan in zip(strokes, made, strict=True):
        checks, joints = execution.judge(stroke, plan, settings, standing, reach, joints)
        judged.append(CheckedPlan(plan, checks))
        standing = []
        advance(1)
    return judged


def refuse_any(judged: Sequence[CheckedPlan]) -> None:
    """Raise for the first stroke that failed, and say which others did.

    Raises
    ------
    RefusedError
    """
    bad = [one for one in judged if one.failure is not None]
    if not bad:
        return
    if len(judged) == 1:
        raise RefusedError(str(bad[0].failure))
    names = listed([one.plan.id for one in bad])
    others = f"; {len(bad)} of {len(judged)} strokes fail: {names}" if len(bad) > 1 else ""
    raise RefusedError(f"stroke {bad[0].plan.id}: {bad[0].failure}{others}")


def facts_of(batch: StrokeSelection) -> dict[str, Any]:
    """Return what a run file says of its strokes before any is drawn.

    Parameters
    ----------
    batch : StrokeSelection

    Returns
    -------
    dict
        ``trajectory``: what the first stroke's file says of all; ``strokes``: in order, the id of
        each with its start, goal and normal where they are known; ``failed``: ids of the pairs
        that were passed over.
    """
    own = ("start", "goal", "normal")
    shared = {key: value for key, value in batch.strokes[0].facts.items() if key not in own}
    return {
        "trajectory": shared,
        "strokes": [_known(stroke, own) for stroke in batch.strokes],
        "failed": list(batch.failed),
    }


def _known(stroke: StrokeTrajectory, keys: Sequence[str]) -> dict[str, Any]:
    said = {key: stroke.facts[key] for key in keys if stroke.facts.get(key) is not None}
    return {"id": stroke.id} | said


def rest_of(batch: StrokeSelection, drawn: Sequence[str]) -> str:
    """Say how many strokes are drawn and how to draw the rest; bounded.

    Parameters
    ----------
    batch : StrokeSelection
    drawn : sequence of str
        Those that are whole.
    """
    ids = [stroke.id for stroke in batch.strokes]
    left = execution.progress_of(ids, drawn)["remaining"]
    if not left:
        return f"all {len(ids)} strokes are drawn" if len(ids) > 1 else "the stroke is drawn"
    rest = " ".join(f"--id {name}" for name in left[:_TOLD])
    more = f" and {len(left) - _TOLD} more, which inspect lists" if len(left) > _TOLD else ""
    return f"{len(drawn)} of {len(ids)} strokes are drawn; the rest: {rest}{more}"


def passed_over(failed: Mapping[str, str]) -> str:
    """Name the pairs of a batch that have no trajectory; of many the first few.

    Parameters
    ----------
    failed : mapping of str
        Why, by id.
    """
    name, why = next(iter(failed.items()))
    if len(failed) == 1:
        return f"pair {name} has no trajectory and is not drawn: {why}"
    return (
        f"{len(failed)} pairs have no trajectory and are not drawn: {listed(list(failed))}; "
        f"the first: {why}"
    )

"""`generalize`: what is to be drawn, checked and made ready; one pair or a table of them."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.batch.site import PairSites, Prepare
from dmpcli.batch.task import Task
from dmpcli.dmp.drawn_strokes import GeneralizeOptions, OnBorder
from dmpcli.dmp.feasibility import Feasibility, admit
from dmpcli.dmp.skill import Skill
from dmpcli.errors import InputError, RefusedError
from dmpcli.messages import tell, warn
from dmpcli.records import learning_record
from dmpcli.records.learned_skill import LearnedSkill
from dmpcli.records.pairs import PairTable
from dmpcli.records.record import Provenance
from dmpcli.settings.generalize import GeneralizeSettings
from dmpcli.spatial import output_events
from dmpcli.spatial.output_events import AskedEvent
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.surface import Surface
from dmpcli.workflows import process
from dmpcli.workflows.generalize_inputs import (
    ENDS,
    facing_tool,
    in_base,
    reach_of,
    style_of,
    where_instead,
)
from dmpcli.workflows.generalize_messages import mark, reason, tell_of_stretch, tell_of_surface
from dmpcli.workflows.surface_input import SurfaceInput

_PLACED = 100
"""Pairs off the surface that are told where it is instead."""


@dataclass(frozen=True)
class Order:
    """What is to be drawn, where and how.

    Attributes
    ----------
    skill : LearnedSkill
    table : PairTable
        One pair, or as many as a table has.
    settings : GeneralizeSettings
    surface : SurfaceInput, optional
    in_ : {'base', 'part'}
        Axes of the pairs: the base's, or the surface's own.
    on_border : {'fail', 'clip', 'skip', 'split'}
    keep_out : Path, optional
        Closed lines that no stroke enters.
    robot_model : str, optional
        The arm that is to draw.
    tool : Path, optional
        Tool file: where its TCP is.
    stop : bool
        Whether a bad pair ends all, else it is skipped.
    options : dict
        For provenance: those that only the caller knows.
    inputs : list of dict
        For provenance, likewise.
    """

    skill: LearnedSkill
    table: PairTable
    settings: GeneralizeSettings
    surface: SurfaceInput | None = None
    in_: Literal["base", "part"] = "base"
    on_border: OnBorder = "fail"
    keep_out: Path | None = None
    robot_model: str | None = None
    tool: Path | None = None
    stop: bool = True
    options: dict[str, Any] = field(default_factory=dict)
    inputs: list[dict[str, str]] = field(default_factory=list)


@dataclass(frozen=True)
class Ready:
    """An order that may be drawn.

    Attributes
    ----------
    task : Task
    table : PairTable
        In the base frame; the status of a pair tells what stands against it.
    duration : array, shape (B,)
        Of each stroke without easing, s.
    provenance : Provenance
    sites : PairSites, optional
        Where the pairs lie, if the table says it; `task` then has no surface.
    prepare : callable, optional
        Makes those pairs ready, see `Job`.
    """

    task: Task
    table: PairTable
    duration: Floats
    provenance: Provenance
    sites: PairSites | None = None
    prepare: Prepare | None = None


def prepared(order: Order) -> Ready:
    """Check an order, and tell what is doubtful about it.

    Raises
    ------
    InputError, RefusedError
        The skill cannot give what is asked, or a pair cannot be drawn and `Order.stop` holds.
    """
    skill, settings, read = order.skill, order.settings, order.surface
    options = settings.as_options() | order.options
    inputs = [{"role": "skill", "sha256": skill.sha256}]
    if read is not None:
        options |= {"surface_unit": read.unit, "on_border": order.on_border} | read.options
        inputs += read.inputs
    reach = reach_of(order.robot_model, order.tool, skill.oriented, options, inputs)
    inputs += order.inputs
    table = order.table
    if order.in_ == "part":
        table, options = in_base(table, read), options | {"in": order.in_}
    check_asked(skill, table, settings)
    process.check_skill(settings, skill, table, order.keep_out)
    table = process.copied(table, settings)
    given = None if read is None else facing_tool(read.surface, skill, table, str(read.path))
    if settings.force_setpoint is not None and settings.offset > 0.0:
        raise InputError(
            f"--force-setpoint: nothing presses at --offset {settings.offset:g} mm off the "
            "surface; leave one of them out"
        )
    style = style_of(settings.style(), skill, given, settings.contact, settings.offset)
    style = process.process_style(style, settings, order.on_border, given, order.keep_out, inputs)
    said = mark(skill, skill.name)
    if said is not None:
        warn(said)
    keeps = settings.orientation == "keep" and settings.inclination is None
    if skill.surface is not None and skill.oriented and keeps:
        tell(
            "the skill was taught on a surface: its tool turns as it did against that one, about "
            "the axes of the taught start; --orientation surface turns it with this one"
        )
    if skill.force is not None and settings.force_setpoint is None and settings.offset <= 0.0:
        tell("fn is the force that was taught; --force-setpoint N presses evenly instead")
    if given is not None and read is not None:
        tell_of_surface(skill, style, given, table, str(read.path))
    _judge(order, table, given, style)
    taught = learning_record.of_skill(skill.file).facts()
    return Ready(
        Task(skill.plain(), given, style, reach, asked_events(settings)),
        table,
        durations(skill, table.duration, settings),
        Provenance("generalize", options, tuple(inputs), taught),
    )


def each_alone(order: Order) -> bool:
    """Tell whether nothing but its own row of the table decides what is drawn of a pair.

    A plane is seen from the side of the tools of a table, and a skill that does not know its side
    is turned over where all pairs see it so; copies are numbered through.
    """
    if order.settings.copies is not None:
        return False
    if order.surface is None:
        return True
    own_tools = order.table.pairs.start_rotation is not None
    on_plane = isinstance(order.surface.surface, Plane)
    return not order.skill.side_guessed and not (on_plane and own_tools)


def asked_events(settings: GeneralizeSettings) -> tuple[AskedEvent, ...]:
    """Return what is switched along each stroke, and tell what stays on."""
    events = output_events.asked(settings.event or ())
    for name in dict.fromkeys(event.output for event in events):
        own = [event for event in events if event.output == name]
        if all(event.on for event in own):
            warn(
                f"{name} is switched on and never off: execute switches it off when a run ends, a "
                f"robot program leaves it on; --event off@end:{name} has it off with the stroke"
            )
    return events


def check_asked(skill: Skill, table: PairTable, settings: GeneralizeSettings) -> None:
    """Refuse what this skill cannot give, rather than pass over it.

    Parameters
    ----------
    skill : Skill
    table : PairTable
        Whether it asks for tool orientations.
    settings : GeneralizeSettings

    Raises
    ------
    InputError
        Orientations of a skill without; what the original model does not know; size and heading of
        an open stroke; scaling of a closed one by its amplitude.
    """
    asked = (table.pairs.start_rotation, table.pairs.goal_rotation)
    if not skill.oriented and any(rotation is not None for rotation in asked):
        raise InputError(
            f"{table.name}: asks for tool orientations, but the skill was demonstrated without; "
            "leave them out, or fit a demonstration that has them"
        )
    if skill.model == "original" and settings.orientation == "surface":
        raise InputError("--orientation surface: the original DMP knows no surface; leave it out")
    if skill.model == "original" and settings.amplitude == "scale":
        raise InputError("--amplitude scale: the original DMP scales by eq. (7); leave it out")
    if not skill.closed and (settings.scale != 1.0 or settings.turn != 0.0):
        raise InputError(
            "--scale and --turn: the size and heading of an open stroke are those of its start and "
            "goal; leave them out"
        )
    if skill.closed and settings.amplitude == "scale":
        raise InputError(
            "--amplitude scale: a closed stroke has no start-goal distance to scale with; "
            "leave it out, or give its size with --scale"
        )


def _judge(order: Order, table: PairTable, given: Surface | None, style: GeneralizeOptions) -> None:
    """Write what stands against a pair into its status; with `stop` the first one ends all."""
    import numpy as np

    skill, settings, read = order.skill, order.settings, order.surface
    rows = np.flatnonzero(table.good)
    verdict = admit(
        skill,
        table.pairs[rows],
        durations(skill, table.duration, settings)[rows],
        style,
        given,
        settings.snap_tol,
    )
    against = objections(verdict, table, rows, skill, settings, read, order.in_ == "part")
    for row, said in against.items():
        place = f"{table.place(row)}, pair {table.ids[row]}: " if table.name != ENDS else ""
        table.status[row] = place + said
    bad = np.flatnonzero(~table.good)
    if order.stop and len(bad):
        shape = verdict.upright | verdict.deep | verdict.stretched
        refused = bad[0] in rows[shape & ~verdict.far]
        raise (RefusedError if refused else InputError)(f"{table.name}: {table.status[bad[0]]}")
    tell_of_stretch(verdict, np.flatnonzero(verdict.admitted), skill, table.name)


def objections(
    verdict: Feasibility,
    table: PairTable,
    rows: Integers,
    skill: Skill,
    settings: GeneralizeSettings,
    read: SurfaceInput | None,
    in_part: bool,
) -> dict[int, str]:
    """Say what stands against pairs, by their rows.

    Parameters
    ----------
    verdict : Feasibility
        Of these rows (k,) of the table.
    table : PairTable
        In the base frame.
    rows : array of int, shape (k,)
    skill, settings
    read : SurfaceInput, optional
    in_part : bool
        Whether the pairs were given in the surface's own axes.
    """
    said = {}
    for i in np.flatnonzero(~verdict.admitted):
        row = int(rows[i])
        # To place each of very many would take longer than to draw them.
        where = None
        if read is not None and int(np.count_nonzero(verdict.far[:i])) < _PLACED:
            where = where_instead(table, row, read, in_part)
        said[row] = reason(verdict, int(i), settings.snap_tol, skill, where)
    return said


def durations(skill: Skill, asked: Floats, settings: GeneralizeSettings) -> Floats:
    """Return how long strokes last without easing, s; NaN is asked for where nothing is.

    Parameters
    ----------
    skill : Skill
        Its own duration counts where neither pair nor settings name one.
    asked : array, shape (B,)
        By each pair, s, or NaN.
    settings : GeneralizeSettings

    Returns
    -------
    array, shape (B,)
    """
    default = settings.duration or skill.duration
    return np.where(np.isnan(asked), default, asked)

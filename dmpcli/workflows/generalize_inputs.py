"""What `generalize` reads besides the skill: one pair's ends, the surface, and the arm."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.dmp.contact_heights import ContactHeights
    from dmpcli.dmp.drawn_strokes import GeneralizeOptions
    from dmpcli.dmp.skill import Skill
    from dmpcli.kinematics.reachability import Reach
    from dmpcli.records.pairs import PairTable
    from dmpcli.surfaces.surface import Surface
    from dmpcli.workflows.surface_input import SurfaceInput

Point = tuple[float, float, float]

ENDS = "--start and --goal"
"""What messages call the table of the one pair of the command line."""


def one_pair(
    start: Point, goal: Point, start_orientation: Point | None, goal_orientation: Point | None
) -> "PairTable":
    """Return a table of one pair.

    Parameters
    ----------
    start, goal : tuple of 3 float
        mm.
    start_orientation, goal_orientation : tuple of 3 float, or None
        X-Y-Z Euler angles, rad; more than a turn is doubted aloud.

    Returns
    -------
    PairTable
        Of the id ``1``, in the frame in which it was given; its duration is NaN.

    Raises
    ------
    InputError
        An angle is not finite, or beyond all sense; names the option.
    """
    import numpy as np

    from dmpcli.dmp.rollout import Pairs
    from dmpcli.records.pairs import LARGEST_ANGLE, PairTable
    from dmpcli.records.schemas import OK
    from dmpcli.spatial import rotations
    from dmpcli.workflows.pose_hints import warn_of_angles
    from dmpcli.workflows.ranges import within

    def rotation(name: str, angles: Point | None) -> Any:
        if angles is None:
            return None
        within(name, angles, LARGEST_ANGLE)
        warn_of_angles(name, angles)
        return rotations.from_euler(np.array([angles]))

    return PairTable(
        ENDS,
        ["1"],
        Pairs(
            np.array([start]),
            np.array([goal]),
            rotation("--start-orientation", start_orientation),
            rotation("--goal-orientation", goal_orientation),
        ),
        None,
        np.array([np.nan]),
        [OK],
    )


def in_base(table: "PairTable", read: "SurfaceInput | None") -> "PairTable":
    """Carry pairs that are in the part's own axes into the base frame."""
    from dataclasses import replace

    import numpy as np

    pose = None if read is None else read.pose
    if pose is None:
        return table

    def turned(rotation: Any) -> Any:
        return None if rotation is None else pose.rotation @ rotation

    pairs = table.pairs
    with np.errstate(invalid="ignore"):  # rows that are not read hold what they held
        carried = replace(
            pairs,
            start=pose.apply(pairs.start),
            goal=pose.apply(pairs.goal),
            start_rotation=turned(pairs.start_rotation),
            goal_rotation=turned(pairs.goal_rotation),
        )
    return replace(table, pairs=carried)


def where_instead(
    table: "PairTable", row: int, read: "SurfaceInput", in_part: bool
) -> Callable[[list[str]], str]:
    """Return what says of ends of a pair that are off the surface where it is instead.

    Parameters
    ----------
    table : PairTable
        In the base frame.
    row : int
        Of the table, from 0.
    read : SurfaceInput
    in_part : bool
        Whether the pairs were given in the surface's own axes; the answer is then in both.

    Returns
    -------
    callable
        From ``start`` and ``goal``, those that are off, to a remedy in words; it looks for the
        nearest places, so it is called only where they are told.
    """
    from dmpcli.workflows import off_surface

    def where(ends: list[str]) -> str:
        at = {"start": table.pairs.start[row], "goal": table.pairs.goal[row]}
        form = "--{}" if table.name == ENDS else "{}"
        return off_surface.remedy({end: at[end] for end in ends}, read, in_part, form)

    return where


def facing_tool(surface: "Surface", skill: "Skill", table: "PairTable", name: str) -> "Surface":
    """Turn a plane's normal to the tool's side, and say so where that flips it.

    A mesh learns where it will be asked for its shape.

    Parameters
    ----------
    surface : Surface
        In the base frame.
    skill : Skill
        Tells on which side its tool is, as far as the pairs do not.
    table : PairTable
        In the base frame; rows that cannot be drawn have no say.
    name : str
        What messages call the surface.

    Returns
    -------
    Surface
        The same one, but for a plane that is flipped.
    """
    from dmpcli.dmp.feasibility import sideways, tool_axis
    from dmpcli.messages import tell
    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.plane import Plane

    if isinstance(surface, Mesh) and skill.model == "modified":
        pairs = table.pairs[table.good.nonzero()[0]]
        surface.expect(pairs.start, pairs.goal, sideways(skill))
    if not isinstance(surface, Plane):
        return surface  # other charts look for the tool's side at each start
    facing = surface.facing(tool_axis(skill, table.pairs[table.good.nonzero()[0]]))
    if facing.normal @ surface.normal < 0:
        tell(f"{name}: the normal is flipped: it must point to the tool's side")
    return facing


def reach_of(
    model: str | None,
    tool: Path | None,
    oriented: bool,
    options: dict[str, Any],
    inputs: list[dict[str, str]],
) -> "Reach | None":
    """Return the arm that is to draw; None where none is named.

    Parameters
    ----------
    model : str or None
        Name of a kinematic model.
    tool : Path or None
        Tool file, which tells where the flange is; without it the flange is taken as the TCP.
    oriented : bool
        Whether the strokes say how the tool is turned; else it is told what is taken instead.
    options, inputs : dict and list of dict
        Of the provenance: what is read here is added to them.

    Raises
    ------
    InputError
        The model is not known, the tool file is wrong, or there is a tool and no arm.
    """
    from dmpcli.kinematics import models
    from dmpcli.kinematics.reachability import Reach
    from dmpcli.messages import tell
    from dmpcli.records import file_io
    from dmpcli.records import tool as tool_file

    if model is None:
        if tool is not None:
            raise InputError("--tool: says where the flange of --robot-model is; name one")
        return None
    arm = models.model(model)
    options["robot_model"] = model
    if not oriented:
        tell(
            "the strokes have no orientation: the arm is checked with the tool along the surface's "
            "normal at the start",
        )
    if tool is None:
        tell("no --tool: the flange is taken as the TCP")
        return Reach(arm)
    source = file_io.read(tool)
    inputs.append({"role": "tool", "sha256": source.sha256})
    return Reach(arm, tool_file.geometry(source))


def style_of(
    style: "GeneralizeOptions",
    skill: "Skill",
    given: "Surface | None",
    contact: float | None,
    offset: float,
) -> "GeneralizeOptions":
    """Return the style with what is drawn of the skill's heights over a named surface.

    Parameters
    ----------
    style : GeneralizeOptions
    skill : Skill
    given : Surface or None
        Without one, and of skills of the original model or the paper's learning, the style stays.
    contact : float or None
        Heights below it count as contact, mm; None takes it from the recording's noise.
    offset : float
        By which the stroke is shifted along the normal, mm.

    Returns
    -------
    GeneralizeOptions
        With a second set of heights where the skill's side was guessed, in case it is turned over.
    """
    from dataclasses import replace

    from dmpcli.dmp.contact_heights import contact_heights

    if given is None or skill.model == "original" or skill.learning != "tolerance":
        return style
    over: ContactHeights | None = None
    if skill.side_guessed:
        over = contact_heights(skill.turned_over(), contact, offset)
    return replace(style, heights=contact_heights(skill, contact, offset), heights_over=over)

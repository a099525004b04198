"""The Python API: what the subcommands do, on values and arrays; everything in mm, s and rad.

What the command line refuses raises the same error with the same text. What it tells goes to the
logger ``dmpcli``.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from dmpcli.arrays import Floats
from dmpcli.dmp.drawn_strokes import OnBorder
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.skill import Skill
from dmpcli.errors import InputError
from dmpcli.records import file_io, learned_skill, record, recordings, schemas, suffixes
from dmpcli.records.columns import FARTHEST
from dmpcli.records.learned_skill import LearnedSkill
from dmpcli.records.mesh_formats import looks_like_mesh
from dmpcli.records.pairs import PairTable
from dmpcli.records.schemas import OK
from dmpcli.records.storage import Location, located
from dmpcli.settings.batch import BatchOptions
from dmpcli.settings.fit import FitSettings
from dmpcli.settings.generalize import GeneralizeSettings
from dmpcli.settings.layers import resolve
from dmpcli.settings.options import Given
from dmpcli.settings.recording import RecordingOptions
from dmpcli.spatial.rotations import to_euler
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.surface import Surface
from dmpcli.workflows import batches, process, single, surface_input, values
from dmpcli.workflows.fit import check_said, learn
from dmpcli.workflows.generalize import Order, prepared
from dmpcli.workflows.generalize_inputs import one_pair
from dmpcli.workflows.given_arrays import real, rotations
from dmpcli.workflows.ranges import within
from dmpcli.workflows.recording import with_force
from dmpcli.workflows.surface_input import SurfaceInput
from dmpcli.workflows.values import Demonstration, DrawnTrajectory, TrajectoryBatch

MANY = "start and goal"
"""What messages call a table of pairs that was given as arrays."""


def read(path: str | Path, **said: Any) -> Any:
    """Read a file of dmpcli's, or a recording of another program.

    Parameters
    ----------
    path : str or Path
        A recording, skill, trajectory, run, or the folder of a batch.
    **said
        How another program's recording is read: the options of ``dmpcli fit``, with underscores,
        as ``layout="ur"`` or ``length_unit="m"``.

    Returns
    -------
    Demonstration, Skill, Trajectory, TrajectoryBatch or Run
        By what the file says.

    Raises
    ------
    InputError
        It cannot be read.
    """
    layout = resolve(RecordingOptions, said).as_layout()
    if str(path) != file_io.DASH and (folder := located(path)).is_dir():
        return values.batch_in(folder)
    source = file_io.read(path)
    if source.content.lstrip()[:1] == b"{":
        return learned_skill.read(source)
    if record.is_ours(source):
        found = record.decode(source)
        if found.schema is schemas.TRAJECTORY:
            return values.of_record(found, source)
        if found.schema is schemas.RUN:
            return values.of_run(found, source)
        if found.schema is not schemas.DEMONSTRATION:
            raise InputError(f"{path}: is a {found.schema.name} file, which holds no stroke")
    if looks_like_mesh(source):
        raise InputError(f"{path}: is a mesh; `read_surface` reads surfaces")
    return values.demonstration(source, layout)


def write(value: Any, path: str | Path) -> None:
    """Write a value as the command line does; the file is whole or not there.

    Parameters
    ----------
    value : Demonstration, Skill, Trajectory, TrajectoryBatch or Run
    path : str or Path
        Of a batch the folder.

    Raises
    ------
    InputError
        It cannot be written, or is none of these.
    """
    if isinstance(value, TrajectoryBatch):
        value.check()
        if value.ready is None:
            raise InputError(f"{path}: this batch was read from a folder; copy that one")
        batches.write(value.ready, located(path), BatchOptions(on_error="skip"))
        return
    suffixes.check(str(path), suffixes.JSON if isinstance(value, Skill) else suffixes.PARQUET)
    file_io.write(path, values.written(value, str(path)))


def read_surface(
    path: str | Path, pose: str | Sequence[float] | None = None, unit: str | None = None
) -> Surface:
    """Read a surface: a plane, cylinder or sphere file, or a mesh.

    Parameters
    ----------
    path : str or Path
    pose : str or sequence of float, optional
        Where its own frame lies in the base frame: ``X Y Z RX RY RZ``, mm and rad, or a pose file.
    unit : str, optional
        Of a mesh file's lengths.

    Raises
    ------
    InputError
        It cannot be read or is none of them.
    """
    if pose is not None and not isinstance(pose, str):
        pose = " ".join(repr(float(value)) for value in pose)
    found = surface_input.read(located(path), pose, unit)
    surface_input.remember(found)
    return found.surface


def fit(
    demonstrations: Demonstration | Sequence[Demonstration],
    surface: Surface | None = None,
    preset: str = "default",
    **settings: Any,
) -> LearnedSkill:
    """Learn a skill from one or several demonstrations.

    Parameters
    ----------
    demonstrations : Demonstration, or several
    surface : Surface, optional
        What the stroke was taught on.
    preset : str
        ``default``, ``paper``, or a TOML file.
    **settings
        The options of ``dmpcli fit``, with underscores.

    Raises
    ------
    InputError, RefusedError
        As ``dmpcli fit``.
    """
    several = demonstrations
    several = [several] if isinstance(several, Trajectory | str | Path) else list(several)
    if not several:
        raise InputError("there is no demonstration to learn from; give at least one")
    for one in several:
        if not isinstance(one, Demonstration):
            raise InputError(
                f"{type(one).__name__} is no Demonstration; `read` a file, or make one of arrays: "
                "Demonstration(t, position, rotation)"
            )
    check_said(settings, surface is not None)
    resolved = resolve(FitSettings, settings, preset)
    files = [one.file() for one in several]
    forms = [one.form for one in several]
    force = resolved.force_profile
    strokes = []
    for file, form in zip(files, forms, strict=True):
        found = recordings.read(file, form, force, (resolved.start, resolved.until))
        strokes.append(with_force(found, file.name) if force else found.stroke)
    known = [form for form in forms if form is not None]
    if any(form != known[0] for form in known):
        raise InputError(
            "the demonstrations were read in different ways, and a skill tells one; write each and "
            "read it again"
        )
    skill, _ = learn(files, strokes, resolved, known[0] if known else None, _named(surface))
    return skill


def generalize(
    skill: LearnedSkill,
    start: ArrayLike,
    goal: ArrayLike,
    surface: Surface | None = None,
    *,
    start_rotation: ArrayLike | None = None,
    goal_rotation: ArrayLike | None = None,
    in_: Literal["base", "part"] = "base",
    on_border: OnBorder = "fail",
    keep_out: str | Path | None = None,
    robot_model: str | None = None,
    tool: str | Path | None = None,
    preset: str | None = None,
    **settings: Any,
) -> "DrawnTrajectory | TrajectoryBatch":
    """Draw a skill at new start and goal points.

    Parameters
    ----------
    skill : Skill
        Of `fit` or `read`.
    start, goal : array, shape (3,) or (B, 3)
        mm; one point beside many stands for all of them.
    surface : Surface, optional
        What to draw on.
    start_rotation, goal_rotation : array, shape (3, 3) or (B, 3, 3), optional
        Of the tool.
    in_, on_border, keep_out, robot_model, tool, preset
        As the options of ``dmpcli generalize``.
    **settings
        Its other options, with underscores.

    Returns
    -------
    Trajectory or TrajectoryBatch
        Of one pair its trajectory, unless it is drawn in copies or pieces.

    Raises
    ------
    InputError, RefusedError
        As ``dmpcli generalize``; of a pair among many its status says it.
    """
    if not isinstance(skill, LearnedSkill):
        raise InputError(f"{type(skill).__name__} is no skill; `read` or `fit` gives one")
    resolved = resolve(GeneralizeSettings, settings, preset)
    lines = None if keep_out is None else Path(keep_out)
    named = _named(surface)
    process.check(resolved, Given(settings), _path_of(named), lines)
    first, last = _points("start", start), _points("goal", goal)
    if first.ndim == last.ndim and first.shape != last.shape:
        raise InputError(f"start and goal: shapes {first.shape} and {last.shape} differ")
    first, last = np.broadcast_arrays(first, last)
    turns = [
        None if R is None else rotations(name, R, first.shape[:-1])
        for name, R in (("start_rotation", start_rotation), ("goal_rotation", goal_rotation))
    ]
    options: dict[str, Any] = {}
    if first.ndim == 1:
        within("--start", first.tolist(), FARTHEST)
        within("--goal", last.tolist(), FARTHEST)
        angles = [None if R is None else tuple(to_euler(R).tolist()) for R in turns]
        table = one_pair(tuple(first.tolist()), tuple(last.tolist()), *angles)
        options = dict(zip(("start_orientation", "goal_orientation"), angles, strict=True))
    else:
        count = len(first)
        ids = [str(i + 1) for i in range(count)]
        pairs = Pairs(first.copy(), last.copy(), *turns)
        status = [
            _doubt(i, one, other) for i, (one, other) in enumerate(zip(first, last, strict=True))
        ]
        table = PairTable(MANY, ids, pairs, None, np.full(count, np.nan), status)
        options = BatchOptions(on_error="skip").as_options()
    order = Order(
        skill,
        table,
        resolved,
        named,
        in_,
        on_border,
        lines,
        robot_model,
        None if tool is None else Path(tool),
        first.ndim == 1,
        options,
    )
    ready = prepared(order)
    if first.ndim == 1:
        return values.of_record(single.draw_one(ready).record)
    return values.drawn_batch(ready)


def _named(surface: Surface | None) -> SurfaceInput | None:
    if surface is None:
        return None
    if isinstance(surface, str | Path):
        raise InputError(f"surface: {surface} is a name; `read_surface` reads the file")
    return surface_input.remembered(surface)


def _path_of(named: SurfaceInput | None) -> Location | None:
    return None if named is None else named.path


def _points(name: str, given: ArrayLike) -> Floats:
    points = real(name, given)
    if points.ndim not in (1, 2) or points.shape[-1] != 3:
        raise InputError(f"{name}: shape {points.shape} is neither (3,) nor (B, 3)")
    return points


def _doubt(row: int, start: Floats, goal: Floats) -> str:
    """Say what is wrong with one of many pairs, as its status."""
    try:
        within(f"start[{row}]", start.tolist(), FARTHEST)
        within(f"goal[{row}]", goal.tolist(), FARTHEST)
    except InputError as error:
        return str(error)
    return OK

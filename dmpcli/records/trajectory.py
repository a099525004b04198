"""Trajectory files: one stroke, or a dataset folder of parts with a status per pair."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from dmpcli.arrays import AnyArray, Floats
from dmpcli.dmp.contact_heights import ContactHeights, end_heights
from dmpcli.dmp.drawn_strokes import DrawnBlock, DrawnStroke, GeneralizeOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.skill import Skill
from dmpcli.records import schemas, tolerance_mark
from dmpcli.records.pairs import GOAL, GOAL_ANGLES, START, START_ANGLES
from dmpcli.records.record import Provenance, Record, repeated
from dmpcli.records.schemas import DRAWN_ON, EULER_ANGLES, NORMAL, POSITION
from dmpcli.spatial import output_events, rotations
from dmpcli.spatial.output_events import OutputEvent

LEAST_HEIGHT = 1e-9
"""A stroke that begins and ends nearer to the surface than this is on it, mm."""


def facts_of(
    skill: Skill, style: GeneralizeOptions | None = None, heights: ContactHeights | None = None
) -> dict[str, Any]:
    """Return what `execute` and `report` need of the skill that drew a trajectory.

    Parameters
    ----------
    skill : Skill
        As the pairs see it; see `seen_from`.
    style : GeneralizeOptions, optional
        How the strokes were drawn.
    heights : ContactHeights, optional
        What was drawn of the skill's heights over a named surface.
    """
    facts: dict[str, Any] = {
        "model": skill.model,
        "forcing_scale": skill.forcing_scale,
        "closed": skill.closed,
        "k": skill.spring.k.tolist(),
        "d": skill.spring.d.tolist(),
        "alpha_e": skill.alpha_e.tolist(),
    }
    ends = end_heights(skill, heights)
    if max(abs(ends[0]), abs(ends[1])) > LEAST_HEIGHT:
        facts["end_heights"] = list(ends)
    if heights is not None:
        facts["over_surface"] = {
            "band": heights.band,
            "removed": heights.removed,
            "offset": heights.offset,
        }
    if style is not None and skill.closed and (style.size, style.turn) != (1.0, 0.0):
        facts |= {"size": style.size, "turn": style.turn}
    mark = tolerance_mark.of_reached(skill.reached)
    if mark is not None:
        facts[tolerance_mark.FACT] = mark
    return facts


def facts_of_stroke(
    stroke: DrawnStroke, rate: float, start: Floats, goal: Floats
) -> dict[str, Any]:
    """Return what is so for one stroke alone: its tau, ends and plane.

    Parameters
    ----------
    stroke : DrawnStroke
        Its normal is a fact only where one holds for all samples.
    rate : float
        Samples a second, Hz.
    start, goal : array, shape (3,)
        As asked for, base frame, mm.

    Returns
    -------
    dict
        JSON values; tau and duration in s.
    """
    facts = {
        "tau": stroke.timing.tau,
        "duration": float(stroke.timing.t[-1]),
        "rate": rate,
        "start": start.tolist(),
        "goal": goal.tolist(),
    }
    if stroke.normal is not None and len(stroke.normal) == 1:
        facts["normal"] = stroke.normal[0].tolist()
    return facts


def facts_of_several(stroke: DrawnStroke, rate: float) -> dict[str, Any]:
    """Return what is so for all strokes of one file, of which this is one: rate and plane."""
    facts: dict[str, Any] = {"rate": rate}
    if stroke.normal is not None and len(stroke.normal) == 1:
        facts["normal"] = stroke.normal[0].tolist()
    return facts


def trajectory_record(
    ids: Sequence[str],
    strokes: Sequence[DrawnStroke],
    p: Provenance,
    events: Sequence[Sequence[OutputEvent]] = (),
) -> Record:
    """Return the record of several strokes, one after the other.

    Parameters
    ----------
    ids : sequence of str
        Of each stroke.
    strokes : sequence of DrawnStroke
        At least one; all with orientation or all without, all flat or all on a curved surface.
    p : Provenance
    events : sequence of sequence of OutputEvent
        What each stroke switches; none where nothing was asked for.
    """
    columns: dict[str, Any] = {
        "id": repeated(ids, [len(s.timing.t) for s in strokes]),
        "t": np.concatenate([s.timing.t for s in strokes]),
    }
    position = np.concatenate([s.position for s in strokes])
    columns |= {name: position[:, i] for i, name in enumerate(POSITION)}
    angles = [s.euler for s in strokes if s.euler is not None]
    if angles:
        euler = np.concatenate(angles)
        columns |= {name: euler[:, i] for i, name in enumerate(EULER_ANGLES)}
    if any(s.normal is not None and len(s.normal) > 1 for s in strokes):
        normal = np.concatenate([_normals(s) for s in strokes])
        columns |= {name: normal[:, i] for i, name in enumerate(NORMAL)}
    forces = [s.force for s in strokes if s.force is not None]
    if forces:
        columns["fn"] = np.concatenate(forces)
    if events:
        texts = [
            text
            for one, stroke in zip(events, strokes, strict=True)
            for text in output_events.stored(one, stroke.timing.t)
        ]
        columns[schemas.EVENT] = np.array(texts, dtype=object)
    return Record(schemas.TRAJECTORY, columns, p)


def _normals(stroke: DrawnStroke) -> Floats:
    """Normals of a stroke at each of its samples, shape (T, 3); NaN where it has none."""
    shape = stroke.position.shape
    if stroke.normal is None:
        return np.full(shape, np.nan)
    return np.broadcast_to(stroke.normal, shape)


def block_record(ids: Sequence[str], block: DrawnBlock, p: Provenance) -> Record:
    """Return the record of all strokes of one block: as `trajectory_record`, without a loop.

    Parameters
    ----------
    ids : sequence of str, length B
    block : DrawnBlock
        All of it drawn.
    p : Provenance
    """
    count, samples = block.position.shape[:2]
    columns: dict[str, Any] = {
        "id": repeated(ids, samples),
        "t": np.tile(block.timing.t, count),
    }
    columns |= {name: _column(block.position[..., i]) for i, name in enumerate(POSITION)}
    if block.euler is not None:
        columns |= {name: _column(block.euler[..., i]) for i, name in enumerate(EULER_ANGLES)}
    if block.normal is not None and block.normal.shape[1] > 1:
        columns |= {name: _column(block.normal[..., i]) for i, name in enumerate(NORMAL)}
    if block.force is not None:
        columns["fn"] = np.tile(block.force, count)
    return Record(schemas.TRAJECTORY, columns, p)


def _column(values: Floats) -> Floats:
    """Values (B, T), one stroke after the other; alike strokes may share one row's memory."""
    return values.ravel() if values.strides[0] else np.tile(values[0], len(values))


def pairs_record(
    ids: Sequence[str],
    pairs: Pairs,
    duration: Floats,
    normal: Floats,
    part: Sequence[str],
    status: Sequence[str],
    p: Provenance,
    surfaces: tuple[Sequence[str], Sequence[str]] | None = None,
) -> Record:
    """Return the record that says what became of each pair.

    Parameters
    ----------
    ids, part, status : sequence of str, length B
    pairs : Pairs
    duration : array, shape (B,)
        s, as drawn.
    normal : array, shape (B, 3)
        NaN for pairs that were not drawn.
    p : Provenance
    surfaces : tuple of (sequence of str, sequence of str), length B each, optional
        What the table calls the surface of each pair, and its SHA-256.
    """
    columns: dict[str, AnyArray] = {"id": np.array(ids, dtype=object)}
    groups: list[tuple[Sequence[str], Floats | None]] = [
        (START, pairs.start),
        (GOAL, pairs.goal),
        (START_ANGLES, _angles(pairs.start_rotation)),
        (GOAL_ANGLES, _angles(pairs.goal_rotation)),
        (NORMAL, normal),
    ]
    for names, values in groups:
        if values is not None:
            columns |= {name: values[:, i] for i, name in enumerate(names)}
    columns["duration"] = duration
    if surfaces is not None:
        columns |= dict(zip(DRAWN_ON, (np.array(v, dtype=object) for v in surfaces), strict=True))
    columns["part"] = np.array(part, dtype=object)
    columns["status"] = np.array(status, dtype=object)
    return Record(schemas.PAIRS, columns, p)


def _angles(rotation: Floats | None) -> Floats | None:
    return None if rotation is None else rotations.to_euler(rotation)

"""The strokes of a file as they leave for other programs: actual poses on their own times."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError, RefusedError
from dmpcli.formats.motion import Motion, MotionStroke
from dmpcli.records import dataset, file_io, record, schemas
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import Layout
from dmpcli.records.record import Record
from dmpcli.records.schemas import EULER_ANGLES, JOINTS, NORMAL, WRENCH
from dmpcli.records.trajectory_reader import rows_by_id, stored
from dmpcli.reporting import tracking
from dmpcli.spatial import output_events
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.rotations import from_euler, interpolate
from dmpcli.workflows.recording import recording, whole

BATCH = "batch"


def motion_in(path: Path, layout: Layout | None = None) -> tuple[Motion, dict[str, str]]:
    """Read the strokes of a file or a batch.

    Parameters
    ----------
    path : Path
        A demonstration, trajectory, run, the folder of a batch, or another program's recording.
    layout : Layout, optional
        How that is read.

    Returns
    -------
    Motion
    dict
        The entry of `Provenance.inputs`.

    Raises
    ------
    InputError
        It cannot be read, or holds no stroke.
    """
    if path.is_dir():
        batch, _ = dataset.read(path)
        return _batch(path, batch), {"role": BATCH, "sha256": batch.sha256}
    source = file_io.read(path)
    return motion_of(source, layout), {"role": "motion", "sha256": source.sha256}


def motion_of(source: Source, layout: Layout | None = None) -> Motion:
    """Return the strokes of a file; see `motion_in`."""
    if not record.is_ours(source):
        read = whole(source, layout, wrench=True)
        stroke = read.stroke
        one = MotionStroke(stroke.t, stroke.position, stroke.rotation, wrench=read.wrench)
        return Motion(source.name, schemas.DEMONSTRATION.name, [one])
    found = record.decode(source)
    if found.schema is schemas.DEMONSTRATION:
        stroke = recording(source, layout)
        one = MotionStroke(stroke.t, stroke.position, stroke.rotation, wrench=_wrench(found))
        strokes = [one]
    elif found.schema is schemas.TRAJECTORY:
        groups = rows_by_id(found.columns["id"])
        several = [stored(found, name, rows) for name, rows in groups.items()]
        strokes = [
            MotionStroke(
                one.t, one.position, one.rotation, one.normal, id=one.id, events=one.events
            )
            for one in several
        ]
    elif found.schema is schemas.RUN:
        strokes = run_strokes(found)
    else:
        raise InputError(
            f"{source.name}: is a {found.schema.name} file, which holds no stroke; give a "
            "demonstration, trajectory, run or the folder of a batch"
        )
    return Motion(source.name, found.schema.name, strokes, dict(found.provenance.facts))


def run_strokes(run: Record) -> list[MotionStroke]:
    """Return the strokes of a run as the arm drew them.

    Actual poses at the times when they were read, from when the stroke's first set-point was due,
    less the look-ahead by which the arm follows its set-points: where the plan says 1 s, the arm
    should be at 1 s too.

    Raises
    ------
    InputError
        Nothing of a stroke was drawn.
    """
    phase = np.asarray(run.columns["phase"])
    rows = np.flatnonzero(phase == "stroke")
    if len(rows) < 2:
        raise InputError(f"{run.name}: the run ended before its stroke began; nothing to export")
    groups = {"1": rows}
    if "id" in run.columns:
        words = np.array([word or "1" for word in run.columns["id"][rows]], dtype=object)
        groups = {name: rows[i] for name, i in rows_by_id(words).items()}
    lookahead = tracking.lookahead_of(run)
    strokes = []
    for name, group in groups.items():
        begun = float(run.columns["deadline"][group[0]])
        drawn = tracking.reached(run, group)
        t = drawn.t - begun - lookahead
        forward = np.concatenate([[True], np.diff(np.maximum.accumulate(t)) > 0.0])
        if forward.sum() < 2:
            continue
        R, wrench, joints = drawn.rotation(), _wrench(drawn), _joints(drawn)
        strokes.append(
            MotionStroke(
                t[forward],
                drawn.position()[forward],
                None if R is None else R[forward],
                id=name,
                wrench=None if wrench is None else wrench[forward],
                joints=None if joints is None else joints[forward],
                events=_switched(run, begun + lookahead, t[forward]),
            )
        )
    if not strokes:
        raise InputError(f"{run.name}: the run ended as its stroke began; nothing to export")
    return strokes


def _wrench(found: Record) -> Floats | None:
    """Wrench of each row, shape (n, 6); None where it is not known throughout."""
    if not found.has(*WRENCH):
        return None
    values = found.stack(WRENCH)
    return None if np.isnan(values).any() else values


def _joints(found: Record) -> Floats | None:
    """Joint angles of each row, shape (n, J), rad; None where they are not known throughout."""
    names = [name for name in JOINTS if name in found.columns]
    values = found.stack(names) if names else np.full((1, 1), np.nan)
    return None if np.isnan(values).any() else values


def _switched(run: Record, begun: float, t: Floats) -> tuple[OutputEvent, ...]:
    """Return what a run switched while a stroke was drawn, on the stroke's own time."""
    if schemas.EVENT not in run.columns:
        return ()
    when = np.asarray(run.columns["deadline"] + run.columns["lateness"], dtype=float) - begun
    half = float(run.provenance.options.get("period", 0.0)) / 2.0
    found: list[OutputEvent] = []
    for row, text in enumerate(run.columns[schemas.EVENT].tolist()):
        if text and t[0] - half <= when[row] <= t[-1] + half:
            at = float(np.clip(when[row], t[0], t[-1]))
            try:
                found += output_events.read([text], np.array([at]))
            except output_events.NotPlacedError as error:
                raise InputError(f"{run.name}: column 'event', row {row + 1}: {error}") from None
    return tuple(found)


def _events(folder: Path, batch: dataset.BatchFolder) -> dict[str, tuple[OutputEvent, ...]]:
    """Return what the strokes of a batch switch, by their ids; nothing where none was asked for."""
    found: dict[str, tuple[OutputEvent, ...]] = {}
    for name in batch.files if batch.provenance.options.get("event") else ():
        part = record.decode(file_io.read(folder / name), schemas.TRAJECTORY)
        for key, rows in rows_by_id(part.columns["id"]).items():
            found[key] = stored(part, key, rows).events
    return found


def _batch(folder: Path, batch: dataset.BatchFolder) -> Motion:
    strokes, events = [], _events(folder, batch)
    for piece in dataset.pieces(batch, (*EULER_ANGLES, *NORMAL)):
        columns = piece.columns
        position = np.column_stack([columns[n] for n in "xyz"])
        angles = (
            np.column_stack([columns[n] for n in EULER_ANGLES])
            if piece.has(*EULER_ANGLES)
            else None
        )
        normals = np.column_stack([columns[n] for n in NORMAL]) if piece.has(*NORMAL) else None
        for k, row in enumerate(piece.rows.tolist()):
            at = slice(int(piece.first[k]), int(piece.first[k + 1]))
            normal = None if normals is None else normals[at]
            if normal is None and batch.normal is not None and np.isfinite(batch.normal[row]).all():
                normal = np.broadcast_to(batch.normal[row], (at.stop - at.start, 3))
            strokes.append(
                MotionStroke(
                    columns["t"][at],
                    position[at],
                    None if angles is None else from_euler(angles[at]),
                    normal,
                    id=str(batch.ids[row].as_py()),
                    events=events.get(str(batch.ids[row].as_py()), ()),
                )
            )
    if not strokes:
        raise RefusedError(f"{folder}: no pair of it was drawn; {file_io.TABLE} says why")
    return Motion(str(folder), BATCH, strokes, dataset.facts_of(batch))


def chosen(motion: Motion, name: str | None) -> Motion:
    """Return the motion with one of its strokes alone.

    Raises
    ------
    InputError
        It has none of that name.
    """
    if name is None:
        return motion
    found = [one for one in motion.strokes if one.id == name]
    if not found:
        known = ", ".join(one.id for one in motion.strokes[:10])
        raise InputError(f"--id {name}: {motion.name} has no such stroke; it has {known}")
    return replace(motion, strokes=found)


def evenly(motion: Motion, rate: float) -> Motion:
    """Return the motion sampled at even times, from each stroke's first on.

    Parameters
    ----------
    motion : Motion
    rate : float
        Hz.
    """
    return replace(motion, strokes=[_evenly(one, rate) for one in motion.strokes])


def _evenly(one: MotionStroke, rate: float) -> MotionStroke:
    count = int(np.floor(one.duration * rate + 1e-9)) + 1
    if count < 2:
        raise InputError(f"--rate {rate:g}: stroke {one.id!r} is shorter than one period")
    # What rounding lets end past the last sample ends there.
    t = np.minimum(one.t[0] + np.arange(count) / rate, one.t[-1])

    def between(values: Floats | None) -> Floats | None:
        if values is None:
            return None
        return np.column_stack([np.interp(t, one.t, column) for column in values.T])

    normal = between(one.normal)
    if normal is not None:
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    position = between(one.position)
    assert position is not None
    return replace(
        one,
        t=one.t[0] + np.arange(count) / rate,
        position=position,
        rotation=None if one.rotation is None else interpolate(one.t, np.asarray(one.rotation), t),
        normal=normal,
        wrench=between(one.wrench),
        joints=between(one.joints),
    )

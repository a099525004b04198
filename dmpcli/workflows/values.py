"""The values of the Python API: demonstrations, trajectories, batches and runs."""

import contextlib
import hashlib
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.batch.settled import settle
from dmpcli.dmp.feasibility import snapped
from dmpcli.dmp.generalization import draw
from dmpcli.dmp.skill import Skill
from dmpcli.errors import InputError, about
from dmpcli.records import file_io, record, recordings, schemas
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import Layout
from dmpcli.records.learned_skill import LearnedSkill
from dmpcli.records.record import Provenance, Record
from dmpcli.records.schemas import OK
from dmpcli.records.storage import Location
from dmpcli.records.trajectory_reader import rows_by_id, stored
from dmpcli.reporting.recorded import Recorded
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.strokes import strokes_of
from dmpcli.settings.batch import BatchOptions
from dmpcli.spatial.rotations import from_euler, to_euler
from dmpcli.spatial.trajectory import StrokeTrajectory, Trajectory
from dmpcli.workflows import batches
from dmpcli.workflows.generalize import Ready
from dmpcli.workflows.given_arrays import real, rotations
from dmpcli.workflows.recording import recording


def _digest(one: Trajectory) -> bytes:
    """Return what tells whether arrays are still those that were read or drawn."""
    force = one.force if isinstance(one, StrokeTrajectory) else None
    arrays = (one.t, one.position, one.rotation, one.normal, force)
    found = hashlib.sha256()
    for part in arrays:
        found.update(b"-" if part is None else np.ascontiguousarray(part).tobytes())
    return found.digest()


def _remember(one: "Demonstration | DrawnTrajectory | Run") -> None:
    """Note what the arrays are, once: a copy with others knows that they are."""
    if not one.as_read:
        object.__setattr__(one, "as_read", _digest(one))


def _as_it_was(one: "Demonstration | DrawnTrajectory | Run") -> bool:
    """Tell whether file and record still say what the arrays do; they may have been changed."""
    return one.as_read == _digest(one)


@dataclass(frozen=True)
class Demonstration(Trajectory):
    """What the tool did while it was dragged; from arrays, or of a file.

    Attributes
    ----------
    source : Source, optional
        The file that it was read from.
    layout : Layout, optional
        How that is read, where it is not dmpcli's own.

    Raises
    ------
    InputError
        The arrays are not of real numbers, of the shapes (T,), (T, 3) and (T, 3, 3); or a matrix
        is no rotation.
    """

    source: Source | None = field(default=None, repr=False, compare=False)
    layout: Layout | None = field(default=None, repr=False, compare=False)
    as_read: bytes = field(default=b"", repr=False, compare=False)

    def __post_init__(self) -> None:
        t, position = real("t", self.t), real("position", self.position)
        if t.ndim != 1 or position.shape != (len(t), 3):
            raise InputError(
                f"t and position: shapes {t.shape} and {position.shape} are not (T,), (T, 3)"
            )
        R = None if self.rotation is None else rotations("rotation", self.rotation, t.shape)
        for name, value in (("t", t), ("position", position), ("rotation", R)):
            object.__setattr__(self, name, value)
        _remember(self)

    @property
    def form(self) -> Layout | None:
        """How `file` is read, where that is not dmpcli's own."""
        return self.layout if _as_it_was(self) else None

    def file(self) -> Source:
        """Return its file; of arrays the one that they would be written as."""
        if self.source is not None and _as_it_was(self):
            return self.source
        columns = _columns(self)
        made = Record(schemas.DEMONSTRATION, columns, Provenance("Demonstration"))
        return Source("demonstration", record.encode(made))


@dataclass(frozen=True)
class DrawnTrajectory(StrokeTrajectory):
    """A trajectory with the record that it is written as, and the file that it was read from."""

    record: Record | None = field(default=None, repr=False, compare=False)
    source: Source | None = field(default=None, repr=False, compare=False)
    as_read: bytes = field(default=b"", repr=False, compare=False)

    def __post_init__(self) -> None:
        _remember(self)


@dataclass(frozen=True)
class Run(Trajectory):
    """What an arm did; the record holds what was planned and sent, and when.

    Attributes
    ----------
    joints : array, shape (T, J), or None
        Actual joint angles, rad, where the file holds them.
    """

    joints: Floats | None = None

    record: Record | None = field(default=None, repr=False, compare=False)
    source: Source | None = field(default=None, repr=False, compare=False)
    as_read: bytes = field(default=b"", repr=False, compare=False)

    def __post_init__(self) -> None:
        _remember(self)


@dataclass(frozen=True)
class TrajectoryBatch(Trajectory):
    """Trajectories of many pairs, padded with NaN to the longest one.

    Attributes
    ----------
    t : array, shape (T,)
        Of the longest one, s; all have the same rate.
    position, rotation, normal
        With a leading axis, B.
    status : list of str, length B
        ``ok``, or why there is no trajectory.
    length : array of int, shape (B,)
        Samples of each.
    ids : list of str, length B
    ready : Ready, optional
        What it was drawn from.
    folder : Path or ObjectPath, optional
        That it was read from.
    """

    status: list[str] = field(default_factory=list)
    length: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    ids: list[str] = field(default_factory=list)
    ready: Ready | None = field(default=None, repr=False, compare=False)
    folder: Location | None = field(default=None, repr=False, compare=False)
    as_drawn: tuple[Floats | None, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.as_drawn:
            object.__setattr__(self, "as_drawn", self._arrays)
        self._keep()

    def __setstate__(self, state: dict[str, Any]) -> None:
        # Of a deep copy, and of one from another process: their arrays are new, and can be written.
        self.__dict__.update(state)
        self._keep()

    def _keep(self) -> None:
        """Let nobody write where a batch is written, reported and executed as it was drawn."""
        for part in self._arrays:
            if part is not None:
                part.flags.writeable = False

    @property
    def _arrays(self) -> tuple[Floats | None, ...]:
        return self.t, self.position, self.rotation, self.normal

    def check(self) -> None:
        """Refuse to take what was drawn for arrays that are others.

        Raises
        ------
        InputError
        """
        pairs = zip(self._arrays, self.as_drawn, strict=True)
        if any(one is not drawn for one, drawn in pairs):
            raise InputError(
                "the batch's arrays were changed, and it would be taken as it was drawn; make "
                "trajectories of them one by one"
            )

    def __len__(self) -> int:
        return len(self.ids)

    def __getitem__(self, i: int) -> Trajectory:
        n = int(self.length[i])
        return Trajectory(
            self.t[:n],
            self.position[i, :n],
            None if self.rotation is None else self.rotation[i, :n],
            None if self.normal is None else self.normal[i, :n],
        )


def demonstration(source: Source, form: Layout | None) -> Demonstration:
    """Read a recording, and say how it was read and what is doubtful about it."""
    stroke = recording(source, form)
    layout = None if record.is_ours(source) else form
    return Demonstration(stroke.t, stroke.position, stroke.rotation, source=source, layout=layout)


def of_record(found: Record, source: Source | None = None) -> DrawnTrajectory | TrajectoryBatch:
    """Return the trajectory of a trajectory file, or as a batch those of several ids."""
    strokes = [stored(found, name, rows) for name, rows in rows_by_id(found.columns["id"]).items()]
    if len(strokes) > 1:
        return _padded(list(strokes), [one.id for one in strokes], [OK] * len(strokes))
    [one] = strokes
    return DrawnTrajectory(
        one.t,
        one.position,
        one.rotation,
        one.normal,
        one.id,
        one.first_row,
        one.facts,
        one.events,
        one.force,
        found,
        source,
    )


def of_run(found: Record, source: Source | None = None) -> Run:
    """Return what an arm did as a value."""
    names = [name for name in schemas.JOINTS if name in found.columns]
    joints = found.stack(names) if names else None
    return Run(
        found.t, found.position(), found.rotation(), joints=joints, record=found, source=source
    )


def batch_in(folder: Location) -> TrajectoryBatch:
    """Read the folder of a batch whole."""
    pairs = record.decode(file_io.read_table(folder), schemas.PAIRS)
    known: dict[str, Trajectory] = {}
    parts = [part for part in pairs.columns.get("part", ()) if part]
    for name in dict.fromkeys(map(str, parts)):
        part = record.decode(file_io.read(folder / name), schemas.TRAJECTORY)
        for key, rows in rows_by_id(part.columns["id"]).items():
            known[key] = stored(part, key, rows)
    ids = [str(name) for name in pairs.columns["id"]]
    status = list(map(str, pairs.columns["status"]))
    return replace(_padded([known.get(name) for name in ids], ids, status), folder=folder)


def drawn_batch(ready: Ready) -> TrajectoryBatch:
    """Draw all pairs that can be drawn; the others have NaN and a status."""
    task, table = ready.task, ready.table
    good = np.flatnonzero(table.good)
    pairs = table.pairs if task.surface is None else snapped(table.pairs, task.surface)
    with about("skill"):
        drawn = draw(task.skill, pairs[good], ready.duration[good], task.surface, task.style)
    found = {
        int(row): one
        for row, one in zip(
            good, settle(task, [table.ids[row] for row in good], drawn), strict=True
        )
    }
    strokes: list[Trajectory | None] = []
    ids, status = [], []
    for row, name in enumerate(table.ids):
        one = found.get(row)
        if one is None or one.status != OK:
            strokes.append(None)
            ids.append(name)
            status.append(table.status[row] if one is None else one.status)
            continue
        for key, stroke in zip(one.ids, one.strokes, strict=True):
            t, normal = stroke.timing.t, stroke.normal
            strokes.append(
                Trajectory(
                    t,
                    stroke.position,
                    None if stroke.euler is None else from_euler(stroke.euler),
                    None if normal is None else np.broadcast_to(normal, (len(t), 3)),
                )
            )
            ids.append(key)
            status.append(OK)
    return replace(_padded(strokes, ids, status), ready=ready)


def _padded(strokes: list[Trajectory | None], ids: list[str], status: list[str]) -> TrajectoryBatch:
    length = np.array([0 if one is None else len(one.t) for one in strokes], dtype=np.int64)
    longest = int(length.max(initial=0))
    t = next((one.t for one in strokes if one is not None and len(one.t) == longest), np.zeros(0))

    def stacked(name: str, shape: tuple[int, ...]) -> Floats | None:
        known = [None if one is None else getattr(one, name) for one in strokes]
        if all(part is None for part in known):
            return None
        out = np.full((len(strokes), longest, *shape), np.nan)
        for row, part in enumerate(known):
            if part is not None:
                out[row, : len(part)] = part
        return out

    position = stacked("position", (3,))
    if position is None:
        position = np.full((len(strokes), longest, 3), np.nan)
    return TrajectoryBatch(
        t, position, stacked("rotation", (3, 3)), stacked("normal", (3,)), status, length, ids
    )


def _columns(one: Trajectory) -> dict[str, Any]:
    t, position = real("t", one.t), real("position", one.position)
    if t.ndim != 1 or position.shape != (len(t), 3):
        raise InputError(
            f"t and position: shapes {t.shape} and {position.shape} are not (T,), (T, 3)"
        )
    columns: dict[str, Any] = {"t": t, **dict(zip(schemas.POSITION, position.T, strict=True))}
    if one.rotation is not None:
        R = rotations("rotation", one.rotation, t.shape)
        angles = np.unwrap(to_euler(R), axis=0)
        columns |= dict(zip(schemas.EULER_ANGLES, angles.T, strict=True))
    return columns


def record_of(one: Trajectory) -> Record:
    """Return the record that a trajectory or run is written as."""
    if isinstance(one, DrawnTrajectory | Run) and one.record is not None and _as_it_was(one):
        return one.record
    columns = _columns(one)
    if not len(columns["t"]):
        raise InputError("a trajectory without samples: of a batch, its status says why")
    columns["id"] = np.array(["1"] * len(columns["t"]), dtype=object)
    if one.normal is not None:
        rows = np.broadcast_to(one.normal, (len(columns["t"]), 3))
        columns |= dict(zip(schemas.NORMAL, rows.T.copy(), strict=True))
    if isinstance(one, StrokeTrajectory) and one.force is not None:
        columns["fn"] = one.force
    return Record(schemas.TRAJECTORY, columns, Provenance("write"))


def source_of(value: Any, path: str = "") -> Source:
    """Return the file that a value was read from or is written as.

    Parameters
    ----------
    value : Demonstration, LearnedSkill, Trajectory or Run
    path : str
        What a message is to name.

    Raises
    ------
    InputError
        It is none of them.
    """
    name = f"{path}: " if path else ""
    if isinstance(value, LearnedSkill):
        return Source(value.name, value.content)
    if isinstance(value, Skill):
        raise InputError(f"{name}only a skill that `fit` or `read` gave can be written")
    if isinstance(value, Demonstration):
        return value.file()
    if isinstance(value, DrawnTrajectory | Run) and value.source is not None and _as_it_was(value):
        return value.source
    if isinstance(value, Trajectory):
        made = record_of(value)
        return Source(made.name or made.schema.name, record.encode(made))
    kind = type(value).__name__
    raise InputError(f"{name}{kind} is no demonstration, skill, trajectory, batch or run")


def written(value: Any, path: str) -> bytes:
    """Return what a file of a value holds; a recording of another program becomes one of ours.

    Parameters
    ----------
    value : Demonstration, LearnedSkill, Trajectory or Run
    path : str
        What a message is to name.

    Raises
    ------
    InputError
        It is none of them.
    """
    if isinstance(value, Demonstration) and value.layout is not None:
        return Demonstration(value.t, value.position, value.rotation).file().content
    return source_of(value, path).content


@contextlib.contextmanager
def folder_of(batch: TrajectoryBatch) -> Iterator[Location]:
    """Lend the folder of a batch: the one that it was read from, else one that is removed again."""
    batch.check()
    if batch.folder is not None:
        yield batch.folder
        return
    assert batch.ready is not None
    with tempfile.TemporaryDirectory() as folder:
        batches.draw_into(batch.ready, Path(folder), BatchOptions(on_error="skip"))
        yield Path(folder)


def measured(one: Trajectory) -> ReportedStroke:
    """Return a stroke as reports measure it."""
    if isinstance(one, Demonstration):
        source = one.file()
        found = recordings.read(source, one.form)
        return Recorded(found.stroke, "demonstration", source.name, source.sha256, None).stroke()
    return strokes_of(record_of(one), "stroke")[0]

"""`import`: recordings, drawings and programs of others in, demonstrations out."""

import functools
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dmpcli.errors import InputError, counted
from dmpcli.formats import detect
from dmpcli.formats.motion import MotionStroke
from dmpcli.formats.pose_series import PoseBlocks
from dmpcli.messages import tell
from dmpcli.records import file_io, record, schemas, suffixes
from dmpcli.records.columns import FARTHEST
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import Layout
from dmpcli.records.record import Provenance, Record, input_of
from dmpcli.records.schemas import EULER_ANGLES, POSITION, WRENCH
from dmpcli.settings.import_file import ImportOptions
from dmpcli.spatial.rotations import interpolate, to_euler_continued, to_euler_continuous
from dmpcli.workflows.recording import whole

NAME, ID = "{name}", "{id}"
"""In the name of an output: the input's, without suffix, and that of each of its strokes."""

TABLE = "table"


def check(files: Sequence[Path], output: Path) -> None:
    """Refuse an output that could not hold what comes, before anything is read.

    Raises
    ------
    InputError
    """
    suffixes.check(output, suffixes.PARQUET)
    if len(files) > 1 and NAME not in output.name:
        raise InputError(
            f"-o {output}: {len(files)} recordings need a file each; put {NAME} into the name"
        )
    stems = [stem_of(file) for file in files]
    twice = next((stem for i, stem in enumerate(stems) if stem in stems[:i]), None)
    if twice is not None:
        raise InputError(f"two inputs are called {twice}; import them one by one")
    if NAME not in output.name and ID not in output.name:
        file_io.check_writable(output)


def stem_of(file: Path) -> str:
    """Return an input's name without suffix."""
    return "stdin" if str(file) == file_io.DASH else file.stem


def import_file(
    file: Path,
    output: Path,
    options: ImportOptions,
    form: Layout | None,
    given: Mapping[str, Any],
) -> None:
    """Read one file, and write its strokes as demonstrations.

    Parameters
    ----------
    file : Path
    output : Path
    options : ImportOptions
    form : Layout, optional
        How a table is read.
    given : mapping
        What the command line itself says.

    Raises
    ------
    InputError
        It cannot be read, holds several strokes for one output, or an option says nothing of it.
    """
    kind, strokes, inputs = _read(file, options, form, given)
    name = file_io.shown(file)
    if len(strokes) > 1 and ID not in output.name:
        names = ", ".join(one.id for one in strokes[:8])
        raise InputError(
            f"{name}: holds {len(strokes)} strokes: {names}; choose one with --episode "
            f"NAME, or put {ID} into the name of the output for a file of each"
        )
    for one in strokes:
        if isinstance(one, MotionStroke) and one.events:
            tell(f"{name}: {_switched(one)}")
    said: dict[str, Any] = {"format": kind}
    if form is not None:
        said["layout"] = form.as_options()
    if kind != TABLE:
        said |= {k: v for k, v in options.as_options().items() if k in _OPTIONS[kind]}
    for one in strokes:
        place = output
        if output.name != file_io.DASH:
            own = output.name.replace(NAME, stem_of(file)).replace(ID, _safe(one.id))
            place = output.with_name(own)
        groups = demonstrations(one, inputs, said, name)
        file_io.write_by(place, functools.partial(record.store_groups, groups))
        shown = file_io.shown(place, output=True)
        tell(f"{shown}: {counted(len(one), 'sample')}, {one.duration:.3f} s, from {kind}")


def _read(
    file: Path, options: ImportOptions, form: Layout | None, given: Mapping[str, Any]
) -> tuple[str, Sequence[MotionStroke | PoseBlocks], list[dict[str, str]]]:
    """Return a file's kind, its strokes, and the entries of `Provenance.inputs`."""
    episode = None if form is None else form.episode
    kind = None if str(file) == file_io.DASH else detect.kind_of_path(file)
    if kind is not None:
        if options.format not in (None, kind):
            raise InputError(f"--format {options.format}: {file} is {kind}; leave it out")
        _check_given(kind, given)
        stroke, told = _streamed(file, kind, form, episode)
        for line in told:
            tell(f"{file}: {line}")
        return kind, [stroke], _hashes(file)
    source = file_io.read(file)
    kind = options.format or detect.kind_of(source)
    if kind in _STREAMED:
        raise InputError(f"--format {kind}: {source.name} is none")
    _check_given(kind, given)
    strokes = strokes_of(source, kind, options, form)
    if episode is not None and kind != TABLE:
        known = [one.id for one in strokes]
        strokes = [one for one in strokes if one.id == episode]
        if not strokes:
            raise InputError(f"--episode {episode}: {source.name} has {', '.join(known[:10])}")
    return kind, strokes, [input_of("recording", source)]


_STREAMED = ("mcap", "ros2", "lerobot")


def _streamed(
    file: Path, kind: str, form: Layout | None, episode: str | None
) -> tuple[MotionStroke | PoseBlocks, list[str]]:
    """Read what is not read whole."""
    body = None if form is None else form.body
    if kind == "lerobot":
        from dmpcli.formats import lerobot_dataset

        if body is not None:
            raise InputError("--body: says nothing of a lerobot dataset; leave it out")
        return lerobot_dataset.read(file, episode)
    if episode is not None:
        raise InputError(f"--episode: says nothing of {kind}; --body chooses a topic or frame")
    if kind == "mcap":
        from dmpcli.formats import mcap_file

        return mcap_file.read(file, str(file), body)
    from dmpcli.formats import ros_bag

    return ros_bag.read(file, body)


def _hashes(path: Path) -> list[dict[str, str]]:
    """Entries of `Provenance.inputs` of a file or of all files of a folder, in order."""
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    found = []
    for file in files:
        with file.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
        found.append({"role": "recording", "sha256": digest})
    return found


_OPTIONS: dict[str, tuple[str, ...]] = {
    TABLE: (),
    "svg": ("speed", "lift", "tolerance", "rate"),
    "gcode": ("tolerance", "rate", "travel_speed"),
    "urscript": ("rate",),
    "krl": ("rate",),
    "rapid": ("rate",),
    "mcap": (),
    "ros2": (),
    "lerobot": (),
}
_OF_TABLES = (
    "layout",
    "map_",
    "columns",
    "time_unit",
    "angle_unit",
    "rotation",
    "sample_rate",
    "repeated_stamps",
    "drop_duplicates",
    "decimal",
)


def _check_given(kind: str, given: Mapping[str, Any]) -> None:
    """Refuse options that say nothing of a kind of file."""
    own = {name for names in _OPTIONS.values() for name in names} - set(_OPTIONS[kind])
    alone = [name for name in given if name in own]
    if kind != TABLE:
        alone += [name for name in given if name in _OF_TABLES]
        alone += ["body"] if "body" in given and kind not in ("mcap", "ros2") else []
        alone += ["length_unit"] if "length_unit" in given and kind != "svg" else []
    if alone:
        flag = f"--{alone[0].rstrip('_').replace('_', '-')}"
        raise InputError(f"{flag}: says nothing of a {kind} file; leave it out")


def strokes_of(
    source: Source, kind: str, options: ImportOptions, form: Layout | None = None
) -> list[MotionStroke]:
    """Return the strokes of a file of some kind.

    Parameters
    ----------
    source : Source
    kind : str
        Of `settings.import_file.KINDS`.
    options : ImportOptions
    form : Layout, optional

    Raises
    ------
    InputError
        It cannot be read.
    """
    if kind == TABLE:
        found = whole(source, form, wrench=True)
        stroke = found.stroke
        return [MotionStroke(stroke.t, stroke.position, stroke.rotation, wrench=found.wrench)]
    if kind == "svg":
        from dmpcli.formats import svg_paths

        unit = None if form is None or "length" not in form.said else form.length
        drawn, told = svg_paths.decode(
            source, options.speed, options.lift, options.tolerance, options.rate, unit
        )
        for line in told:
            tell(f"{source.name}: {line}")
        return [drawn]
    if kind == "gcode":
        from dmpcli.formats import gcode

        strokes = gcode.decode(source, options.tolerance, options.travel_speed)
    else:
        from dmpcli.formats import krl, rapid, urscript

        readers = {"urscript": urscript.decode, "krl": krl.decode, "rapid": rapid.decode}
        strokes = readers[kind](source)
    return [sampled(one, options.rate, source.name) for one in strokes]


MOST_SAMPLES = 1_000_000
"""Of a program: hours of it."""

_AT_ONCE = 1 << 14
"""Samples whose rotations are interpolated at once: what that takes in between is large."""


def sampled(one: MotionStroke, rate: float, name: str) -> MotionStroke:
    """Return the straight motion of a program at even times, its corners among them.

    Parameters
    ----------
    one : MotionStroke
        Its corners.
    rate : float
        Hz; between two corners the samples are even, and at least so many.
    name : str
        Of the file.

    Raises
    ------
    InputError
        It takes too long.
    """
    if not one.duration * rate <= MOST_SAMPLES:
        raise InputError(
            f"{name}: takes {one.duration:.0f} s, too many samples; give a lower --rate"
        )
    counts = np.maximum(np.ceil(np.diff(one.t) * rate - 1e-6).astype(int), 1)
    ends = np.concatenate([[0], np.cumsum(counts)])
    t = np.interp(np.arange(ends[-1] + 1), ends, one.t)
    t = t[np.concatenate([[True], np.diff(t) > 0.0])]
    position = np.column_stack([np.interp(t, one.t, axis) for axis in one.position.T])
    R = None
    if one.rotation is not None:
        R = np.empty((len(t), 3, 3))
        for first in range(0, len(t), _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            R[part] = interpolate(one.t, np.asarray(one.rotation), t[part])
    return replace(one, t=t, position=position, rotation=R)


def demonstrations(
    one: MotionStroke | PoseBlocks,
    inputs: Sequence[dict[str, str]],
    options: dict[str, Any],
    name: str,
) -> Iterator[Record]:
    """Yield the record of a stroke that came in, some rows at a time.

    Parameters
    ----------
    one : MotionStroke or PoseBlocks
    inputs : sequence of dict
        Entries of `Provenance.inputs`.
    options : dict
    name : str
        Of the file it came from.

    Raises
    ------
    InputError
        A place that no reader of demonstrations would take.
    """
    origin = Provenance("import", options, tuple(inputs))
    count, last = 0, None
    for part in (one,) if isinstance(one, MotionStroke) else one.blocks():
        _check_place(part, name, count)
        columns: dict[str, Any] = {"t": np.asarray(part.t, dtype=float)}
        columns |= dict(zip(POSITION, np.asarray(part.position, dtype=float).T, strict=True))
        if part.rotation is not None:
            R = np.asarray(part.rotation)
            angles = to_euler_continuous(R) if last is None else to_euler_continued(R, *last)
            last = R[-1], angles[-1]
            columns |= dict(zip(EULER_ANGLES, angles.T, strict=True))
        if part.wrench is not None:
            columns |= dict(zip(WRENCH, part.wrench.T, strict=True))
        yield Record(schemas.DEMONSTRATION, columns, origin)
        count += len(part)


def _check_place(part: MotionStroke, name: str, before: int) -> None:
    beyond = ~(np.abs(part.position) <= FARTHEST).all(axis=1)
    if beyond.any():
        raise InputError(
            f"{name}: stroke {part.id}, sample {before + int(np.argmax(beyond)) + 1}: the position "
            f"is beyond {FARTHEST:g} mm; check the units that its program wrote"
        )


def _switched(one: MotionStroke) -> str:
    """Say what a stroke switches, which no demonstration holds, and how to have it again."""
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(one.position, axis=0), axis=1))])
    words = []
    for event in one.events[:10]:
        place = np.interp(event.t, one.t, gone)
        words.append(f"--event {'on' if event.on else 'off'}@{place:.4f}mm:{event.output}")
    more = "" if len(one.events) <= 10 else f" and {len(one.events) - 10} more"
    return (
        f"stroke {one.id!r} switches outputs, and a demonstration holds none: generalize "
        f"{' '.join(words)}{more} does"
    )


def _safe(name: str) -> str:
    return "".join(c if c.isalnum() or c in "-_.+" else "_" for c in name)

"""Demonstrations from any recording: ours, or a table with ``t x y z`` under any names and units.

Lengths, angles and times of other makes are converted here, at the edge, and what was assumed of
them is told.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.errors import InputError, counted
from dmpcli.records import (
    episodes,
    layouts,
    motive,
    plausibility,
    qualisys,
    record,
    rotation_forms,
    rotation_names,
    schemas,
    stamps,
    tables,
    trc,
    vicon,
)
from dmpcli.records.columns import FARTHEST, all_within
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import ANGLE, LAYOUTS, LENGTH, NANOSECONDS, TIME, Layout, LayoutColumn
from dmpcli.records.rotation_forms import EULER_NAMES, QUATERNION_NAMES
from dmpcli.records.schemas import EULER_ANGLES
from dmpcli.records.table import Table
from dmpcli.records.tables import HeadlessError
from dmpcli.records.untrusted import decoder
from dmpcli.spatial import recording_gaps, rotations
from dmpcli.spatial.trajectory import Trajectory

SHORTEST = 10
"""Fewer samples than this are no stroke."""

LONGEST = 1e6
"""A recording longer than this, s, is in another unit of time."""

SHORTEST_STEP = 1e-6
"""Rows nearer to each other than this, s, are in another unit of time."""

SHORTEST_GAP = 5e-10
"""No recorder counts finer than ns: single rows nearer than this, s, are no two times."""

LARGEST_TURN = 4 * np.pi
"""Angles beyond this, rad, are in degrees."""

_FEW_DIGITS = 0.2
"""Where more than this part of the stamps repeats, they were written with too few digits."""


Span = tuple[float | None, float | None]
"""Begin and end of what is wanted, s; None is that of the recording."""


@dataclass(frozen=True)
class Recording:
    """A demonstration as read.

    Attributes
    ----------
    stroke : Trajectory
    told : tuple of str
        How it was read, and what was assumed for that.
    doubts : tuple of str
        What is likely wrong with it, with the remedy.
    ours : bool
        Whether it is a file of this program's, which tells its units and angles.
    began : float or None
        What the file's clock shows at time 0, s; None where it shows dates, or there is none.
    wrench : array, shape (T, 6), or None
        On the tool, at the TCP, base axes, N and N·m, where it was asked for and is there.
    """

    stroke: Trajectory
    told: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    ours: bool = False
    began: float | None = None
    wrench: Floats | None = None


@dataclass
class _Reading:
    """A table on its way to a stroke: what was read of it, its units, the remarks so far."""

    table: Table
    layout: Layout
    taken: list[str] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
    sure: set[str] = field(default_factory=set)

    @property
    def names(self) -> list[str]:
        return list(self.table.columns)

    def find(self, ours: str) -> LayoutColumn | None:
        """Find one of our columns and count it as read."""
        try:
            column = layouts.found(self.layout, self.names, ours)
        except InputError as error:
            raise InputError(f"{self.table.name}: {error}") from None
        if column is not None:
            self.taken.append(column.name)
        return column

    def unit(self, column: LayoutColumn, kind: str, known: dict[str, float]) -> str:
        """Return a column's unit: as an option says, else its name, else the layout."""
        named = column.unit
        if named not in known and not column.name.endswith(("]", ")")):
            # An ending such as _m or _s that is part of the name.
            named = None
        unit: str = getattr(self.layout, kind)
        if named is not None and kind not in self.layout.said:
            if named not in known:
                raise InputError(
                    f"{self.table.name}: column {column.name!r}: unit {named!r} is not one of "
                    f"{', '.join(known)}; say which with --{kind}-unit"
                )
            unit = named
            if self.units.get(kind) != unit:
                self.told.append(f"{kind} read in {unit}, as column {column.name!r} says")
            self.sure.add(kind)
        self.units[kind] = unit
        return unit


@decoder
def read(
    source: Source, layout: Layout | None = None, wrench: bool = False, span: Span = (None, None)
) -> Recording:
    """Read a demonstration for learning.

    Parameters
    ----------
    source : Source
        One of our demonstration files, or any CSV or Parquet table.
    layout : Layout, optional
        Of another program's table; one of ours tells its own.
    wrench : bool
        Whether a wrench is wanted too, as `export` writes it: fx ... tz with N and N·m beside.
    span : (float or None, float or None)
        What of it is wanted, s from its first sample: a gap outside of that is no matter.

    Raises
    ------
    InputError
        A column is missing, holds text, NaN or infinity, time repeats or runs backward, there are
        fewer than `SHORTEST` samples or a long gap, or the stroke is far too small for its unit of
        length; names column and row, and the option that helps.
    """
    if record.is_ours(source):
        ours = record.decode(source, schemas.DEMONSTRATION)
        _partly_null(ours)
        stroke = Trajectory(ours.t, ours.position(), ours.rotation())
        _check_time(Table(source.name, ours.columns), stroke.t, "t", span)
        _check_position(Table(source.name, ours.columns), stroke.position)
        felt = _own_wrench(ours) if wrench else None
        return Recording(stroke, ours=True, began=0.0, wrench=felt)
    if source.content.lstrip()[:1] == b"{":
        raise InputError(f"{source.name}: is JSON, not a recording; a recording is CSV or Parquet")
    given = layout or Layout()
    reading = _recognised(_Reading(*_table(source, given)))
    reading.told += reading.table.remarks
    reading.table = episodes.chosen(reading.table, given.episode, _times(reading))
    t, name = _time(reading)
    position = _position(reading)
    rotation = _rotation(reading)
    felt = _wrench(reading) if wrench else None
    stroke = Trajectory(t, position, rotation)
    if "sample_rate" not in given.said:
        stroke = _without_repeats(reading, stroke, name)
    _check_time(reading.table, stroke.t, name, span)
    _check_position(reading.table, stroke.position)
    kept = recording_gaps.inside(stroke.t, *span)
    _doubt_units(reading, Trajectory(stroke.t[kept], stroke.position[kept]))
    reading.doubts += rotation_names.unread(reading.names, reading.taken, rotation is not None)
    if felt is not None and len(felt) != len(stroke.t):
        felt = None
        reading.told.append("the wrench is left out: rows with one stamp were made one")
    began = _began(reading, name, float(t[0]))
    told, doubts = tuple(reading.told), tuple(reading.doubts)
    return Recording(stroke, told, doubts, began=began, wrench=felt)


def stroke(source: Source, layout: Layout | None = None) -> Trajectory:
    """Read a demonstration, see `read`, without what there is to say of it."""
    return read(source, layout).stroke


def export_of(source: Source) -> tuple[str, Table] | None:
    """Read an export that tells itself by its first lines; None where it is none.

    Returns
    -------
    str, Table
        The layout that reads it, and what it holds.
    """
    if motive.is_motive(source):
        return "motive", motive.read(source)
    for kind in (vicon, qualisys, trc):
        if kind.matches(source):
            return kind.LAYOUT, kind.read(source)
    return None


def _table(source: Source, layout: Layout) -> tuple[Table, Layout]:
    """Read a table by its header, by the names given, or by those of its format."""
    if motive.is_motive(source):
        if not layout.columns:
            raise InputError(f"{source.name}: is an export of Motive; --layout motive reads it")
        return motive.read(source), layout
    export = export_of(source)
    if export is not None:
        name, table = export
        if layout.columns:
            return table, layout
        remark = f"recognised as --layout {name}; another --layout or --map says else"
        given = {key: getattr(layout, key) for key in layout.said if key != "map"}
        known = layouts.adapted(LAYOUTS[name], (), given)
        return replace(table, remarks=(remark, *table.remarks)), known
    names = layout.header if "header" in layout.said else ()
    try:
        return tables.read(source, names, layout.decimal, episodes.NAMES), layout
    except HeadlessError as error:
        commented = tables.commented_names(source, error.count)
        if commented and _all_found(layout, commented):
            return tables.read(source, commented, layout.decimal, episodes.NAMES), layout
        if layout.header:
            return tables.read(source, layout.header, layout.decimal, episodes.NAMES), layout
        raise InputError(f"{source.name}: {_headless(error, commented)}") from None


def _recognised(reading: _Reading) -> _Reading:
    """Take the one layout that fits a table which has neither our names nor a layout named."""
    if reading.layout.columns or _has_ours(reading):
        return reading
    suits = layouts.suited(reading.names)
    if len(suits) == 1:
        [name] = suits
        given = {key: getattr(reading.layout, key) for key in reading.layout.said if key != "map"}
        reading.layout = layouts.adapted(LAYOUTS[name], (), given)
        reading.told.append(f"recognised as --layout {name}; another --layout or --map says else")
    return reading


def _has_ours(reading: _Reading) -> bool:
    """Tell whether all of t, x, y and z stand under our own names."""
    plain = Layout()
    wanted = "xyz" if reading.layout.sample_rate is not None else ("t", *"xyz")
    return all(layouts.found(plain, reading.names, ours) is not None for ours in wanted)


def _all_found(layout: Layout, names: list[str]) -> bool:
    return all(layouts.found(layout, names, ours) is not None for ours in ("t", *"xyz"))


def _headless(error: HeadlessError, commented: list[str] | None) -> str:
    """Say which option reads a table without header."""
    if commented:
        suits = layouts.suited(commented)
        how = f"--layout {suits[0]}" if suits else f"--columns {','.join(commented)}"
        return f"the names of the columns are commented out; {how} reads them"
    likely = {
        3: "--columns x,y,z --sample-rate HZ",
        10: "--layout ros --columns header.stamp.sec,header.stamp.nanosec,header.frame_id,"
        "pose.position.x,pose.position.y,pose.position.z,pose.orientation.x,pose.orientation.y,"
        "pose.orientation.z,pose.orientation.w (ros2 topic echo --csv of a PoseStamped)",
        12: "--layout kitti --sample-rate HZ (KITTI: a pose matrix row by row, no time)",
        13: "--columns t,r11,r12,r13,x,r21,r22,r23,y,r31,r32,r33,z --rotation matrix",
        4: "--columns t,x,y,z",
        7: "--columns t,x,y,z,rx,ry,rz",
        8: "--layout tum (t x y z qx qy qz qw)",
    }
    how = likely.get(error.count, "--columns t,x,y,z,...")
    return (
        f"line {error.line} holds {counted(error.count, 'number')}, not names of columns; name the "
        f"columns in order, as {how} does"
    )


def _times(reading: _Reading) -> list[str]:
    """Names of the columns that time is read from."""
    named = [layouts.found(reading.layout, reading.names, "t")] if reading.names else []
    return [column.name for column in named if column is not None]


def _time(reading: _Reading) -> tuple[Floats, str]:
    """Time of each row, s, and the column's name."""
    table, layout = reading.table, reading.layout
    column = reading.find("t")
    if layout.sample_rate is not None:
        if column is not None:
            reading.told.append(f"column {column.name!r} is not read, since --sample-rate counts")
        return np.arange(len(table)) / layout.sample_rate, "t"
    if column is None:
        raise InputError(f"{table.name}: {_no_column(reading, 't')}")
    within = reading.find(NANOSECONDS)
    if within is None and layout.columns == LAYOUTS["ros"].columns:
        return _ros_time(reading, column), column.name
    unit = reading.unit(column, "time", TIME)
    return stamps.seconds(table, column.name, unit, within.name if within else None), column.name


def _began(reading: _Reading, name: str, first: float) -> float | None:
    """Return what the clock of a table showed at time 0, s; None without one of numbers."""
    column = reading.find("t")
    if reading.layout.sample_rate is not None or column is None:
        return None
    began = stamps.clock(reading.table, name, reading.units["time"], first)
    within = reading.find(NANOSECONDS)
    if began is None or within is None:
        return began
    return began + float(reading.table.numbers(within.name)[0]) * 1e-9


def _ros_time(reading: _Reading, column: LayoutColumn) -> Floats:
    """Read stamps of ROS in one column: nanoseconds where they are whole and that large."""
    values = reading.table.numbers(column.name)
    whole = len(values) > 0 and values[0] > 1e14
    unit = "ns" if whole and "time" not in reading.layout.said else reading.layout.time
    reading.units["time"] = unit
    return stamps.seconds(reading.table, column.name, unit)


def _own_wrench(ours: record.Record) -> Floats | None:
    if not ours.has(*schemas.WRENCH):
        return None
    values = ours.stack(schemas.WRENCH)
    return None if np.isnan(values).any() else values


def _wrench(reading: _Reading) -> Floats | None:
    """Wrench of each row, shape (T, 6); None where no columns hold one in N and N·m, as ours do."""
    found = {layouts.parted(name): name for name in reading.names}
    wanted = [(name, "N" if name in schemas.FORCE else "N·m") for name in schemas.WRENCH]
    if not all(key in found for key in wanted):
        if all(any(parted[0] == name for parted in found) for name in schemas.WRENCH):
            reading.told.append(
                "fx ... tz are not read: [N] and [N·m] in their names would say that they are the "
                "wrench on the tool, at the TCP, in base axes"
            )
        return None
    names = [found[key] for key in wanted]
    empty = np.any([reading.table.empty(name) for name in names])
    if empty:
        reading.told.append("the wrench is left out: it is not known in every row")
        return None
    reading.told.append("fx ... tz read as the wrench on the tool, at the TCP, in base axes")
    return np.column_stack([reading.table.numbers(name) for name in names])


def _position(reading: _Reading) -> Floats:
    """Position of each row, mm, shape (T, 3)."""
    axes = []
    for ours in "xyz":
        column = reading.find(ours)
        if column is None:
            raise InputError(f"{reading.table.name}: {_no_column(reading, ours)}")
        factor = LENGTH[reading.unit(column, "length", LENGTH)]
        axes.append(reading.table.numbers(column.name) * factor)
    return np.stack(axes, axis=1)


def _no_column(reading: _Reading, ours: str) -> str:
    """Say that a column is missing, and what could read the table as it is."""
    names = reading.names
    shown = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
    wanted = reading.layout.names(ours)[0]
    text = f"column {wanted!r} is missing; it has {shown}"
    suits = layouts.suited(names)
    if suits and not reading.layout.columns:
        return f"{text}; --layout {' or '.join(suits)} reads it"
    if ours == "t":
        return f"{text}; name the column of time with --map t=COLUMN, or say --sample-rate HZ"
    return f"{text}; say which it is with --map {ours}=COLUMN"


def _rotation(reading: _Reading) -> Floats | None:
    """Rotation of each row, shape (T, 3, 3); None where no columns hold any."""
    form, assumed = reading.layout.rotation, False
    if form is None:
        euler = any(layouts.found(reading.layout, reading.names, n) for n in EULER_NAMES)
        form, assumed = ("euler" if euler else "quaternion"), True
    wanted = rotation_forms.columns_of(form)
    columns = _rotation_columns(reading, form, wanted, assumed)
    if columns is None:
        return None
    values = np.stack([reading.table.numbers(column.name) for column in columns], axis=1)
    by = ", ".join(column.name for column in columns[:4]) + ("" if len(columns) < 5 else ", ...")
    bad = rotation_forms.wrong(form, values)
    if bad is not None:
        if assumed:
            return None
        raise InputError(
            f"{reading.table.name}: {reading.table.at(bad[0])}: {bad[1]}; check which columns are "
            "mapped"
        )
    if wanted == EULER_NAMES:
        values = values * ANGLE[reading.unit(columns[0], "angle", ANGLE)]
        if np.abs(values).max() > LARGEST_TURN:
            row = int(np.argmax(np.abs(values).max(axis=1) > LARGEST_TURN))
            raise InputError(
                f"{reading.table.name}: {reading.table.at(row)}: an angle of "
                f"{np.abs(values[row]).max():g} rad; check the unit of angle (--angle-unit deg)"
            )
    reading.taken += [column.name for column in columns]
    R = rotation_forms.matrices(form, values)
    reading.told.append(
        f"{by} read as {rotation_forms.described(form)}"
        f"{' (assumed; --rotation says otherwise)' if assumed else ''}; the tool leans "
        f"{rotation_forms.lean(R[0]):.1f}° from straight down at the start"
    )
    if assumed and form == "euler":
        calmer = rotation_forms.calmer(values, R)
        if calmer is not None:
            reading.doubts.append(
                f"the tool leaps between samples where {by} are read as Euler angles; it does not "
                f"with --rotation {calmer}"
            )
    return R


def _rotation_columns(
    reading: _Reading, form: str, wanted: tuple[str, ...], assumed: bool
) -> list[LayoutColumn] | None:
    """Find the columns of a form of rotation; None where there are none."""
    names = reading.names
    found = [layouts.found(reading.layout, names, ours) for ours in wanted]
    if not any(found) and wanted == QUATERNION_NAMES and not assumed:
        try:
            by = rotation_forms.numbered(form, names)
        except InputError as error:
            raise InputError(f"{reading.table.name}: {error}") from None
        found = [LayoutColumn(by[ours]) if ours in by else None for ours in wanted]
    present = [column for column in found if column is not None]
    if len(present) == len(wanted):
        return present
    if present and not (assumed and wanted == QUATERNION_NAMES):
        missing = wanted[found.index(None)]
        raise InputError(
            f"{reading.table.name}: column {reading.layout.names(missing)[0]!r} is missing, but "
            "other rotation columns are there; map all of them, or none"
        )
    if "rotation" in reading.layout.said:
        raise InputError(
            f"{reading.table.name}: --rotation {form}: columns {', '.join(wanted)} are missing; "
            f"map them, as in --map {wanted[0]}=COLUMN"
        )
    return None


def _without_repeats(reading: _Reading, stroke: Trajectory, name: str) -> Trajectory:
    """Act on rows with one and the same stamp as the layout says."""
    how = reading.layout.repeated
    same = np.diff(stroke.t) == 0
    if how == "error" or not same.any():
        return stroke
    starts: Integers = np.flatnonzero(np.r_[True, ~same])
    sizes = np.diff(np.r_[starts, len(stroke.t)])
    reading.told.append(
        f"{counted(int(same.sum()), 'row')} repeated the stamp before (column {name!r}): "
        f"{'the first of each is kept' if how == 'first' else 'their means are taken'}"
    )
    position, R = stroke.position[starts], stroke.rotation
    if how == "mean":
        position = np.add.reduceat(stroke.position, starts, axis=0) / sizes[:, None]
    if R is not None and how == "mean":
        q = rotations.to_quaternion(R)
        # Both signs of a quaternion are one rotation: that of the first of each stamp.
        q *= np.where(np.sum(q * np.repeat(q[starts], sizes, axis=0), axis=1) < 0, -1, 1)[:, None]
        R = rotations.from_quaternion(np.add.reduceat(q, starts, axis=0))
    elif R is not None:
        R = R[starts]
    return Trajectory(stroke.t[starts], position, R)


def _doubt_units(reading: _Reading, stroke: Trajectory) -> None:
    """Doubt a stroke that no hand or arm draws; refuse one far too small for an unsaid unit."""
    found = plausibility.measures(stroke.t, stroke.position)
    length = reading.units.get("length", reading.layout.length)
    time = reading.units.get("time", reading.layout.time)
    doubts = plausibility.doubts(found, length, time)
    sure = "length" in reading.sure or "length" in reading.layout.said
    if 0.0 < found.extent < plausibility.REFUSED and not sure:
        raise InputError(
            f"{reading.table.name}: {doubts[0]}; if it is right, --length-unit {length} says so"
        )
    reading.doubts += doubts


def _partly_null(ours: record.Record) -> None:
    for name in EULER_ANGLES:
        if ours.has(name) and np.isnan(ours.columns[name]).any():
            row = int(np.argmax(np.isnan(ours.columns[name])))
            raise InputError(
                f"{ours.name}: column {name!r}, row {row + 1}: no value, but other rows have one; "
                "fill it in or leave the orientation out"
            )


def _check_time(table: Table, t: Floats, name: str, span: Span) -> None:
    if len(t) < SHORTEST:
        raise InputError(f"{table.name}: {len(t)} samples; a stroke needs at least {SHORTEST}")
    steps = np.diff(t)
    if np.any(steps <= 0):
        row = int(np.argmax(steps <= 0)) + 1
        repeats = steps[row - 1] == 0
        raise InputError(
            f"{table.name}: column {name!r}, {table.at(row)}: time "
            f"{'repeats' if repeats else 'runs backward'} "
            f"({t[row - 1]:.6g} s, then {t[row]:.6g} s); {_repeated(steps) if repeats else _SORT}"
        )
    step = float(np.median(steps))
    if t[-1] - t[0] > LONGEST:
        raise InputError(
            f"{table.name}: column {name!r}: spans {t[-1] - t[0]:.3g} s; "
            "check the unit of time (--time-unit ms, us or ns)"
        )
    if step < SHORTEST_STEP:
        raise InputError(
            f"{table.name}: column {name!r}: rows are {step:.3g} s apart; "
            "check the unit of time (--time-unit)"
        )
    if np.any(steps < SHORTEST_GAP):
        row = int(np.argmax(steps < SHORTEST_GAP)) + 1
        raise InputError(
            f"{table.name}: column {name!r}, {table.at(row)}: comes {steps[row - 1]:.3g} s after "
            "the row before; mend or remove the row, or check the unit of time (--time-unit)"
        )
    kept = recording_gaps.inside(t, *span)
    gaps = steps[kept.start : kept.stop - 1]
    if np.any(gaps > recording_gaps.LONGEST_GAP * step):
        row = kept.start + int(np.argmax(gaps)) + 1
        raise InputError(
            f"{table.name}: column {name!r}, {table.at(row)}: nothing was recorded "
            f"for {steps[row - 1]:.6g} s, {steps[row - 1] / step:.0f} samples; cut the file there, "
            "or record again; fit leaves out what lies before or after with --from "
            f"{t[row] - t[0]:.6g} or --until {t[row - 1] - t[0]:.6g}"
        )


_SORT = "sort the rows"


def _repeated(steps: Floats) -> str:
    """Say what to do about stamps that repeat."""
    if np.mean(steps == 0) > _FEW_DIGITS:
        return (
            f"{int(np.sum(steps == 0))} stamps do: they have too few digits; --sample-rate HZ "
            "counts the rows instead"
        )
    return "--repeated-stamps first or mean makes one row of those with the same stamp"


def _check_position(table: Table, position: Floats) -> None:
    if not all_within(position, FARTHEST):
        row = int(np.argmax(np.abs(position).max(axis=1) > FARTHEST))
        raise InputError(
            f"{table.name}: {table.at(row)}: the position is beyond {FARTHEST:g} mm; check the "
            "unit of length (--length-unit)"
        )

"""How the tables of other programs map to ours: their columns, their units, what their angles are.

Each known layout is publicly documented by its makers; docs/conventions.md lists them.
"""

import functools
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dmpcli.errors import InputError
from dmpcli.records import rotation_forms
from dmpcli.records.rotation_forms import EULER_NAMES, MATRIX_NAMES, QUATERNION_NAMES

LENGTH = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGLE = {"rad": 1.0, "deg": np.pi / 180.0}

NANOSECONDS = "t_ns"
"""A second column of time: nanoseconds within the second, as ROS stamps have them."""

MAPPABLE = ("t", NANOSECONDS, "x", "y", "z", *EULER_NAMES, *QUATERNION_NAMES, *MATRIX_NAMES)
REPEATED = ("error", "first", "mean")

_SPELLINGS = {
    "mm": "mm millimetre millimetres millimeter millimeters",
    "cm": "cm centimetre centimetres centimeter centimeters",
    "m": "m metre metres meter meters",
    "in": "in inch inches",
    "s": "s sec secs second seconds",
    "ms": "ms msec millisecond milliseconds",
    "us": "us usec µs μs microsecond microseconds",
    "ns": "ns nsec nanosecond nanoseconds",
    "rad": "rad radian radians",
    "deg": "deg degree degrees °",
    "": "1 -",
}
_UNITS = {spelling: unit for unit, all_ in _SPELLINGS.items() for spelling in all_.split()}
_OPENED = {"]": "[", ")": "("}
_SUFFIX = re.compile(r"^(.+)_(mm|cm|m|s|sec|ms|us|ns|rad|deg)$")

_TIMES = ("t", "time", "Time", "timestamp", "Timestamp", "stamp", "time_s")
_SECONDS = ("header.stamp.sec", "header.stamp.secs", "stamp.sec", "stamp.secs")
_NANOSECONDS = ("header.stamp.nanosec", "header.stamp.nsecs", "stamp.nanosec", "stamp.nsecs")


@dataclass(frozen=True)
class Layout:
    """How another program's table maps to ours.

    Attributes
    ----------
    columns : dict of str to tuple of str
        By our column (t, x, y, z, rx, ry, rz, or qx, qy, qz, qw, ...) the names that it may have
        there, the likeliest first.
    length, time, angle : str
        Its units, where its header does not say others.
    rotation : str, optional
        What its rotation columns hold, see `rotation_forms`; unsaid, the names decide.
    header : tuple of str
        Names of its columns in order, where the file has none.
    prefixed : bool
        Whether something may stand before its names: a topic, a rigid body.
    body : str, optional
        Which of several bodies or topics: what stands before its names.
    decimal : {'.', ','}, optional
        The decimal sign; unsaid, commas are recognised where nothing else can be meant.
    sample_rate : float, optional
        Hz; the rows are counted instead of reading a column of time.
    repeated : {'error', 'first', 'mean'}
        What becomes of rows with one and the same stamp.
    episode : str, optional
        Which of several recordings of one table; see `episodes`.
    said : tuple of str
        Which of these were said for this file, and are no part of a known layout.
    """

    columns: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    length: str = "mm"
    time: str = "s"
    angle: str = "rad"
    rotation: str | None = None
    header: tuple[str, ...] = ()
    prefixed: bool = False
    body: str | None = None
    decimal: str | None = None
    sample_rate: float | None = None
    repeated: str = "error"
    episode: str | None = None
    said: tuple[str, ...] = ()

    def names(self, ours: str) -> tuple[str, ...]:
        """Return the names that one of our columns may have."""
        return self.columns.get(ours, (ours,))

    def as_options(self) -> dict[str, Any]:
        """Return the layout as JSON values, for the provenance of what was read with it."""
        options: dict[str, Any] = {
            "columns": {ours: list(names) for ours, names in self.columns.items()},
            "length": self.length,
            "time": self.time,
            "angle": self.angle,
            "rotation": self.rotation,
        }
        for name in ("header", "body", "decimal", "sample_rate", "repeated", "episode"):
            value = getattr(self, name)
            if value != getattr(Layout(), name):
                options[name] = list(value) if name == "header" else value
        return options


def _pose(position: Sequence[str], rotation: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """Names of a pose: templates of the position with {} for the axis, and of each angle."""
    columns = {axis: tuple(name.format(axis) for name in position) for axis in "xyz"}
    return columns | {ours: tuple(names) for ours, names in rotation.items()}


def _matrix(name: str) -> tuple[str, ...]:
    """Spellings of an entry of Franka's pose matrix."""
    number = int(name)
    return (
        f"O_T_EE[{number}]",
        f"O_T_EE_{number}",
        f"O_T_EE_{number:02d}",
        f"O_T_EE_{number}_",
        f"O_T_EE{number}",
        f"O_T_EE.{number}",
    )


def _entries(name: str, number: int) -> tuple[str, ...]:
    """Spellings of an entry of a list, as tables of one column per entry have them."""
    return f"{name}_{number}", f"{name}[{number}]", f"obs/{name}[{number}]", f"obs/{name}_{number}"


_MOTIVE = Layout(
    {"t": ("Time (Seconds)",)}
    | {axis: (f"Position.{axis.upper()}",) for axis in "xyz"}
    | {f"q{axis}": (f"Rotation.{axis.upper()}",) for axis in "xyzw"},
    length="m",
    rotation="quaternion",
    prefixed=True,
)

LAYOUTS = {
    # Universal Robots RTDE recordings (the csv_writer of its RTDE Python client library).
    "ur": Layout(
        {"t": ("timestamp",)}
        | {
            ours: (f"actual_TCP_pose_{i}",)
            for i, ours in enumerate(("x", "y", "z", "rx", "ry", "rz"))
        },
        length="m",
        rotation="rotvec",
    ),
    # TUM trajectory text: t x y z qx qy qz qw, with or without a (commented) header.
    "tum": Layout(
        {"t": _TIMES}
        | _pose(
            ("{}", "t{}", "p{}", "p_{}"),
            {f"q{axis}": (f"q{axis}", f"q_{axis}") for axis in "xyzw"},
        ),
        length="m",
        rotation="quaternion",
        header=("t", "x", "y", "z", *QUATERNION_NAMES),
    ),
    # PoseStamped, Odometry and TransformStamped of ROS 1 and 2 as tables: rostopic echo -p (field.
    # ... and stamps in ns), bag exporters, PlotJuggler (/topic/pose/position/x).
    "ros": Layout(
        {
            "t": (*_SECONDS, "header.stamp", "%time", "__time", "stamp", "Time", "timestamp"),
            NANOSECONDS: _NANOSECONDS,
        }
        | _pose(
            (
                "pose.pose.position.{}",
                "pose.position.{}",
                "transform.translation.{}",
                "position.{}",
            ),
            {
                f"q{axis}": tuple(
                    f"{part}.{axis}"
                    for part in (
                        "pose.pose.orientation",
                        "pose.orientation",
                        "transform.rotation",
                        "orientation",
                    )
                )
                for axis in "xyzw"
            },
        ),
        length="m",
        rotation="quaternion",
        prefixed=True,
    ),
    # Ground truth of EuRoC MAV and TUM VI (ASL): #timestamp [ns], p_RS_R_x [m], ..., q_RS_w [], ...
    "euroc": Layout(
        {"t": ("timestamp",)}
        | _pose(("p_RS_R_{}",), {f"q{axis}": (f"q_RS_{axis}",) for axis in "xyzw"}),
        length="m",
        time="ns",
        rotation="quaternion",
        header=("timestamp", *(f"p_RS_R_{a}" for a in "xyz"), *(f"q_RS_{a}" for a in "wxyz")),
    ),
    # Franka (libfranka): O_T_EE, the pose of the end effector as a 4 x 4 matrix, column by column.
    "franka": Layout(
        {"t": (*_TIMES, "ros_time_sec", "stamp_sec"), NANOSECONDS: ("ros_time_nsec",)}
        | {axis: _matrix(str(12 + i)) for i, axis in enumerate("xyz")}
        | {f"r{i + 1}{j + 1}": _matrix(str(4 * j + i)) for i in range(3) for j in range(3)},
        length="m",
        rotation="matrix",
        prefixed=True,
    ),
    # KUKA: X Y Z in mm, A B C in degrees about z, y, x: R = Rz(A) Ry(B) Rx(C).
    "kuka": Layout(
        {"t": _TIMES}
        | {axis: (axis.upper(),) for axis in "xyz"}
        | {"rx": ("C",), "ry": ("B",), "rz": ("A",)},
        angle="deg",
        rotation="rpy",
        prefixed=True,
    ),
    # Fanuc: X Y Z in mm, W P R in degrees about x, y, z: R = Rz(R) Ry(P) Rx(W).
    "fanuc": Layout(
        {"t": _TIMES}
        | {axis: (axis.upper(),) for axis in "xyz"}
        | {"rx": ("W",), "ry": ("P",), "rz": ("R",)},
        angle="deg",
        rotation="rpy",
        prefixed=True,
    ),
    # OptiTrack Motive's CSV export of a rigid body; see `motive`, which reads its header.
    "motive": _MOTIVE,
    # The same by its maker's name.
    "optitrack": _MOTIVE,
    # Vicon's exports; see `vicon`, which reads their lines of subjects, columns and units.
    "vicon": Layout(
        {"t": ("Time",)}
        | {axis: (f"T{axis.upper()}", axis.upper()) for axis in "xyz"}
        | {f"q{axis}": (f"Quaternion.{axis.upper()}",) for axis in "xyzw"}
        | {f"r{axis}": (f"R{axis.upper()}",) for axis in "xyz"},
        rotation="quaternion",
        prefixed=True,
    ),
    # Qualisys Track Manager's TSV exports; see `qualisys`.
    "qualisys": Layout(
        {"t": ("Time",)}
        | {axis: (axis.upper(),) for axis in "xyz"}
        | {f"r{i}{j}": (f"R{i}{j}",) for i in "123" for j in "123"},
        rotation="matrix",
        prefixed=True,
    ),
    # Marker trajectories of OpenSim and Cortex; see `trc`.
    "trc": Layout({"t": ("Time",)} | {axis: (axis.upper(),) for axis in "xyz"}, prefixed=True),
    # KITTI's ground truth: the first three rows of a pose matrix, row by row, m; no time.
    "kitti": Layout(
        length="m",
        rotation="matrix",
        header=("r11", "r12", "r13", "x", "r21", "r22", "r23", "y", "r31", "r32", "r33", "z"),
    ),
    # NDI Polaris, Vega and Aurora, as the maker's sample programs of its combined API write them.
    "ndi": Layout(
        {"t": ("timespec_s",), NANOSECONDS: ("timespec_ns",)}
        | {axis: (f"T{axis}",) for axis in "xyz"}
        | {"qw": ("Q0", "q0")}
        | {f"q{axis}": (f"Q{axis}", f"q{axis}") for axis in "xyz"},
        rotation="quaternion",
    ),
    # robosuite, robomimic: observations of an arm, m, quaternions x y z w.
    "robomimic": Layout(
        {"t": _TIMES}
        | {axis: _entries("robot0_eef_pos", i) for i, axis in enumerate("xyz")}
        | {f"q{axis}": _entries("robot0_eef_quat", i) for i, axis in enumerate("xyzw")},
        length="m",
        rotation="quaternion",
    ),
    # UMI and its kin: the same with rotation vectors.
    "umi": Layout(
        {"t": _TIMES}
        | {axis: _entries("robot0_eef_pos", i) for i, axis in enumerate("xyz")}
        | {f"r{axis}": _entries("robot0_eef_rot_axis_angle", i) for i, axis in enumerate("xyz")},
        length="m",
        rotation="rotvec",
    ),
    # LeRobotDataset v2 and v3: what observation.state holds, meta/info.json says; m by custom.
    "lerobot": Layout(
        {"t": ("timestamp",)}
        | {axis: (f"observation.state[{i}]",) for i, axis in enumerate("xyz")},
        length="m",
    ),
    # Tables as export writes them.
    "dmpcli": Layout(rotation="XYZ"),
}


def adapted(base: Layout, mapping: Sequence[str], given: Mapping[str, Any]) -> Layout:
    """Return a layout with columns and units replaced.

    Parameters
    ----------
    base : Layout
    mapping : sequence of str
        ``OURS=THEIRS`` each.
    given : mapping
        ``length``, ``time``, ``angle`` (units), ``rotation`` (form), and the other attributes.

    Raises
    ------
    InputError
        An entry is not of that form, or names a column, unit or form that there is not.
    """
    columns = dict(base.columns)
    for entry in mapping:
        ours, equals, theirs = entry.partition("=")
        if not equals or not theirs or ours not in MAPPABLE:
            raise InputError(
                f"--map {entry}: must be OURS=THEIRS, with OURS one of {', '.join(MAPPABLE)}"
            )
        columns[ours] = (theirs,)
    choices: dict[str, tuple[str, Iterable[str]]] = {
        "length": ("--length-unit", LENGTH),
        "time": ("--time-unit", TIME),
        "angle": ("--angle-unit", ANGLE),
        "decimal": ("--decimal", (".", ",")),
        "repeated": ("--repeated-stamps", REPEATED),
    }
    for key, (option, known) in choices.items():
        if key in given and given[key] not in known:
            raise InputError(f"{option} {given[key]}: must be one of {', '.join(known)}")
    if "rotation" in given:
        rotation_forms.check(given["rotation"])
    rate = given.get("sample_rate")
    if rate is not None and not (np.isfinite(rate) and 0.0 < rate <= 1e6):
        raise InputError(f"--sample-rate {rate:g}: must be a number of Hz between 0 and 1e6")
    said = tuple(sorted({*base.said, *given, *(("map",) if mapping else ())}))
    return replace(base, columns=columns, said=said, **dict(given))


@functools.lru_cache(maxsize=1 << 14)
def parted(name: str) -> tuple[str, str | None]:
    """Part a column's name into the name itself and the unit that it tells.

    Returns
    -------
    str, str or None
        ``x [mm]`` gives x and mm, ``time_ms`` time and ms; an unknown unit comes back as it is,
        and None where there is none.
    """
    close = name[-1:]
    if close in _OPENED:
        # After the last bracket before: a pattern for this takes the square of a name's length.
        begin = name.find(_OPENED[close], name.rfind(close, 0, -1) + 1)
        if begin >= 0:
            said = name[begin + 1 : -1].strip()
            if said.isdigit() and said != "1":
                return name, None  # an entry of an array
            unit = _UNITS.get(said, _UNITS.get(said.lower(), said))
            return name[:begin].strip(), unit or None
    suffix = _SUFFIX.match(name)
    return (suffix[1], _UNITS[suffix[2]]) if suffix else (name, None)


@dataclass(frozen=True)
class LayoutColumn:
    """A column of a table as found: its own name, and the unit that its name tells."""

    name: str
    unit: str | None = None


def found(layout: Layout, names: Sequence[str], ours: str) -> LayoutColumn | None:
    """Find one of our columns in a table; None where it is not there.

    Parameters
    ----------
    layout : Layout
    names : sequence of str
        Of the table's columns.
    ours : str

    Raises
    ------
    InputError
        Several bodies or topics have it.
    """
    for wanted in layout.names(ours):
        if wanted in names:
            return LayoutColumn(wanted, parted(wanted)[1])
        bare = [name for name in names if parted(name)[0] == wanted]
        if len(bare) == 1:
            return LayoutColumn(bare[0], parted(bare[0])[1])
        if layout.prefixed:
            ends = {name: before for name in names if (before := _before(name, wanted)) is not None}
            if layout.body is not None and ours not in ("t", NANOSECONDS):
                body = layout.body.strip("/").replace("/", ".")
                ends = {name: before for name, before in ends.items() if before == body}
            if len(ends) > 1:
                bodies = ", ".join(sorted(set(ends.values())))
                raise InputError(f"several have {wanted}: {bodies}; choose one with --body NAME")
            if ends:
                (name,) = ends
                return LayoutColumn(name, parted(name)[1])
    return None


def _before(name: str, wanted: str) -> str | None:
    """What stands before a wanted end of a column's name, '' for nothing; None if it ends else."""
    plain = parted(name)[0].replace("/", ".").strip(".")
    if plain == wanted:
        return ""
    return plain[: -len(wanted) - 1] if plain.endswith(f".{wanted}") else None


def suited(names: Sequence[str]) -> list[str]:
    """Return the known layouts that find time, position and rotation among a table's columns."""
    suits = []
    for key, layout in LAYOUTS.items():
        if layout.rotation is None or key in ("dmpcli", "kitti"):
            continue  # it would fit anything
        wanted = ("t", *"xyz", *rotation_forms.columns_of(str(layout.rotation)))
        try:
            if all(found(layout, names, ours) is not None for ours in wanted):
                suits.append(key)
        except InputError:
            suits.append(key)
    return suits

"""What each Parquet file between the stages holds: columns, units, version.

Lengths in mm, angles in rad, time in s, force in N, torque in N·m, all in the robot's base frame.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

FRAME = "robot base"
EULER = "X-Y-Z intrinsic, R = Rx(rx) Ry(ry) Rz(rz)"


@dataclass(frozen=True)
class Column:
    """One column of a file: its unit, what it means, whether a reader demands it, and since when.

    A file is of the version of its newest column, so that an older reader refuses no file that it
    reads right.
    """

    unit: str
    meaning: str
    type: str = "double"
    required: bool = True
    since: int = 1


@dataclass(frozen=True)
class Schema:
    """The name, version and columns of one kind of file."""

    name: str
    version: int
    meaning: str
    columns: dict[str, Column] = field(default_factory=dict)

    def version_of(self, names: Iterable[str]) -> int:
        """Return the version of a file with these columns."""
        return max([1, *(self.columns[name].since for name in names if name in self.columns)])


OK = "ok"
"""Status of a pair that has a trajectory."""


POSITION = ("x", "y", "z")
EULER_ANGLES = ("rx", "ry", "rz")
POSE = POSITION + EULER_ANGLES
FORCE = ("fx", "fy", "fz")
TORQUE = ("tx", "ty", "tz")
WRENCH = FORCE + TORQUE
NORMAL = ("nx", "ny", "nz")
GOAL = ("xg", "yg", "zg")
FELT_NORMAL = ("nx_felt", "ny_felt", "nz_felt")
DRAWN_ON = ("drawn_on", "surface_sha256")
JOINTS = ("q1", "q2", "q3", "q4", "q5", "q6", "q7")
"""Of an arm with fewer joints the first ones; no arm with more is logged."""


def suffixed(names: tuple[str, ...], suffix: str) -> tuple[str, ...]:
    """Column names with a suffix: ``x`` → ``x_ref``."""
    return tuple(f"{name}_{suffix}" for name in names)


def _pose(meaning: str, suffix: str = "", required: bool = True) -> dict[str, Column]:
    tail = f"_{suffix}" if suffix else ""
    columns = {n + tail: Column("mm", f"{meaning}, position", required=required) for n in POSITION}
    return columns | {
        n + tail: Column("rad", f"{meaning}, Euler angle", required=False) for n in EULER_ANGLES
    }


def _wrench(meaning: str, suffix: str = "") -> dict[str, Column]:
    tail = f"_{suffix}" if suffix else ""
    columns = {n + tail: Column("N", f"{meaning}, force", required=False) for n in FORCE}
    return columns | {n + tail: Column("N·m", f"{meaning}, torque", required=False) for n in TORQUE}


DEMONSTRATION = Schema(
    "demonstration",
    1,
    "what the tool did while it was dragged, one row per control cycle",
    {"t": Column("s", "time since the recording began")}
    | _pose("actual TCP")
    | _pose("admittance reference", "ref", required=False)
    | _wrench("compensated wrench on the tool, at the TCP, base axes")
    | _wrench("wrench as sensed, sensor axes", "raw")
    | {
        "sensor_seq": Column("1", "sequence number of the sensor sample", "int64", required=False),
        "lost": Column("1", "sensor samples lost so far", "int64", required=False),
    },
)

EVENT = "event"
"""Column of what is switched; see `spatial.output_events.stored`."""

TRAJECTORY = Schema(
    "trajectory",
    2,
    "where the tool shall go",
    {
        "id": Column("1", "the start-goal pair", "string"),
        "t": Column("s", "time since the stroke began"),
    }
    | _pose("planned TCP")
    | {n: Column("1", "unit normal of the surface", required=False) for n in NORMAL}
    | {EVENT: Column("1", "outputs switched from this row to the next", "string", False, since=2)}
    | {"fn": Column("N", "force along the normal, 0 lifted", required=False, since=2)},
)

RUN = Schema(
    "run",
    1,
    "what was sent and what the arm did, one row per servo cycle",
    {
        "t": Column("s", "time since the first set-point"),
        "t_plan": Column("s", "time along the planned trajectory"),
    }
    | _pose("planned TCP", "plan")
    | _pose("sent set-point", "sent")
    | _pose("actual TCP")
    | {
        "deadline": Column("s", "when the set-point was due"),
        "lateness": Column("s", "how much later it was sent"),
    }
    | _wrench("compensated wrench on the tool, at the TCP, base axes")
    | {
        "coupling": Column("mm", "e of eq. (10), along the normal", required=False),
        "fn": Column("N", "force along the normal to press with, 0 lifted", required=False),
        "contact": Column("1", "state of the contact", "string", False),
        "state": Column("1", "robot state", "string"),
        "phase": Column("1", "approach, stroke, retract, transfer or stop", "string"),
        "id": Column("1", "the stroke that is drawn; none between strokes", "string", False),
    }
    | {n: Column("1", "unit normal of the surface as felt", required=False) for n in FELT_NORMAL}
    | {n: Column("mm", "the goal that the stroke is drawn to", required=False) for n in GOAL}
    | {n: Column("rad", "actual joint angle", required=False) for n in JOINTS}
    | {EVENT: Column("1", "outputs that were switched in this cycle", "string", False)},
)

PAIRS = Schema(
    "pairs",
    1,
    "the start-goal pairs of a batch and what became of each",
    {"id": Column("1", "the start-goal pair", "string")}
    | {
        f"{n}{end}": Column("mm", "start" if end == "0" else "goal", required=False)
        for end in "0g"
        for n in "xyz"
    }
    | {
        f"r{n}{end}": Column("rad", "start" if end == "0" else "goal", required=False)
        for end in "0g"
        for n in "xyz"
    }
    | {
        "duration": Column("s", "of the trajectory", required=False),
        "nx": Column("1", "unit normal of the pair's plane", required=False),
        "ny": Column("1", "unit normal of the pair's plane", required=False),
        "nz": Column("1", "unit normal of the pair's plane", required=False),
        "drawn_on": Column("1", "surface, as the table of pairs names it", "string", False),
        "surface_sha256": Column("1", "of the surface's file", "string", required=False),
        "part": Column("1", "file that holds the trajectory", "string", required=False),
        "status": Column("1", "ok, or why there is no trajectory", "string"),
    },
)

POSES = Schema(
    "poses",
    1,
    "static poses for the calibration, one row per pose, as the dwell there had it in the mean",
    {"t": Column("s", "when the dwell ended, since the calibration began")}
    | _pose("actual TCP")
    | _wrench("mean wrench as sensed, sensor axes", "raw")
    | _wrench("standard deviation of one reading", "std")
    | {
        "samples": Column("1", "readings in the mean", "int64"),
        "moved": Column("mm", "how far the TCP moved meanwhile", required=False),
        "turned": Column("rad", "how far the tool turned meanwhile", required=False),
        "unsteady": Column("N", "change of the force between the dwell's halves", required=False),
    },
)

SCHEMAS = {s.name: s for s in (DEMONSTRATION, TRAJECTORY, RUN, PAIRS, POSES)}

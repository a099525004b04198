"""The options of ``bench://ARM?...``, from which the bench is made."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from dmpcli.bench import description
from dmpcli.bench.links import arms
from dmpcli.bench.mesh_workpieces import COLLISIONS, read
from dmpcli.bench.parameters import BenchParameters, JointServos, Pen, WristSensor
from dmpcli.bench.workpiece import (
    Edge,
    Flat,
    Nothing,
    Ramp,
    Round,
    Slot,
    Step,
    Workpiece,
    moved,
    placed,
)
from dmpcli.errors import InputError
from dmpcli.instruments.address import Address
from dmpcli.instruments.options import Options
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import from_euler
from dmpcli.spatial.wrench import Tool

_FAR = 1e4
SHAPES = ("plane", "cylinder", "edge", "step", "slot", "ramp", "wall", "none")
"""Surfaces that need no file."""


def agreed(address: Address, arm: str, said: dict[str, str]) -> str:
    """Add what a URL says to what is known of the bench.

    Parameters
    ----------
    address : Address
    arm : str
        What the other URL called the arm; empty where there was none.
    said : dict
        What it said; the new options are added.

    Returns
    -------
    str
        The arm.

    Raises
    ------
    InputError
        There is no such arm, or the two differ.
    """
    if address.host not in arms():
        raise InputError(
            f"{address}: the bench has no such arm; it is one of "
            f"{', '.join(f'bench://{name}' for name in arms())}"
        )
    if arm and arm != address.host:
        raise InputError(f"{address}: the other instrument is on bench://{arm}; name one arm")
    for key, text in address.options.items():
        if said.setdefault(key, text) != text:
            raise InputError(
                f"{address}: {key} differs between --robot and --sensor, which share one bench; "
                "say it once"
            )
    parameters(address.host, said)  # what is wrong is told before anything is opened
    return address.host


def parameters(arm: str, said: dict[str, str]) -> BenchParameters:
    """Read the options.

    Parameters
    ----------
    arm : str
    said : dict

    Raises
    ------
    InputError
        One is unknown, or out of range.
    """
    options = Options(Address("robot", "bench", arm, options=said))
    number = options.number
    usual = BenchParameters(arm=arm)
    x, y, z = (
        number(key, float(value), -_FAR, _FAR, "mm")
        for key, value in zip("xyz", usual.position, strict=True)
    )
    angles = [number(key, math.pi if key == "rx" else 0.0, -7.0, 7.0, "rad") for key in _ANGLES]
    position, rotation = np.array([x, y, z]), from_euler(np.array(angles))
    pen = Pen(
        stiffness=number("stiffness", 2.0, 0.01, 1000.0, "N/mm"),
        travel=number("travel", 40.0, 0.1, 100.0, "mm"),
        mass=number("pen_mass", 0.03, 0.001, 1.0, "kg"),
        damping=number("pen_damping", 0.5, 0.0, 10.0, ""),
        radius=number("tip_radius", 1.0, 0.05, 20.0, "mm"),
        friction=number("friction", 0.2, 0.0, 2.0, ""),
    )
    servos = replace(
        JointServos(),
        lag=number("lag", 0.025, 0.004, 1.0, "s"),
        delay=number("delay", 0.0, 0.0, 1.0, "s"),
    )
    servos = replace(servos, stiffness=number("arm", 1.0, 0.05, 100.0, "") * servos.stiffness)
    noise = number("noise", 0.05, 0.0, 10.0, "N")
    bias = np.array([number(f"bias_{key}", 0.0, -50.0, 50.0, "N") for key in "xyz"])
    drift = np.array([number(f"drift_{key}", 0.0, -10.0, 10.0, "N/s") for key in "xyz"])
    sensor = WristSensor(
        noise=noise * np.array([1.0, 1.0, 1.0, 0.02, 0.02, 0.02]),
        bias=np.concatenate([bias, np.zeros(3)]),
        drift=np.concatenate([drift, np.zeros(3)]),
        latency=number("latency", 0.0, 0.0, 1.0, "s"),
    )
    truth, described = options.text("truth"), options.text("model")
    read_from = BenchParameters(
        arm=arm,
        links=None if described is None else description.read(described, arm),
        position=position,
        rotation=rotation,
        tool=_tool(options, usual.tool),
        pen=pen,
        servos=servos,
        sensor=sensor,
        workpiece=_workpiece(options, Pose(position, rotation)),
        step=number("step", 0.0, 1e-5, 2e-3, "s") or None,
        seed=options.whole("seed", 0, 0, 2**31 - 1),
        truth=None if truth is None else Path(truth),
    )
    options.done()
    return read_from


_ANGLES = ("rx", "ry", "rz")


def _tool(options: Options, usual: Tool) -> Tool:
    """The tool as it truly is: that of a tool file."""
    path = options.text("tool")
    if path is None:
        return usual
    from dmpcli.records import file_io
    from dmpcli.records import tool as tool_file

    return tool_file.decode(file_io.read(Path(path)))


def _workpiece(options: Options, tip: Pose) -> Workpiece:
    number = options.number
    shape = options.text("surface") or "plane"
    point = np.array(
        [
            number(f"at_{key}", float(value), -_FAR, _FAR, "mm")
            for key, value in zip("xyz", tip.position, strict=True)
        ]
    )
    normal = np.array([number(f"n{key}", float(key == "z"), -1.0, 1.0, "") for key in "xyz"])
    along = math.radians(number("along", 0.0, -360.0, 360.0, "degrees"))
    offset = number("offset", 0.0, -500.0, 500.0, "mm")
    tilt = math.radians(number("tilt", 0.0, -80.0, 80.0, "degrees"))
    about = math.radians(number("about", 0.0, -360.0, 360.0, "degrees"))
    length = float(np.linalg.norm(normal))
    if length < 1e-6:
        raise InputError("bench: nx, ny, nz: the normal has no length")
    across = np.array([math.cos(along), math.sin(along), 0.0])
    if abs(across @ normal) > 0.99 * length:
        across = np.array([0.0, 0.0, 1.0])
    frame = placed(point, normal / length, across)
    return replace(_shape(options, shape, frame, tip), pose=moved(frame, offset, tilt, about))


def _shape(options: Options, shape: str, frame: Pose, tip: Pose) -> Nothing:
    """The surface where the plan has it."""
    number = options.number
    radius = number("radius", 60.0, 1.0, 1e4, "mm")
    far = number("far", 50.0, -1e3, 1e3, "mm")
    height = number("height", 3.0, 0.01, 100.0, "mm")
    width = number("width", 10.0, 0.1, 1e3, "mm")
    slope = math.radians(number("slope", 30.0, 1.0, 80.0, "degrees"))
    collision = options.choice("collide", "closest", *COLLISIONS)
    grid = number("grid", 1.0, 0.05, 100.0, "mm")
    known: dict[str, Nothing] = {
        "none": Nothing(frame),
        "plane": Flat(frame),
        "cylinder": Round(frame, radius),
        "edge": Edge(frame, far),
        "step": Step(frame, far, -height),
        "wall": Step(frame, far, height),
        "slot": Slot(frame, far, width),
        "ramp": Ramp(frame, far, height, slope),
    }
    if shape in known:
        return known[shape]
    path = Path(shape)
    if not path.suffix:
        raise options.wrong("surface", f"one of {', '.join(SHAPES)}, or a file")
    return read(path, frame, tip, collision, grid)

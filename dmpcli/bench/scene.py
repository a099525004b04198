"""The bench as a MuJoCo model: an arm by its kinematics, the tool on its wrist, pen and workpiece.

MuJoCo's lengths are m. Joint i turns about z of link frame i - 1, as in `dmpcli.kinematics.models`.
"""

from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.bench.links import Links
from dmpcli.bench.parameters import BenchParameters
from dmpcli.bench.workpiece import Traced
from dmpcli.errors import InputError
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp_one, to_quaternion
from dmpcli.spatial.wrench import gravity

GRAVITY = 9.80665
"""m/s²."""

# A contact is a spring of MuJoCo's own, in series with the pen's, by the mass of what touches: at a
# time constant of two steps and this impedance some 2000 N/mm. A harder one is no better: a tip of
# 30 g that is out of contact for one step, as a facet ends, is thrown by a tenth of a millimetre.
_IMPEDANCE = 0.99
_LEAST_MASS = 0.05  # kg, of what does not slide

TRACED = "traced"
"""Body of the plane under the tip."""

# MuJoCo's order of a symmetric matrix.
_HALF = (np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2]))

JOINTS = tuple(f"joint{i}" for i in range(1, 7))


def build(parameters: BenchParameters, links: Links, mujoco: Any) -> Any:
    """Return the model, a ``mujoco.MjModel``.

    Parameters
    ----------
    parameters : BenchParameters
    links : Links
        Of the arm.
    mujoco : module

    Raises
    ------
    InputError
        The tool weighs less than the pen that slides in it.
    """
    root = ET.Element("mujoco")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    down = GRAVITY * gravity(1.0, parameters.tool.inclination)
    ET.SubElement(
        root,
        "option",
        timestep=_text(parameters.grid),
        integrator="implicitfast",
        gravity=_text(down),
    )
    assets = ET.SubElement(root, "asset")
    world = ET.SubElement(root, "worldbody")
    contact = {
        "solref": _text([2.0 * parameters.grid, 1.0]),
        "solimp": _text([_IMPEDANCE, _IMPEDANCE, 1e-3]),
        # Without friction: `World` adds it. MuJoCo's own makes a pen that slides rattle.
        "condim": "1",
    }
    _add_workpiece(parameters, world, assets, contact)
    _add_pen(parameters, _add_tool(parameters, _add_arm(parameters, links, world)), contact)
    sensors = ET.SubElement(root, "sensor")
    ET.SubElement(sensors, "force", site="wrist")
    ET.SubElement(sensors, "torque", site="wrist")
    return mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))


def _add_arm(parameters: BenchParameters, links: Links, world: ET.Element) -> ET.Element:
    """Hang six links one upon another; return the flange."""
    parent, arm = world, links.arm
    before = Pose(np.zeros(3), np.eye(3))
    rotors = parameters.servos.rotors if links.rotors is None else links.rotors
    for i, name in enumerate(JOINTS):
        turned = Pose(np.zeros(3), exp_one(np.array([0.0, 0.0, arm.offset[i]])))
        body = ET.SubElement(parent, "body", {"name": f"link{i + 1}", **_placed(before @ turned)})
        ET.SubElement(
            body, "joint", name=name, type="hinge", axis="0 0 1", armature=_text(rotors[i])
        )
        before = Pose(
            np.array([arm.a[i], 0.0, arm.d[i]]), exp_one(np.array([arm.alpha[i], 0.0, 0.0]))
        )
        ET.SubElement(
            body,
            "inertial",
            pos=_text(links.centre[i]),
            mass=_text(links.mass[i]),
            fullinertia=_text(links.inertia[i][_HALF]),
        )
        parent = body
    return ET.SubElement(parent, "body", {"name": "flange", **_placed(before)})


def _add_tool(parameters: BenchParameters, flange: ET.Element) -> ET.Element:
    """Hang on the flange what the sensor carries; a site in it feels what passes between them."""
    tool, pen = parameters.tool, parameters.pen
    total = tool.weight / GRAVITY
    fixed = total - pen.mass
    if fixed < _LEAST_MASS:
        raise InputError(
            f"bench: a tool of {tool.weight:g} N is lighter than its pen of {pen.mass:g} kg and a "
            f"holder of {_LEAST_MASS:g} kg; give more weight"
        )
    # The bodies' origins coincide with the sensor's, so that nothing but the pen is left out.
    centre = (total * tool.centre - pen.mass * tool.lever) / fixed / 1e3
    at = Pose(tool.sensor_position, tool.sensor_rotation)
    body = ET.SubElement(flange, "body", {"name": "tool", **_placed(at)})
    ET.SubElement(
        body,
        "inertial",
        pos=_text(centre),
        mass=_text(fixed),
        diaginertia=_text([fixed * 0.04**2] * 3),
    )
    ET.SubElement(body, "site", name="wrist")
    tip = Pose(tool.lever, tool.sensor_rotation.T @ tool.tcp_rotation)
    holder = ET.SubElement(body, "body", {"name": "holder", **_placed(tip)})
    # MuJoCo wants no body without mass that moves; this one does not move.
    ET.SubElement(holder, "site", name="tcp")
    return holder


def _add_pen(parameters: BenchParameters, holder: ET.Element, contact: dict[str, str]) -> None:
    """Let a pen slide in the holder; its end at rest is the TCP, z is into the work."""
    pen, tool = parameters.pen, parameters.tool
    stiffness = 1e3 * pen.stiffness
    # The spring's rest carries the pen's weight, as it hangs at first, so that it stands at 0.
    hangs = GRAVITY * float(gravity(1.0, tool.inclination) @ parameters.rotation[:, 2])
    body = ET.SubElement(holder, "body", name="pen")
    ET.SubElement(
        body,
        "joint",
        name="pen",
        type="slide",
        axis="0 0 -1",
        stiffness=_text(stiffness),
        damping=_text(2.0 * pen.damping * np.sqrt(stiffness * pen.mass)),
        springref=_text(pen.mass * hangs / stiffness),
        range=_text([-0.01, pen.travel / 1e3]),
    )
    r = pen.radius / 1e3
    ET.SubElement(
        body,
        "geom",
        {
            "name": "tip",
            "type": "sphere",
            "size": _text(r),
            "pos": _text([0.0, 0.0, -r]),
            "mass": _text(pen.mass),
            "contype": "1",
            "conaffinity": "1",
            **contact,
        },
    )


def _add_workpiece(
    parameters: BenchParameters, world: ET.Element, assets: ET.Element, contact: dict[str, str]
) -> None:
    workpiece = parameters.workpiece
    if isinstance(workpiece, Traced):
        # A plane that is laid under the tip, step by step.
        traced = ET.SubElement(world, "body", {"name": TRACED, "mocap": "true"})
        ET.SubElement(traced, "geom", {**contact, "type": "plane", "size": "1 1 0.1"})
        return
    body = ET.SubElement(world, "body", {"name": "workpiece", **_placed(workpiece.pose)})
    for one in workpiece.assets():
        attributes = dict(one)
        ET.SubElement(assets, attributes.pop("tag"), attributes)
    for geom in workpiece.geoms():
        ET.SubElement(body, "geom", {**contact, **geom})


def _placed(pose: Pose) -> dict[str, str]:
    # MuJoCo writes w first.
    w_first = np.roll(to_quaternion(pose.rotation), 1)
    return {"pos": _text(pose.position / 1e3), "quat": _text(w_first)}


def _text(values: "Floats | list[float] | float") -> str:
    return " ".join(repr(float(value)) for value in np.atleast_1d(np.asarray(values)))

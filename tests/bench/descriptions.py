"""Description files of arms, written by hand in the makers' frames; nothing of our kinematics."""

import math

from tests.kinematics.urdf import ORIGINS

# Mass, kg; centre of mass, m; inertia about it, kg·m², xx yy zz xy xz yz: as none is simple.
LINKS = (
    (3.7, "0.001 -0.02 0.003", "0.0103 0.0102 0.0067 0.0002 -0.0001 0.0003"),
    (8.4, "0.002 0.01 0.2125", "0.134 0.133 0.0151 0.001 0.002 -0.001"),
    (2.3, "-0.003 0.004 0.196", "0.0312 0.0311 0.0041 0 0.0005 0"),
    (1.22, "0 0.127 0.002", "0.0026 0.0025 0.0022 0.0001 0 0"),
    (1.22, "0.001 0 0.1", "0.0026 0.0025 0.0022 0 0.0001 0"),
    (0.19, "0 0.077 0.001", "0.00014 0.0001 0.0001 0 0 0.00001"),
)
ASIDE = 'pos="0.1 -0.2 0.3" quat="0 0 0 1"'
"""A base that stands aside, turned to UR's own; that of a description is half a turn off."""


def mjcf(a3=0.3922, d4=0.1333, d5=0.0997, base="", joint="", end="", links=LINKS, beside=""):
    """A UR5e, lengths in m, joints as MuJoCo's Menagerie has them."""
    places = (
        'pos="0 0 0.1625"',
        'pos="0 0.138 0" quat="1 0 1 0"',
        'pos="0 -0.131 0.425"',
        f'pos="0 0 {a3}" quat="1 0 1 0"',
        f'pos="0 {d4 - 0.007} 0"',
        f'pos="0 0 {d5}"',
    )
    axes = ("0 0 1", "0 1 0", "0 1 0", "0 1 0", "0 0 1", "0 1 0")
    opened = ""
    for i, (place, axis, (mass, centre, inertia)) in enumerate(
        zip(places, axes, links, strict=True)
    ):
        limits = 'range="-3.1 2.9"' if i == 2 else 'range="-6.28319 6.28319"'
        stated = f'<inertial mass="{mass}" pos="{centre}" fullinertia="{inertia}"/>' if mass else ""
        opened += (
            f'<body name="l{i}" {place}>{stated}'
            f'<joint name="j{i}" axis="{axis}" {limits} armature="{0.1 + 0.01 * i}" {joint}/>'
            '<geom type="mesh" mesh="shell" material="grey"/><geom size="0.05"/>'
        )
    return (
        '<mujoco><compiler angle="radian" autolimits="true" meshdir="assets"/>'
        '<asset><mesh name="shell" file="not_here.stl"/><material name="grey"/></asset>'
        f'<worldbody><light pos="0 0 3"/><geom type="plane" size="1 1 1"/><body name="base" {base}>'
        f'<geom type="mesh" mesh="shell"/>{opened}<site name="end" pos="0 0.0996 0"/>{end}'
        f"{'</body>' * 7}</worldbody>"
        '<actuator><position joint="j0" kp="100"/></actuator>'
        f'<sensor><framepos objtype="site" objname="end"/></sensor>{beside}</mujoco>'
    )


def urdf(links=LINKS, rounded=4):
    """An EC66 by its maker's URDF, whose angles have four decimals."""
    limits = (6.2832, 6.2832, 2.7925, 6.2832, 6.2832, 6.2832)
    written = '<link name="world"/><link name="base_link"/>' + (
        '<joint name="fixed" type="fixed"><parent link="world"/><child link="base_link"/></joint>'
    )
    before = "base_link"
    for i, ((xyz, rpy), limit, (mass, centre, inertia)) in enumerate(
        zip(ORIGINS, limits, links, strict=True)
    ):
        xx, yy, zz, xy, xz, yz = inertia.split()
        metres = " ".join(str(value / 1e3) for value in xyz)
        angles = " ".join(str(round(value, rounded)) for value in rpy)
        mesh = f'<geometry><mesh filename="package://ec66/meshes/link{i + 1}.STL"/></geometry>'
        written += (
            f'<link name="link{i + 1}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
            f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="{xz}" iyz="{yz}"/>'
            f"</inertial><visual>{mesh}</visual><collision>{mesh}</collision></link>"
            f'<joint name="joint{i + 1}" type="revolute"><origin xyz="{metres}" rpy="{angles}"/>'
            f'<parent link="{before}"/><child link="link{i + 1}"/><axis xyz="0 0 1"/>'
            f'<limit lower="{-limit}" upper="{limit}" effort="28" velocity="{math.pi}"/></joint>'
        )
        before = f"link{i + 1}"
    written += (
        '<link name="flange"/><joint name="flange_joint" type="fixed">'
        '<parent link="link6"/><child link="flange"/></joint>'
    )
    return f'<robot name="ec66">{written}</robot>'

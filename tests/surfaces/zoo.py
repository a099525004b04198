"""Parts as CAD programs make them, by boolean operations of manifold3d, read back from float32 STL.

Lengths in mm. Round faces have facets of 3.75 to 10°, as exports with usual tolerances have.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import trimesh
from manifold3d import CrossSection, FillRule, JoinType, Manifold

from dmpcli.records.file_io import Source
from dmpcli.records.mesh import decode
from dmpcli.surfaces.mesh import Mesh

Part = Callable[[], Manifold]


def plate(x, y, z, radius=0.0, segments=64):
    """Return a plate with rounded upright edges, centred on z = 0 from below."""
    outline = CrossSection.square((x - 2 * radius, y - 2 * radius), center=True)
    if radius > 0.0:
        outline = outline.offset(radius, JoinType.Round, 2.0, segments)
    return Manifold.extrude(outline, z)


def rod(height, radius, top=None, segments=64):
    return Manifold.cylinder(height, radius, radius if top is None else top, segments)


def turned(profile, segments=96):
    """Return the solid of revolution about z of a profile (r, z), counter-clockwise."""
    return Manifold.revolve(CrossSection([profile], FillRule.Positive), segments)


def arc(centre, radius, first, last, steps):
    """Return points of an arc in the plane, angles in degrees."""
    a = np.radians(np.linspace(first, last, steps + 1))
    return [(centre[0] + radius * np.cos(t), centre[1] + radius * np.sin(t)) for t in a]


def drilled():
    part = plate(100.0, 60.0, 12.0)
    for x in (-35.0, 0.0, 35.0):
        for y in (-18.0, 18.0):
            part -= rod(14.0, 4.5, segments=40).translate((x, y, -1.0))
    return part - rod(5.0, 7.5, 7.5, 48).translate((0.0, 0.0, 8.0))


def pocketed():
    part = plate(90.0, 70.0, 25.0) - plate(60.0, 40.0, 20.0, 8.0).translate((0.0, 0.0, 10.0))
    return part - plate(12.0, 90.0, 20.0).translate((0.0, 0.0, 18.0))


def filleted():
    """A bar of 160 mm whose long edges are rounded by slivers as long as itself."""
    bar = Manifold.extrude(
        CrossSection.square((38.0, 28.0), center=True).offset(6.0, JoinType.Round, 2.0, 48), 160.0
    )
    return bar.rotate((90.0, 0.0, 0.0))


def rounded():
    ball = Manifold.sphere(6.0, 48)
    corners = [
        ball.translate((x, y, z)) for x in (-34.0, 34.0) for y in (-24.0, 24.0) for z in (0.0, 28.0)
    ]
    return Manifold.batch_hull(corners)


def chamfered():
    slabs = [
        Manifold.cube(size, True)
        for size in ((80.0, 54.0, 34.0), (74.0, 60.0, 34.0), (74.0, 54.0, 40.0))
    ]
    return Manifold.batch_hull(slabs) - rod(50.0, 9.0, segments=56).translate((0.0, 0.0, -25.0))


def ribbed():
    part = plate(80.0, 60.0, 8.0) + Manifold.cube((8.0, 60.0, 60.0)).translate((-40.0, -30.0, 0.0))
    for y in (-22.0, -2.0, 18.0):
        rib = CrossSection([[(-33.0, 7.0), (25.0, 7.0), (-33.0, 50.0)]], FillRule.Positive)
        part += Manifold.extrude(rib, 4.0).rotate((90.0, 0.0, 0.0)).translate((0.0, y + 4.0, 0.0))
    return part - rod(20.0, 5.0, segments=40).translate((28.0, 12.0, -5.0))


def shaft():
    profile = [(0.0, 0.0), (12.0, 0.0), (15.0, 3.0), (15.0, 36.0)]
    profile += arc((19.0, 36.0), 4.0, 180.0, 90.0, 12)[1:]
    profile += [(28.0, 40.0), (28.0, 62.0)]
    profile += arc((24.0, 62.0), 4.0, 0.0, 90.0, 12)[1:]
    profile += [(20.0, 66.0), (20.0, 70.0), (18.0, 70.0), (18.0, 73.0), (20.0, 73.0), (20.0, 110.0)]
    return turned([*profile, (0.0, 110.0)])


def flange():
    part = turned(
        [(14.0, 0.0), (45.0, 0.0), (45.0, 12.0), (26.0, 12.0), (22.0, 40.0), (14.0, 40.0)]
    )
    for k in range(6):
        a = np.radians(60.0 * k)
        part -= rod(20.0, 3.5, segments=36).translate((36 * np.cos(a), 36 * np.sin(a), -2.0))
    return part


def funnel():
    return rod(60.0, 12.0, 40.0, 80) - rod(62.0, 9.0, 37.9, 80).translate((0.0, 0.0, -1.0))


def cone():
    return rod(50.0, 35.0, 0.0, 96) + rod(10.0, 35.0, 35.0, 96).translate((0.0, 0.0, -10.0))


def half_round():
    """Long slivers: a half cylinder of 240 mm, whose facets are 2.6 mm wide."""
    return rod(240.0, 40.0, segments=96).trim_by_plane((0.0, 1.0, 0.0), 0.0)


def tee():
    outer = rod(120.0, 24.0, segments=72).rotate((0.0, 90.0, 0.0)).translate((-60.0, 0.0, 0.0))
    branch = rod(60.0, 17.0, segments=64)
    inner = rod(130.0, 19.0, segments=72).rotate((0.0, 90.0, 0.0)).translate((-65.0, 0.0, 0.0))
    return outer + branch - inner - rod(62.0, 13.0, segments=64)


def heat_sink():
    part = plate(90.0, 60.0, 8.0, 3.0, 32)
    for x in np.arange(-39.0, 40.0, 13.0):
        part += Manifold.cube((2.0, 54.0, 26.0)).translate((x - 1.0, -27.0, 7.0))
    return part


def ring():
    return turned(arc((40.0, 0.0), 12.0, 0.0, 360.0, 48)[:-1], 120)


def domed():
    ball = (
        Manifold.sphere(60.0, 120).translate((0.0, 0.0, -30.0)).trim_by_plane((0.0, 0.0, 1.0), 0.0)
    )
    return ball - plate(30.0, 16.0, 30.0, 4.0, 32).translate((8.0, 0.0, 22.0))


def united():
    """A union at odd angles, as float32 STL: vertices along its seams fall together."""
    part = Manifold.cube((70.0, 40.0, 24.0), True).rotate((3.0, 7.0, 11.0))
    part += Manifold.sphere(22.0, 64).translate((20.3, 4.7, 9.1))
    part += rod(80.0, 11.0, segments=72).rotate((71.0, 13.0, 5.0)).translate((-14.2, 33.0, -8.0))
    return part + rod(50.0, 15.0, 6.0, 60).rotate((14.0, -9.0, 0.0)).translate((-20.0, -6.0, 0.0))


PARTS: dict[str, Part] = {
    part.__name__: part
    for part in (
        drilled, pocketed, filleted, rounded, chamfered, ribbed, shaft, flange, funnel, cone,
        half_round, tee, heat_sink, ring, domed, united,
    )
}  # fmt: skip


@cache
def mesh(name):
    """Return a part as our reader finds it in a binary STL."""
    made = PARTS[name]().to_mesh()
    shape = trimesh.Trimesh(made.vert_properties[:, :3], made.tri_verts, process=False)
    found = decode(Source(f"{name}.stl", shape.export(file_type="stl")))
    return Mesh(found.V, found.F)

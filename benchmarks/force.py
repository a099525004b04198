"""How force is held on a true surface that is not where the plan has it: on the bench, in physics.

``python -m benchmarks.force [TABLE ...] [--seeds N] [--jobs N]``; tables: ``surfaces`` (that of
``make reproduce-force``), ``stiffness``, ``landing``, ``features``, ``zero``, ``profile``; all
without a name.

The stroke is the paper's, 109 mm with a wave of 50 mm, in 12 s from rest to rest at 50 Hz, with
5 N; an EC66 with joints that lag by 25 ms, a pen of 2 N/mm, friction 0.2, noise 0.05 N. What is
displaced and tilted turns about the middle of the stroke. Forces are the true ones between pen and
surface, in each millisecond of the stroke; ``position`` leads the pen 5 N deep into the plan's
surface and feels nothing. A wave is off by the difference between what the tip drew and the plan
carried along its normals onto the true surface, in height and, point by point, in distance.
"""

import argparse
import contextlib
import io
import logging
import multiprocessing
import tempfile
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.spatial import cKDTree

import dmpcli
from dmpcli.arrays import Floats
from dmpcli.bench import options
from dmpcli.bench.workpiece import Flat, Round
from dmpcli.bench.world import World
from dmpcli.control.execution import SENSOR_RATE
from dmpcli.dmp import reference_paths
from dmpcli.errors import DmpError
from dmpcli.metrics.wave_height import stroke_wave
from dmpcli.records import file_io, record, schemas

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
    """

    name: str
    plan: str = "plane"
    bench: dict[str, str] = field(default_factory=dict)
    coupled: bool = True
    settings: dict[str, Any] = field(default_factory=dict)
    taught: bool = False


def pressed_skill() -> dmpcli.Skill:
    """Return the paper's stroke as taught on a plane in contact, from 3 to 8 to 4 N."""
    t = np.linspace(0.0, 10.0, 1001)
    rng = np.random.default_rng(1)
    force = 0.05 * rng.standard_normal((len(t), 6))
    push = 3.0 + t / 10.0 + 4.5 * np.sin(np.pi * t / 10.0) ** 2
    force[:, 2] += push
    position = reference_paths.sine(START, GOAL, 50.0, t, 10.0) - push[:, None] / PEN * UP
    angles = np.tile([np.pi, 0.0, 0.0], (len(t), 1))
    names = ["t", "x", "y", "z", "rx", "ry", "rz"]
    names += [f"{name} [N]" for name in schemas.FORCE]
    names += [f"{name} [N·m]" for name in schemas.WRENCH[3:]]
    table = np.column_stack([t, position, angles, force])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pressed.parquet"
        pq.write_table(pa.table(dict(zip(names, table.T, strict=True))), path)
        return dmpcli.fit(dmpcli.read(path), normal=(0.0, 0.0, 1.0), force_profile=True)


@lru_cache
def planned(plan: str, offset: float, taught: bool = False) -> dmpcli.Trajectory:
    """Return the stroke on the surface that the plan knows, so far off it, mm."""
    if taught:
        skill = pressed_skill()
    else:
        skill = dmpcli.fit(dmpcli.read(ROOT / "sample_runs" / "reference.parquet"))
    shapes = {
        "plane": dmpcli.Plane(MIDDLE, UP),
        # Along its highest line, so that the wave swings to both sides.
        "cylinder": dmpcli.Cylinder(MIDDLE - RADIUS * UP, np.array([1.0, 0.0, 0.0]), RADIUS),
    }
    drawn = dmpcli.generalize(
        skill,
        START,
        GOAL,
        shapes[plan],
        orientation="surface",
        duration=10.0,
        ease_in=2.0,
        ease_out=2.0,
        offset=offset,
    )
    assert isinstance(drawn, dmpcli.Trajectory)
    return drawn


def said_of(case: Case, seed: int) -> dict[str, str]:
    """Return the options of the bench's URL."""
    x, y, z = (START + ABOVE * UP).tolist()
    at = dict(zip(("at_x", "at_y", "at_z"), map(repr, MIDDLE.tolist()), strict=True))
    usual = {"x": repr(x), "y": repr(y), "z": repr(z), **at, "seed": str(seed)}
    shape = {"surface": case.plan}
    if case.plan == "cylinder":
        shape["along"] = "90"  # of what lies across its axis
    return usual | shape | case.bench


def run(work: tuple[Case, int]) -> dict[str, Any]:
    """Draw one case with one seed; return what was measured, or why it was not drawn."""
    case, seed = work
    logging.disable(logging.CRITICAL)
    said = said_of(case, seed)
    pen = float(said.get("stiffness", PEN))
    drawn = planned(case.plan, 0.0 if case.coupled else -FORCE / pen, case.taught)
    sensor = {"sensor": "bench://ec66", "coupling": "force"}
    if not case.taught:
        sensor["force_setpoint"] = FORCE
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(io.StringIO()):
        truth, out = Path(folder) / "truth.parquet", Path(folder) / "run.parquet"
        url = "bench://ec66?" + "&".join(f"{key}={value}" for key, value in said.items())
        why = ""
        try:
            dmpcli.execute(
                drawn,
                out,
                robot=f"{url}&truth={truth}",
                tool=TOOL,
                approach=20.0,
                **(sensor if case.coupled else {}),
                **case.settings,
            )
        except DmpError as error:
            why = f"exit {error.exit_code}: {error}"
        result: dict[str, Any] = {"why": why, "seed": seed}
        if truth.exists() and out.exists():
            result |= measured(case, said, drawn, truth, out)
    return result


def measured(
    case: Case, said: dict[str, str], drawn: dmpcli.Trajectory, truth: Path, out: Path
) -> dict[str, Any]:
    """Measure a run by what truly happened."""
    table = pq.read_table(truth)
    true = {name: table[name].to_numpy() for name in table.column_names}
    log = record.decode(file_io.read(out), schemas.RUN)
    phase = np.asarray(log.columns["phase"])
    cycle = np.minimum(true["setpoint"].astype(int) - 1, len(phase) - 1)
    begun = np.flatnonzero(true["setpoint"] > 0)[0]
    push = true["push"]
    before = (cycle < np.argmax(phase == "stroke")) if (phase == "stroke").any() else cycle >= 0
    found: dict[str, Any] = {
        "peak_all": float(push.max()),
        "landing": float(push[before].max()),
        "facts": log.provenance.facts,
        "lateral": float(np.hypot(true["fx"], true["fy"]).max()),
        "unavoidable": unavoidable(said, true),
    }
    # What a set-point says shows a look-ahead later.
    late = round((float(said.get("delay", 0.0)) + LAG + PERIOD) / (true["t"][1] - true["t"][0]))
    on = np.zeros(len(push), dtype=bool)
    rows = np.flatnonzero(phase[cycle] == "stroke")
    rows = rows[rows >= begun] + late
    on[rows[rows < len(on)]] = True
    if not on.any():
        return found
    felt, asked = push[on], FORCE
    if case.taught:
        asked = np.asarray(log.columns["fn"])[cycle[np.flatnonzero(on) - late]]
    found |= {
        "contact": float((felt > 0.0).mean()),
        "mean": float(felt.mean()),
        "rms": float(np.sqrt(np.mean((felt - asked) ** 2))),
        "peak": float(felt.max()),
    }
    tip = np.column_stack([true[key] for key in "xyz"])[on]
    wanted = onto(case, said, drawn)
    if wanted is not None:
        tree = cKDTree(finely(wanted))
        off, _ = tree.query(tip[felt > 0.0])
        heights = [stroke_wave(path, START, GOAL, UP).value for path in (finely(wanted), tip[::20])]
        same = len(heights[0]) == len(heights[1])
        heights = [np.abs(np.diff(values)) for values in heights]
        found["off"] = float(off.max()) if len(off) else np.nan
        found["wave"] = float(np.abs(heights[0] - heights[1]).max()) if same else np.nan
    return found


def unavoidable(said: dict[str, str], true: dict[str, Floats]) -> float:
    """Force across the pen that a loop cannot avoid where it meets a wall, N; 0 where none is met.

    The arm goes on at its speed before the wall, against its own stiffness in that direction, until
    what was felt can show: a reading, a period, and the look-ahead of the arm.
    """
    across = np.hypot(true["fx"], true["fy"]) - 0.5 * np.abs(true["fz"])
    hit = int(np.argmax(across > 2.0))
    if not across[hit] > 2.0:
        return 0.0
    tip = np.column_stack([true[key] for key in "xyz"])
    step = float(true["t"][1] - true["t"][0])
    before = max(hit - round(0.1 / step), 0)
    velocity = (tip[hit] - tip[before]) / (step * max(hit - before, 1))
    velocity[2] = 0.0
    speed = float(np.linalg.norm(velocity))
    way = velocity / speed
    compliance = World(options.parameters("ec66", said)).compliance
    reaction = 1.0 / SENSOR_RATE + PERIOD + PERIOD + LAG + float(said.get("delay", 0.0))
    return speed * reaction / float(way @ compliance @ way)


def finely(path: Floats) -> Floats:
    """A path, shape (n, 3), with twenty points where it has one."""
    k = np.arange(len(path))
    fine = np.linspace(0.0, len(path) - 1.0, 20 * len(path))
    return np.column_stack([np.interp(fine, k, path[:, i]) for i in range(3)])


def onto(case: Case, said: dict[str, str], drawn: dmpcli.Trajectory) -> Floats | None:
    """Carry the plan along its normals onto the true surface; None where that has no closed form.

    By Newton's steps: the distance that is left, over the cosine between both normals.
    """
    workpiece = options.parameters("ec66", said).workpiece
    if not isinstance(workpiece, Flat | Round) or drawn.rotation is None:
        return None
    surface, point = workpiece.surface, drawn.position.copy()
    normal = -drawn.rotation[:, :, 2]  # the pen stands along the planned normal
    if not case.coupled:
        point = point + FORCE / float(said.get("stiffness", PEN)) * normal
    for _ in range(20):
        hit = surface.closest(point)
        off = np.sum((point - hit.position) * hit.normal, axis=1)
        point = point - (off / np.sum(normal * hit.normal, axis=1))[:, None] * normal
    return point


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
    """Surfaces off the plan where the pen comes down, and pens."""
    return [
        Case(f"{k:g} N/mm, {offset:+g} mm", bench=displaced(offset, stiffness=repr(k)))
        for k in (0.5, 2.0, 5.0, 15.0)
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
    return [
        Case(f"zero off by {bias:+g} N", bench={"bias_z": repr(bias)}) for bias in (0.0, 1.2, -1.2)
    ]


def profile() -> list[Case]:
    """A force that was taught on the plane, on the plane and on the cylinder."""
    return [
        Case(f"{plan} {offset:+g} mm", plan, displaced(offset, about="0"), taught=True)
        for plan in ("plane", "cylinder")
        for offset in (0.0, -1.5)
    ]


TABLES = {
    "surfaces": surfaces,
    "stiffness": stiffness,
    "landing": landing,
    "features": features,
    "zero": zero,
    "profile": profile,
}


def effective(case: Case) -> float:
    """Stiffness of pen, contact and arm as the set-points meet it, N/mm: two depths, at rest."""
    said = said_of(case, 0) | {"noise": "0", "offset": "0", "tilt": "0"}
    said["z"] = repr(float(START[2]))
    parameters = options.parameters("ec66", said)
    world, forces = World(parameters), []
    for depth in (0.5, 1.5):
        down = dmpcli_pose(parameters.position - depth * UP, parameters.rotation)
        for _ in range(40):
            world.step(PERIOD, down)
        forces.append(float(np.linalg.norm(world.contact_force)))
    return forces[1] - forces[0]


def dmpcli_pose(position: Floats, rotation: Floats) -> Any:
    """A pose of the TCP."""
    from dmpcli.spatial.pose import Pose

    return Pose(position, rotation)


def cell(results: list[dict[str, Any]]) -> str:
    """What several seeds gave: the worst of each."""
    drawn = [one for one in results if "contact" in one]
    said = sorted({one["why"].splitlines()[0][:70] for one in results if one["why"]})
    if not drawn:
        peak = max((one["peak_all"] for one in results if "peak_all" in one), default=0.0)
        return f"not drawn, peak {peak:.1f} N: {'; '.join(said)}"

    def worst(key: str) -> float:
        return max(float(one.get(key, np.nan)) for one in drawn)

    contact = min(one["contact"] for one in drawn)
    text = (
        f"{100 * contact:.2f} % | {worst('rms'):.3f} | {worst('peak'):.2f} | "
        f"{worst('landing'):.2f} | {worst('off'):.3f} | {worst('wave'):.3f}"
    )
    walls = worst("unavoidable")
    if walls:
        text += f" | across {worst('lateral'):.0f} N, unavoidable {walls:.0f};"
    else:
        text += " |"
    stopped = sum(bool(one["why"]) for one in results)
    return f"{text} {stopped} × {'; '.join(said)}" if said else f"{text} done"


HEAD = "contact | RMS, N | peak, N | landing, N | off, mm | wave, mm | ended"


def main() -> None:
    """Print the tables that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=", ".join(TABLES))
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    if not set(asked.tables) <= set(TABLES):
        parser.error(f"tables are {', '.join(TABLES)}")
    with multiprocessing.get_context("spawn").Pool(asked.jobs) as pool:
        for table in asked.tables or list(TABLES):
            print(f"\n## {table}: the worst of {asked.seeds} seeds\n\n| case | {HEAD} |")
            print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |", flush=True)
            for case in TABLES[table]():
                cases = [case]
                if table == "surfaces":
                    cases.append(Case("… position only", case.plan, case.bench, coupled=False))
                for one in cases:
                    seeds = range(asked.seeds if one.coupled else 1)
                    results = pool.map(run, [(one, seed) for seed in seeds], chunksize=1)
                    name = one.name
                    if table == "stiffness":
                        name += f", static {effective(one):.2f}"
                    print(f"| {name} | {cell(results)} |", flush=True)


if __name__ == "__main__":
    main()

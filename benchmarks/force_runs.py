"""How `benchmarks.force` draws one row once, and what it measures by what truly happened."""

import contextlib
import io
import logging
import tempfile
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.spatial import cKDTree

import dmpcli
from benchmarks.force_cases import (
    GOAL,
    LAG,
    MIDDLE,
    PEN,
    PERIOD,
    RADIUS,
    ROOT,
    START,
    TOOL,
    UP,
    Case,
    said_of,
)
from dmpcli.arrays import Floats
from dmpcli.bench import options
from dmpcli.bench.workpiece import Flat, Round, Step
from dmpcli.bench.world import World
from dmpcli.control.force_execution import SENSOR_RATE
from dmpcli.control.met_wall import MetWall
from dmpcli.dmp import reference_paths
from dmpcli.errors import DmpError
from dmpcli.metrics.wave_height import stroke_wave
from dmpcli.records import file_io, record, schemas
from dmpcli.spatial.pose import Pose


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
def planned(
    plan: str, offset: float, taught: bool = False, brief: bool = False
) -> dmpcli.Trajectory:
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
        START + (0.1 if brief else 1.0) * (GOAL - START),
        shapes[plan],
        orientation="surface",
        duration=4.0 if brief else 10.0,
        ease_in=1.0 if brief else 2.0,
        ease_out=1.0 if brief else 2.0,
        offset=offset,
    )
    assert isinstance(drawn, dmpcli.Trajectory)
    return drawn


def run(case: Case, seed: int) -> dict[str, Any]:
    """Draw one case with one seed; return what was measured, or why it was not drawn."""
    logging.disable(logging.CRITICAL)
    said = said_of(case, seed)
    pen = float(said.get("stiffness", PEN))
    drawn = planned(case.plan, 0.0 if case.coupled else -case.force / pen, case.taught, case.brief)
    sensor: dict[str, Any] = {"sensor": f"bench://{case.arm}", "coupling": "force"}
    if not case.taught:
        sensor["force_setpoint"] = case.force
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(io.StringIO()):
        truth, out = Path(folder) / "truth.parquet", Path(folder) / "run.parquet"
        url = f"bench://{case.arm}?" + "&".join(f"{key}={value}" for key, value in said.items())
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
        result: dict[str, Any] = {"why": why}
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
    push, facts = true["push"], log.provenance.facts
    before = (cycle < np.argmax(phase == "stroke")) if (phase == "stroke").any() else cycle >= 0
    across = float(np.hypot(true["fx"], true["fy"]).max())
    found: dict[str, Any] = {
        "peak_all": float(push.max()),
        "landing": float(push[before].max()),
        "along": float(np.abs(true["fz"]).max()),
        "across": across,
        "states": [one["state"] for one in facts.get("contact_events", [])],
    }
    told = facts.get("contact", {})
    kept = ("stiffness", "delay", "wall", "zero_drift")
    found |= {key: told[key] for key in kept if key in told}
    if case.bench.get("surface") in ("wall", "slot"):
        wall = wall_met(case, said, true)
        if wall is not None:
            found |= {"unavoidable": wall.unavoidable, "true_wall": asdict(wall)}
    if case.leans and "friction" in told:
        found |= leaning(case, said, log) | {"friction": told["friction"]}
    # What a set-point says shows a look-ahead later.
    step = true["t"][1] - true["t"][0]
    late = round((float(said.get("delay", 0.0)) + LAG + PERIOD) / step)
    on = np.zeros(len(push), dtype=bool)
    rows = np.flatnonzero(phase[cycle] == "stroke")
    rows = rows[rows >= begun] + late
    on[rows[rows < len(on)]] = True
    if not on.any():
        return found
    felt, asked = push[on], case.force
    if case.taught:
        asked = np.asarray(log.columns["fn"])[cycle[np.flatnonzero(on) - late]]
    found |= {
        "contact": float((felt > 0.0).mean()),
        "mean": float((felt - asked).mean()),
        "rms": float(np.sqrt(np.mean((felt - asked) ** 2))),
        "peak": float(felt.max()),
    }
    tip = np.column_stack([true[key] for key in "xyz"])[on]
    if said.get("surface") == "step":
        found |= beyond(case, said, felt, tip, step)
    wanted = onto(case, said, drawn)
    if wanted is not None and not case.brief:
        tree = cKDTree(finely(wanted))
        off, _ = tree.query(tip[felt > 0.0])
        heights = [stroke_wave(path, START, GOAL, UP).value for path in (finely(wanted), tip[::20])]
        same = len(heights[0]) == len(heights[1])
        heights = [np.abs(np.diff(values)) for values in heights]
        if len(off):
            found["off"] = float(off.max())
        if same:
            found["wave"] = float(np.abs(heights[0] - heights[1]).max())
    return found


def leaning(case: Case, said: dict[str, str], log: record.Record) -> dict[str, float]:
    """By how much the normal that was felt leans from the true one under the tool, degrees."""
    workpiece = options.parameters(case.arm, said).workpiece
    assert isinstance(workpiece, Flat | Round)
    felt, at = (
        np.column_stack([log.columns[name] for name in names])
        for names in (schemas.FELT_NORMAL, schemas.POSITION)
    )
    known = np.isfinite(felt).all(axis=1) & (np.asarray(log.columns["phase"]) == "stroke")
    true = workpiece.surface.closest(at[known]).normal
    off = np.degrees(np.arccos(np.clip(np.sum(felt[known] * true, axis=1), -1.0, 1.0)))
    return {"leans": float(off.mean()), "leans_p95": float(np.percentile(off, 95.0))}


def beyond(
    case: Case, said: dict[str, str], felt: Floats, tip: Floats, step: float
) -> dict[str, float]:
    """Measure what comes after a step down.

    From when the ball's middle is past the edge by its radius it cannot lie on it any more; no loop
    answers before its reaction time has passed: a reading, a period, and the arm's look-ahead.
    *After* is from then on, *whole* from the edge on, to the stroke's end.

    Parameters
    ----------
    case : Case
    said : dict
        Options of the bench.
    felt : array, shape (n,)
        N.
    tip : array, shape (n, 3)
        mm.
    step : float
        Of the physics, s.
    """
    parameters = options.parameters(case.arm, said)
    frame, piece, pen = parameters.workpiece.pose, parameters.workpiece, parameters.pen
    assert isinstance(piece, Step)
    along = (tip - frame.position) @ frame.rotation[:, 0] - piece.at
    if not (along > pen.radius).any():
        return {}
    past, edge = int(np.argmax(along > pen.radius)), int(np.argmax(along > -pen.radius))
    loose = np.flatnonzero(felt[edge:] <= 0.0)
    again = edge + int(loose[-1]) + 1 if len(loose) else past
    answers = reaction(said)
    return {
        "gap": float(len(loose) * step),
        "answers": answers,
        "after": float((felt[past + round(answers / step) :] > 0.0).mean()),
        "whole": float((felt[past:] > 0.0).mean()),
        "peak_edge": float(felt[edge:again].max(initial=0.0)),
        "peak_after": float(felt[again:].max(initial=0.0)),
    }


def wall_met(case: Case, said: dict[str, str], true: dict[str, Floats]) -> MetWall | None:
    """What a wall makes of this arm, by what the bench is made of; None where none is met.

    The arm goes on at its speed into the wall, against its own stiffness in that direction, until
    what was felt can show: a reading, a period, and the look-ahead of the arm. The wall rubs too,
    so that the arm bends by a force that leans from the wall's normal.
    """
    along = options.parameters(case.arm, said).workpiece.pose.rotation[:, 0]
    force = np.column_stack([true[key] for key in ("fx", "fy", "fz")])
    felt = -force @ along - 0.5 * np.abs(force[:, 2])
    hit = int(np.argmax(felt > 2.0))
    if not felt[hit] > 2.0:
        return None
    tip = np.column_stack([true[key] for key in "xyz"])
    step = float(true["t"][1] - true["t"][0])
    before = max(hit - round(0.1 / step), 0)
    speed = abs(float((tip[hit] - tip[before]) @ along)) / (step * max(hit - before, 1))
    across = force * [1.0, 1.0, 0.0]
    sizes = np.linalg.norm(across, axis=1)
    worst = hit + int(np.argmax(sizes[hit:]))
    at = dict(zip("xyz", map(repr, tip[hit].tolist()), strict=True))
    compliance = World(options.parameters(case.arm, said | at)).compliance
    stiffness = 1.0 / abs(float(along @ compliance @ across[worst]) / sizes[worst])
    return MetWall(float(sizes[hit]), float(sizes[worst]), speed, stiffness, reaction(said))


def reaction(said: dict[str, str]) -> float:
    """From what is felt to what the arm does about it, s: a reading, a period, its look-ahead."""
    return 1.0 / SENSOR_RATE + PERIOD + PERIOD + LAG + float(said.get("delay", 0.0))


def finely(path: Floats) -> Floats:
    """A path, shape (n, 3), with twenty points where it has one."""
    k = np.arange(len(path))
    fine = np.linspace(0.0, len(path) - 1.0, 20 * len(path))
    return np.column_stack([np.interp(fine, k, path[:, i]) for i in range(3)])


def onto(case: Case, said: dict[str, str], drawn: dmpcli.Trajectory) -> Floats | None:
    """Carry the plan along its normals onto the true surface; None where that has no closed form.

    By Newton's steps: the distance that is left, over the cosine between both normals.
    """
    workpiece = options.parameters(case.arm, said).workpiece
    if not isinstance(workpiece, Flat | Round) or drawn.rotation is None:
        return None
    surface, point = workpiece.surface, drawn.position.copy()
    normal = -drawn.rotation[:, :, 2]  # the pen stands along the planned normal
    if not case.coupled:
        point = point + case.force / float(said.get("stiffness", PEN)) * normal
    for _ in range(20):
        hit = surface.closest(point)
        off = np.sum((point - hit.position) * hit.normal, axis=1)
        point = point - (off / np.sum(normal * hit.normal, axis=1))[:, None] * normal
    return point


@lru_cache
def effective(pen: float, arm: str = "ec66", model: str = "") -> float:
    """Stiffness of a pen, contact and arm as the set-points meet it, N/mm: two depths, at rest."""
    described = {"model": model} if model else {}
    said = said_of(Case("", bench={"stiffness": repr(pen), "noise": "0"} | described), 0)
    said["z"] = repr(float(START[2]))
    parameters = options.parameters(arm, said)
    world, forces = World(parameters), []
    for depth in (0.5, 1.5):
        down = Pose(parameters.position - depth * UP, parameters.rotation)
        for _ in range(40):
            world.step(PERIOD, down)
        forces.append(float(np.linalg.norm(world.contact_force)))
    return forces[1] - forces[0]

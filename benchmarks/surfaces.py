"""How well and how fast strokes are carried onto meshes. ``python -m benchmarks.surfaces``.

With ``kernels`` behind it the table of accuracy alone, by compiled kernels.

Meshes of a cylinder (R 60), a sphere (R 150), the saddle z = (x² - y²)/240 and a bumpy field,
z = 3.315 Σ_i sin(k_i·(x, y) + i) with k_0 = 2π/80 (0.95, 0.3122), k_1 = 2π/62 (-0.4, 0.9165), whose
smallest radius of curvature is 29.0 mm; sine strokes of 109 mm and 49.98 mm wave height in 32
headings, 500 samples each. The truth is a closed form or a Runge-Kutta geodesic in 160 steps.
"""

import multiprocessing
import sys
import time

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.surfaces import frame_smoothing
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.surface import ChartImage
from tests.surfaces import cases, fields

FACES = (5_000, 50_000, 500_000)
HEADER = (
    "| surface | faces | periods | mesh off, max | curve off, max | off ÷ mesh | wave height "
    "| end | lift to mesh | turn, true → raw → smoothed, ° |"
)


def wave_heights(case: cases.Case, lift: ChartImage) -> Floats:
    """Heights between neighbouring extrema of v, measured from the points on the true surface.

    The true v of a point near an extremum: the point's offset from the true curve along the true
    e_v there, added to that curve's v.
    """
    v = case.coordinates[..., 1] + np.einsum(
        "bti,bti->bt", lift.position - case.position, case.axes[..., 1]
    )
    wave = case.coordinates[0, :, 1]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(wave))) != 0) + 1
    turns = turns[np.abs(wave[turns]) > 20.0]
    return np.abs(np.diff(v[:, turns], axis=1))


def accuracy(compiled: bool = False) -> None:
    """Print a Markdown table."""
    print(HEADER)
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name in cases.SURFACES:
        for faces in FACES:
            mesh = cases.mesh(name, faces)
            mesh = mesh.with_kernels if compiled else mesh
            error = cases.largest_error(name, mesh)
            for periods in (1, 2):
                case = cases.case(name, 32, 500, periods)
                _, lift = cases.drawn(mesh, case)
                assert not lift.status.any()
                off = np.linalg.norm(lift.position - case.position, axis=-1).max()
                heights = wave_heights(case, lift)
                goal = mesh.closest(case.goal).position
                end = np.linalg.norm(lift.position[:, -1] - goal, axis=1).max()
                on = mesh.closest(lift.position).distance.max()
                smooth = frame_smoothing.smoothed(lift.axes, lift.position, compiled=compiled)
                turn = [cases.turns(axes).max() for axes in (case.axes, lift.axes, smooth)]
                print(
                    f"| {name} | {faces} | {periods} | {error:.4f} | {off:.4f} "
                    f"| {off / error:.2f} | {heights.min():.3f} … {heights.max():.3f} "
                    f"| {end:.1e} | {on:.0e} | {turn[0]:.2f} → {turn[1]:.2f} → {turn[2]:.2f} |",
                    flush=True,
                )


PAIRS, SAMPLES, BLOCKS = 500, 500, 4
_MESH: list[Mesh] = []
_ENDS: list[tuple[Floats, Floats]] = []


def prepare() -> None:
    """Build the mesh, 400 x 400 mm, and blocks of start-goal pairs 109 mm apart."""
    field = cases.FIELDS["bumpy"]
    _MESH.append(Mesh(*fields.square(field, FACES[1], reach=200.0)))
    for seed in range(BLOCKS):
        rng = np.random.default_rng(seed)
        xy = rng.uniform(-80.0, 80.0, (PAIRS, 2))
        t = field.tangent(xy, rng.uniform(0.0, 2.0 * np.pi, PAIRS))
        end, _ = field.walk(xy, t, np.full(PAIRS, cases.LENGTH))
        _ENDS.append((field.point(*xy.T), field.point(*end.T)))


def draw(block: int, periods: int) -> float:
    """Lay charts and lift a block of strokes; return the processor time, s."""
    start, goal = _ENDS[block]
    begin = time.process_time()
    charts = _MESH[0].charts(start, goal)
    lift = charts.lift(fields.strokes(charts.lengths, SAMPLES, periods))
    assert not lift.status.any()
    return time.process_time() - begin


def project(block: int, _periods: int) -> float:
    """Project as many points of the chords, with smooth normals: the plain alternative."""
    start, goal = _ENDS[block]
    begin = time.process_time()
    r = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    _MESH[0].closest(start[:, None] + r * (goal - start)[:, None])
    return time.process_time() - begin


def throughput() -> None:
    """Print trajectories per second: of processor time, and of the clock with two processes."""
    prepare()
    draw(0, 1)
    print(f"\n| {FACES[1]} faces, {SAMPLES} poses | per CPU second | per second, two processes |")
    print("| --- | ---: | ---: |")
    rows = (
        ("strip chart, one period", draw, 1),
        ("strip chart, two periods", draw, 2),
        ("closest-point projection", project, 1),
    )
    for name, work, periods in rows:
        jobs = [(block, periods) for block in range(BLOCKS)]
        with multiprocessing.get_context("fork").Pool(2) as pool:
            pool.starmap(work, jobs, chunksize=1)
            processor, clock = [], []
            for _ in range(3):
                begin = time.perf_counter()
                processor.append(min(pool.starmap(work, jobs, chunksize=1)))
                clock.append(time.perf_counter() - begin)
        print(
            f"| {name} | {PAIRS / min(processor):.0f} | {PAIRS * BLOCKS / min(clock):.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    by_kernels = "kernels" in sys.argv[1:]
    accuracy(by_kernels)
    if not by_kernels:
        throughput()

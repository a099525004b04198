"""Aligning several demonstrations: lengths of mean paths, false alarms, and time.

    python -m benchmarks.alignment

People drew each LASA shape seven times. The mean of their paths should be as long as they are in
the mean: misaligned features cancel and shorten it, a jagged correspondence makes it longer. The
four `Multi_Models` shapes mix two or three shapes under one name, and should be told.
"""

from itertools import combinations
from time import process_time

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import smoothing
from dmpcli.dmp.alignment import Demonstration, align
from tests.human_strokes import shapes, strokes


def demonstrations(shape: str) -> list[Demonstration]:
    """The seven strokes of a shape, smoothed as N = 80 carries them, ending at the origin."""
    result = []
    for stroke in strokes(shape):
        even = smoothing.evenly_sampled(stroke)
        rate = (len(even.t) - 1) / even.duration
        x = smoothing.low_pass(even.position, rate, 40.0 / even.duration)
        result.append(Demonstration(even.duration, x - x[-1]))
    return result


def length(x: Floats) -> float:
    """Length of a polyline, mm."""
    return float(np.sum(np.linalg.norm(np.diff(x, axis=0), axis=1)))


def acceleration(x: Floats, duration: float) -> float:
    """Largest acceleration, mm/s²."""
    second = np.diff(x, 2, axis=-2) / (duration / (x.shape[-2] - 1)) ** 2
    return float(np.max(np.linalg.norm(second, axis=-1)))


def main() -> None:
    """Print one row a shape, false alarms of triples, and the time it takes."""
    print("mean path / mean length; spread, % of the extent; largest deviation from arc length;")
    print("peak acceleration of the mean path over the median demonstration's")
    print(f"{'shape':18s} {'time':>7s} {'path':>7s} {'spread':>7s} {'dev':>6s} {'acc':>6s}  doubts")
    alarms = triples = 0
    for shape in shapes():
        d = demonstrations(shape)
        mean = float(np.mean([length(one.x) for one in d]))
        by_time, by_path = align(d, "time"), align(d)
        extent = float(np.linalg.norm(np.ptp(by_path.mean, axis=0)))
        spread = float(np.sqrt(np.mean(np.sum(by_path.spread**2, axis=1)))) / extent
        own = float(np.median([acceleration(one.x, one.duration) for one in d]))
        doubts = " ".join(f"{q.index + 1}:{q.kind}" for q in by_path.doubts)
        print(
            f"{shape:18s} {length(by_time.mean) / mean:7.4f} {length(by_path.mean) / mean:7.4f}"
            f" {100 * spread:6.1f}% {np.max(by_path.deviations):6.3f}"
            f" {acceleration(by_path.mean, by_path.duration) / own:6.2f}  {doubts}"
        )
        if not shape.startswith("Multi"):
            found = [align([d[i] for i in three]).doubts for three in combinations(range(7), 3)]
            triples += len(found)
            alarms += sum(bool(doubts) for doubts in found)
    print(f"doubts among three of one shape: {alarms} of {triples}")
    t = np.linspace(0.0, 1.0, 500)
    same = [_wave(_jerk(t**power), 0.0) for power in (0.8, 1.0, 1.2, 1.4)]
    other = [_wave(_jerk(t), bulge) for bulge in (-8.0, -2.0, 3.0, 9.0)]
    for name, four in (("arc length", same), ("and time warping", other)):
        align(four)
        start = process_time()
        for _ in range(20):
            found = align(four)
        took = 1000 * (process_time() - start) / 20
        print(f"4 x 500 samples, {name}: {took:.1f} ms (deviation {np.max(found.deviations):.3f})")


def _jerk(r: Floats) -> Floats:
    return r**3 * (10.0 - 15.0 * r + 6.0 * r**2)


def _wave(u: Floats, bulge: float) -> Demonstration:
    y = 25.0 * np.sin(2 * np.pi * u) + bulge * np.exp(-(((u - 0.6) / 0.08) ** 2))
    return Demonstration(6.0, np.column_stack([300.0 * u, y, 0 * u]))


if __name__ == "__main__":
    main()

"""What smoothing can do at best: oracles know the truth. ``python -m benchmarks.noise_bounds``.

Of strokes whose largest error in `benchmarks.noise` is beyond what was asked: that of the recording
itself; of Wiener's filter, which knows the true stroke's spectrum, the best of all filters that do
the same everywhere; of the uniform spline whose K has the least largest error, chosen seed by seed
with the truth in hand; and ours. Then the ends: what no linear estimate undercuts of a stroke of
which no more is known than that it has no frequency above 1 Hz. And recordings whose stamps come in
bursts: how far a burst's own samples lie off its mean, and the noise-free stroke off all samples.
"""

import numpy as np
from scipy.fft import dct, idct
from scipy.spatial import cKDTree

from benchmarks.noise import SEEDS, strokes
from dmpcli.arrays import Floats
from dmpcli.dmp import least_squares, noise, time_base
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.spline_smoothing import smooth
from dmpcli.spatial.trajectory import Trajectory
from tests import cases
from tests.dmp.recordings import jerk, wave

NAMES = (
    ("wave, 52 samples", (0.02, 0.1)),
    ("zigzag at constant speed, 1400", (0.02, 0.1, 0.5)),
    ("pen lift, 901", (0.02, 0.1, 0.5)),
)


def wiener(points: Floats, truth: Floats, sigma: float) -> Floats:
    """Filter by the true spectrum of what the true line leaves, axis by axis."""
    share = np.linspace(0.0, 1.0, len(truth))[:, None]
    line = truth[0] + share * (truth[-1] - truth[0])
    power = dct(truth - line, axis=0, norm="ortho") ** 2
    gain = power / (power + sigma**2)
    return line + np.asarray(
        idct(gain * dct(points - line, axis=0, norm="ortho"), axis=0, norm="ortho")
    )


def best_uniform(points: Floats, truth: Floats) -> float:
    """Least largest error of uniform splines, K from 2 to half the samples."""
    count = len(points)
    least, K = np.inf, 2
    while count > 2 * K:
        design = least_squares.uniform(count, K)
        # The third axis is flat, and known to be.
        off = design.values(design.coefficients(points[:, :2])) - truth[:, :2]
        least = min(least, float(np.linalg.norm(off, axis=1).max()))
        K = max(K + 1, round(K * 2**0.125))
    return least


def largest() -> None:
    """Print a Markdown table of largest errors."""
    print(
        "| largest error / σ, worst of 30 | σ mm | the samples | Wiener's filter | best uniform K "
        "| ours: median, 9 in 10, worst |\n| --- | ---: | ---: | ---: | ---: | ---: |"
    )
    known = strokes()
    for name, sigmas in NAMES:
        t, truth = known[name]
        for sigma in sigmas:
            rows = []
            for seed in range(SEEDS):
                points = truth + np.random.default_rng(seed).normal(0.0, sigma, truth.shape)
                spline = smooth(points, float(t[-1]), noise.estimate(points))
                off = [points[:, :2] - truth[:, :2], wiener(points, truth, sigma) - truth]
                off.append(spline(t) - truth)
                filtered = [float(np.linalg.norm(x, axis=1).max()) for x in off]
                filtered.insert(2, best_uniform(points, truth))
                rows.append(np.array(filtered) / sigma)
            worst, ours = np.max(rows, axis=0), np.array(rows)[:, 3]
            print(
                f"| {name} | {sigma} | {worst[0]:.2f} | {worst[1]:.2f} | {worst[2]:.2f} "
                f"| {np.median(ours):.2f}, {np.quantile(ours, 0.9):.2f}, {worst[3]:.2f} |",
                flush=True,
            )


def ends() -> None:
    """Print a Markdown table of the least error at an end, in any linear estimate's worst case."""
    print(
        "\n| at an end, 100 Hz, ≤ 1 Hz, amplitude 13 mm | samples | per axis / σ "
        "| of two axes: median | 9 in 10 |\n| --- | ---: | ---: | ---: | ---: |"
    )
    for sigma in (0.02, 0.1, 0.5):
        for count in (52, 200, 1600):
            least = max(posterior(count, sigma, power) for power in (0, 2, 8, 32))
            quantiles = [least * np.sqrt(-2.0 * np.log(1.0 - p)) for p in (0.5, 0.9)]
            print(
                f"| σ {sigma} mm | {count} | {least:.2f} | {quantiles[0]:.2f} "
                f"| {quantiles[1]:.2f} |"
            )


def posterior(count: int, sigma: float, power: int, amplitude: float = 13.0) -> float:
    """Posterior deviation at the first sample, in σ: below the best estimate's largest mean one.

    Of lines, and of cosines of any phase at frequencies up to 1 Hz, normally distributed, their
    density growing with the frequency's power.
    """
    t = 0.01 * np.arange(count)
    f = (np.arange(200) + 0.5) / 200
    weight = np.sqrt(f**power / np.sum(f**power)) * amplitude / np.sqrt(2.0)
    angle = 2.0 * np.pi * np.outer(t, f)
    line = 1e3 * np.stack([np.ones(count), t], axis=1)
    basis = np.concatenate([weight * np.cos(angle), weight * np.sin(angle), line], axis=1)
    value, vectors = np.linalg.eigh(np.eye(basis.shape[1]) + basis.T @ basis / sigma**2)
    return float(np.sqrt(np.sum((basis[0] @ vectors) ** 2 / value)) / sigma)


def bursts() -> None:
    """Print a Markdown table of strokes from uneven stamps, 0.15 mm of noise."""
    print(
        "\n| uneven stamps, seed | drawn off the samples' polyline, mm "
        "| off that of the bursts' means | a sample off that "
        "| the noise-free stroke off all samples |\n"
        "| --- | ---: | ---: | ---: | ---: |"
    )
    truth = wave(jerk(np.linspace(0.0, 1.0, 2001)), 120.0, 12.0)
    for seed in range(12):
        table = cases.uneven(np.random.default_rng(seed))
        recorded = Trajectory(table[:, 0], table[:, 1:4])
        result = fit([recorded], FitOptions())
        frame, reproduced = result.skill.frame, result.reproductions[0].reproduced[:, :3]
        drawn = frame.start + reproduced @ frame.axes.T
        usual = time_base._usual_step(np.diff(recorded.t))
        means = time_base._merged(recorded, usual).position
        print(
            f"| {seed} | {farthest(drawn, recorded.position):.3f} | {farthest(drawn, means):.3f} "
            f"| {farthest(recorded.position, means):.3f} "
            f"| {farthest(truth, recorded.position):.3f} |",
            flush=True,
        )


def farthest(points: Floats, corners: Floats) -> float:
    """Largest distance of points to a polyline, within a thousandth of a mm."""
    steps = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, way[-1], round(way[-1] / 0.01) + 1)
    dense = np.column_stack([np.interp(at, way, c) for c in corners.T])
    return float(cKDTree(np.concatenate([dense, corners])).query(points)[0].max())


def main() -> None:
    """Print all tables."""
    largest()
    ends()
    bursts()


if __name__ == "__main__":
    main()

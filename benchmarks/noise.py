"""What smoothing by noise reaches, over strokes, noises and 30 seeds. ``make bench``.

Errors are those of the spline at the samples' times from the noise-free stroke, over all three
axes, by the noise's standard deviation on one axis; `nearest` is from the nearest point of it.
Then legs that turn within 0.1 to 0.3 s, which may be taken for corners: their peak acceleration by
the true one. Last what smoothing takes of the processor.
"""

import time

import numpy as np
from scipy.spatial import cKDTree

from dmpcli.arrays import Floats
from dmpcli.dmp import noise
from dmpcli.dmp.spline_smoothing import smooth
from tests.dmp.recordings import (
    blended,
    corners,
    handwriting_and_lines,
    jerk,
    letters,
    noisy,
    pen_lift,
    six_seconds,
    times,
    wave,
)

SEEDS = 30
SIGMAS = (0.02, 0.1, 0.5)
BLENDS, FIRST = (0.1, 0.15, 0.2, 0.3), 9500
RUNS = 5


def strokes() -> dict[str, tuple[Floats, Floats]]:
    """Return times and points of noise-free strokes, by name."""
    const = times(4.0)
    fine = times(6.0, 1000.0)
    return {
        "wave, 52 samples": six_seconds(8.5),
        "wave, 121": six_seconds(20.0),
        "wave, 601": six_seconds(),
        "wave, 6001": (fine, wave(jerk(fine / 6.0))),
        "wave at constant speed, 401": (const, wave(const / 4.0, 120.0, 20.0)),
        "30 letters, 3001": letters(),
        "zigzag at constant speed, 1400": corners(),
        "pen lift, 901": pen_lift(),
    }


def smoothing() -> None:
    """Print a Markdown table of errors."""
    print(
        "| stroke | σ mm | RMS / σ, worst | nearest | largest / σ, median, worst "
        "| ends / σ: median, 9 in 10, worst | acceleration, median, worst | K |"
    )
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name, (t, truth) in strokes().items():
        duration = float(t[-1])
        exact = smooth(truth, duration, noise.estimate(truth))
        at = np.linspace(0.0, duration, 1000)
        tree = cKDTree(exact(np.linspace(0.0, duration, 200_001)))
        true = np.max(np.linalg.norm(exact(t, 2), axis=1))
        for sigma in SIGMAS:
            off, near, peaks, K = [], [], [], []
            for seed in range(SEEDS):
                points = truth + np.random.default_rng(seed).normal(0.0, sigma, truth.shape)
                spline = smooth(points, duration, noise.estimate(points))
                off.append(np.linalg.norm(spline(t) - truth, axis=1) / sigma)
                near.append(np.sqrt(np.mean(tree.query(spline(at))[0] ** 2)) / sigma)
                peaks.append(np.max(np.linalg.norm(spline(t, 2), axis=1)) / true)
                K.append(spline.intervals or len(t) - 1)
            errors = np.array(off)
            largest = errors.max(axis=1)
            ends = errors[:, [0, -1]]
            print(
                f"| {name} | {sigma} | {np.sqrt(np.mean(errors**2, axis=1)).max():.2f} "
                f"| {max(near):.2f} | {np.median(largest):.2f}, {largest.max():.2f} "
                f"| {np.median(ends):.2f}, {np.quantile(ends, 0.9):.2f}, {ends.max():.2f} "
                f"| {np.median(peaks):.2f}, {max(peaks):.2f} | {min(K)}-{max(K)} |"
            )


def blends() -> None:
    """Print a Markdown table of legs that turn within a time, another stroke for each seed."""
    print(
        "\n| turns within, s | σ mm | acceleration: median, 9 in 10, worst | above 1.5 | corners |"
    )
    print("| ---: | ---: | ---: | ---: | ---: |")
    for seconds in BLENDS:
        for sigma in SIGMAS:
            peaks, corners_in = [], 0
            for seed in range(FIRST, FIRST + SEEDS):
                t, truth, peak = blended(seed, seconds)
                points = noisy(truth, sigma, seed)
                spline = smooth(points, float(t[-1]), noise.estimate(points))
                peaks.append(np.max(np.linalg.norm(spline(t, 2), axis=1)) / peak)
                corners_in += spline.corners > 0
            print(
                f"| {seconds} | {sigma} | {np.median(peaks):.2f}, {np.quantile(peaks, 0.9):.2f}, "
                f"{max(peaks):.2f} | {np.sum(np.array(peaks) > 1.5)} of {SEEDS} | {corners_in} |",
                flush=True,
            )


def effort() -> None:
    """Print a Markdown table of what smoothing one recording takes of the processor."""
    print("\n| smoothing, σ mm | samples | least ms of processor | corners |")
    print("| --- | ---: | ---: | ---: |")
    recordings = {f"zigzag, {sigma}": (*corners(), sigma) for sigma in SIGMAS} | {
        "legs that turn within 0.1 s, 0.1": (*blended(FIRST, 0.1)[:2], 0.1),
        "pen lift, 0.1": (*pen_lift(), 0.1),
        "handwriting before lines, 0.05": (*handwriting_and_lines(15, 40), 0.05),
        "30 letters, 0.1": (*letters(), 0.1),
    }
    for name, (t, truth, sigma) in recordings.items():
        points = noisy(truth, sigma, 200)
        found = noise.estimate(points)
        spent = []
        for _ in range(RUNS):
            begin = time.process_time()
            spline = smooth(points, float(t[-1]), found)
            spent.append(time.process_time() - begin)
        print(f"| {name} | {len(t)} | {1e3 * min(spent):.0f} | {spline.corners} |", flush=True)


def main() -> None:
    """Print all tables."""
    smoothing()
    blends()
    effort()


if __name__ == "__main__":
    main()

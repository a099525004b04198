"""Time of a fit in process: 500 samples × 6, N = 80. ``make bench``.

Medians and minima over many runs of one process; the ratio to one ``numpy.linalg.solve`` of 80
equations in the same run lets machines be compared.
"""

import time
from collections.abc import Callable

import numpy as np

from dmpcli import rotations
from dmpcli.measures.paper import REPRODUCTION
from dmpcli.primitives import references, regression
from dmpcli.primitives.learning import fit
from dmpcli.primitives.phase import even_in_time, phase
from dmpcli.primitives.preparation import Choices, prepare
from dmpcli.primitives.smoothing import Stroke

RUNS = 200


def milliseconds(task: Callable[[], object]) -> tuple[float, float]:
    """Return the median and the minimum of `RUNS` runs after ten warm ones, ms."""
    for _ in range(10):
        task()
    times = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        task()
        times.append(1e3 * (time.perf_counter() - begin))
    return float(np.median(times)), min(times)


def main() -> None:
    """Print a Markdown table."""
    t = np.linspace(0.0, 10.0, 500)
    angles = np.stack([np.pi + 0.1 * np.sin(t), 0.1 * np.cos(t) - 0.1, 0.05 * t], axis=1)
    start, goal = np.array(REPRODUCTION.start), np.array(REPRODUCTION.goal)
    position = references.sine(start, goal, REPRODUCTION.demonstration, t, 10.0)
    stroke = Stroke(t, position, rotations.from_euler(angles))

    basis = even_in_time(80, 10.0, 5.0, 1.0)
    s = phase(t, 5.0, 1.0)
    forcing = np.random.default_rng(0).normal(size=(500, 6))
    square = np.random.default_rng(1).normal(size=(80, 80)) + 80 * np.eye(80)
    skill = fit([stroke], Choices()).skill
    rows: dict[str, Callable[[], object]] = {
        "numpy.linalg.solve, 80 × 80, 6 right sides": lambda: np.linalg.solve(
            square, square[:, :6]
        ),
        "regression, LWR": lambda: regression.lwr(basis, s, s, forcing),
        "regression, ridge": lambda: regression.ridge(basis, s, s, forcing),
        "smoothing, chart, derivatives": lambda: prepare(stroke, Choices()),
        "response of eq. (9)-(11), 500 samples": lambda: skill.response(t),
        "whole fit, LWR": lambda: fit([stroke], Choices()),
        "whole fit, ridge": lambda: fit([stroke], Choices(regression="ridge")),
    }
    print("| 500 samples × 6, N = 80 | median ms | least ms | × solve |")
    print("| --- | ---: | ---: | ---: |")
    unit = 1.0
    for i, (name, task) in enumerate(rows.items()):
        median, least = milliseconds(task)
        unit = median if i == 0 else unit
        print(f"| {name} | {median:.2f} | {least:.2f} | {median / unit:.1f} |")


if __name__ == "__main__":
    main()

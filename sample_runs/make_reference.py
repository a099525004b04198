"""Write the noise-free reference stroke of the paper's experiment as a demonstration file.

One sine period across the start-goal line, first bulge to +v, minimum jerk along u, 10 s, pen
straight down: what the mock tutor tries to follow, without hand, sensor or servo.

    python sample_runs/make_reference.py sample_runs/reference.parquet
"""

import sys

import numpy as np

from dmpcli.dmp import reference_paths
from dmpcli.metrics.paper_values import REPRODUCTION
from dmpcli.records import file_io, record, schemas
from dmpcli.records.record import Provenance, Record

RATE = 50.0
DURATION = 10.0
WAVE_HEIGHT = REPRODUCTION.demonstration


def main() -> None:
    """Write the file that the command line names."""
    t = np.arange(round(DURATION * RATE) + 1) / RATE
    start, goal = np.array(REPRODUCTION.start), np.array(REPRODUCTION.goal)
    position = reference_paths.sine(start, goal, WAVE_HEIGHT, t, DURATION)
    columns = {"t": t} | {name: position[:, i] for i, name in enumerate("xyz")}
    columns |= {"rx": np.full(len(t), np.pi), "ry": np.zeros(len(t)), "rz": np.zeros(len(t))}
    options = {"reference": "sine", "wave_height": WAVE_HEIGHT, "duration": DURATION}
    reference = {
        "shape": "sine",
        "start": start.tolist(),
        "goal": goal.tolist(),
        "wave_height": WAVE_HEIGHT,
        "periods": 1.0,
    }
    facts = {"simulated": True, "reference": reference, "noise_free": True}
    provenance = Provenance("make_reference.py", options, facts=facts)
    file_io.write(sys.argv[1], record.encode(Record(schemas.DEMONSTRATION, columns, provenance)))


if __name__ == "__main__":
    main()

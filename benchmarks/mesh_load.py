"""Loading a 500,000-face mesh, in each format, in a process of its own. ``make bench``."""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh

SIDE = 501
RUNS = 5

LOAD = """
import sys, time
begin = time.perf_counter()
from dmpcli.records import mesh, streams
imported = time.perf_counter()
found = mesh.decode(streams.read(sys.argv[1]))
loaded = time.perf_counter()
mesh.summary(found)
print(imported - begin, loaded - imported, time.perf_counter() - loaded)
"""


def main() -> None:
    """Print a Markdown table of medians."""
    line = np.linspace(-100.0, 100.0, SIDE)
    x, y = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
    i = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = (s.ravel() for s in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    mesh = trimesh.Trimesh(np.stack([x, y, (x**2 - y**2) / 240.0], axis=1), F, process=False)
    print(f"| {len(F)} faces | import, s | read, check and mend, s | chordal error, s |")
    print("| --- | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as folder:
        for kind, name in (
            ("stl", "part.stl"),
            ("ply", "part.ply"),
            ("obj", "part.obj"),
            ("stl_ascii", "text.stl"),
        ):
            path = Path(folder) / name
            mesh.export(str(path), file_type=kind)
            command = [sys.executable, "-c", LOAD, str(path)]
            times = [
                [float(t) for t in subprocess.run(command, capture_output=True).stdout.split()]
                for _ in range(RUNS)
            ]
            shown = " | ".join(f"{t:.2f}" for t in np.median(times, axis=0))
            print(f"| {kind} | {shown} |")


if __name__ == "__main__":
    main()

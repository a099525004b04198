"""Two trees of this project in turn. ``python -m benchmarks.earlier OUT TREE [FACES ...]``.

TREE is a checkout of an earlier commit (``git worktree add TREE 1b220bd``, the first one of the
table of parts), which runs in this environment. Two processes of each draw parts of 250 pairs on
meshes of so many faces (50,000 and 500,000), in memory, in turn: trajectories per second of the
clock and of the processor, and how many times as many this tree draws.
"""

import multiprocessing
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

PART, PAIRS = 250, 1000
TURNS = int(os.environ.get("TURNS", "7"))
FACES = (50_000, 500_000)

_HELD: list[Any] = []


def main() -> None:
    """Print a Markdown table."""
    from benchmarks.batches import curved_pairs
    from benchmarks.kernels import field_mesh

    place, earlier = Path(sys.argv[1]).absolute(), Path(sys.argv[2]).absolute()
    place.mkdir(parents=True, exist_ok=True)
    trees = {"earlier": earlier, "this": Path.cwd()}
    print("| faces | earlier, of the clock | this | ratio of medians | of the least times "
          "| earlier, of the processor | this | ratio |")  # fmt: skip
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |", flush=True)
    rows = curved_pairs(PAIRS)
    for faces in map(int, sys.argv[3:] or FACES):
        mesh = field_mesh(faces)
        np.savez(place / "mesh.npz", V=mesh.V, F=mesh.F, rows=rows)
        drawers = {name: Drawer(tree, place / f"{name}.json") for name, tree in trees.items()}
        times: dict[str, list[list[float]]] = {name: [] for name in trees}
        for turn in range(TURNS + 1):
            for name, drawer in drawers.items():
                took = drawer.draw()
                if turn:
                    times[name].append(took)
        for drawer in drawers.values():
            drawer.end()
        clock, spent = (
            {name: np.array(found)[:, i] for name, found in times.items()} for i in (0, 1)
        )
        by_clock, used = (
            {name: PAIRS / float(np.median(found)) for name, found in each.items()}
            for each in (clock, spent)
        )
        least = clock["earlier"].min() / clock["this"].min()
        figures = [f"{by_clock['earlier']:.0f}", f"{by_clock['this']:.0f}"]
        figures += [f"{by_clock['this'] / by_clock['earlier']:.2f}", f"{least:.2f}"]
        figures += [f"{used['earlier']:.0f}", f"{used['this']:.0f}"]
        figures += [f"{used['this'] / used['earlier']:.2f}"]
        print(f"| {faces} | {' | '.join(figures)} |", flush=True)


class Drawer:
    """A process of a tree, which has two that draw whenever it is told."""

    def __init__(self, tree: Path, skill: Path) -> None:
        # Only what that tree has itself is imported, but for this file.
        environment = {**os.environ, "PYTHONPATH": str(tree)}
        python = [sys.executable, "-P"]
        reference = tree / "sample_runs" / "reference.parquet"
        fit = ["-m", "dmpcli", "fit", reference, "-o", skill, "-q"]
        subprocess.run([*python, *fit], check=True, env=environment, cwd=tree)
        words = [*python, Path(__file__).absolute(), "--draw", tree, skill, skill.parent]
        self._process = subprocess.Popen(
            list(map(str, words)),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            cwd=tree,
        )

    def draw(self) -> list[float]:
        """Draw all pairs once; return seconds of the clock and of the processor."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print("draw", file=self._process.stdin, flush=True)
        return [float(word) for word in self._process.stdout.readline().split()]

    def end(self) -> None:
        """Let it end."""
        self._process.communicate()


def serve(tree: str, skill: str, place: str) -> None:
    """Draw all pairs for each line that comes in."""
    import dmpcli

    assert Path(dmpcli.__file__).is_relative_to(tree)
    given = np.load(Path(place) / "mesh.npz")
    _HELD.extend([*_task(Path(skill), given["V"], given["F"]), given["rows"]])
    from dmpcli.batch import memory

    with multiprocessing.get_context("fork").Pool(2, memory.keep) as pool:
        for _ in sys.stdin:
            begin = time.perf_counter()
            spent = pool.map(_draw, range(0, PAIRS, PART), chunksize=1)
            print(time.perf_counter() - begin, sum(spent), flush=True)


def _task(path: Path, V: Any, F: Any) -> tuple[Any, Any, Any]:
    """Return what a tree draws with: a task, its pairs, and its function."""
    from dmpcli.records import skill as skill_file
    from dmpcli.surfaces.mesh import Mesh

    try:
        from dmpcli.batch.task import Task
        from dmpcli.dmp.drawn_strokes import GeneralizeOptions
        from dmpcli.dmp.generalization import draw_blocks
        from dmpcli.dmp.rollout import Pairs
        from dmpcli.records import file_io
        from dmpcli.surfaces.kernels import ready
    except ImportError:
        # The names of 1b220bd.
        from dmpcli.batch.job import Task
        from dmpcli.primitives.drawing import Style, draw_blocks
        from dmpcli.primitives.generalization import Pairs

        from dmpcli.records import streams

        skill, _ = skill_file.decode(streams.read(path))
        return Task(skill, Mesh(V, F), Style(), "fail"), Pairs, draw_blocks
    ready.load()
    skill, _ = skill_file.decode(file_io.read(path))
    return Task(skill, Mesh(V, F), GeneralizeOptions(compiled=True)), Pairs, draw_blocks


def _draw(first: int) -> float:
    """Draw a part; return the processor time, s."""
    task, pairs, draw_blocks, rows = _HELD
    begin = time.process_time()
    ends = rows[first : first + PART]
    lasting = np.full(len(ends), task.skill.duration)
    of = pairs(ends[:, :3], ends[:, 3:]), lasting
    for _ in draw_blocks(task.skill, *of, task.surface, task.style):
        pass
    return time.process_time() - begin


if __name__ == "__main__":
    if sys.argv[1:2] == ["--draw"]:
        serve(*sys.argv[2:])
    else:
        main()

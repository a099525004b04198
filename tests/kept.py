"""Results that are kept: a few numbers for each array that comes out of a case.

Tests against closed forms know what is right, and look at one quantity with some room. Whether a
limit inside of an algorithm has moved, they need not notice. What is kept here knows nothing of
right: it notices that a result has changed, says which one, and by how much. After a change on
purpose, that other tests have judged:

    python -m tests.kept [ROOM ...]     # keeps today's results of rooms, or of all
"""

import importlib
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path

import numpy as np
from scipy.interpolate import BSpline

ROOMS = ("dmp", "surfaces", "metrics", "planning", "admittance", "control")
LIKE, NEAR = 1e-6, 1e-8
"""How far a result may be off: as a part of its root mean square, and besides."""


class Kept:
    """The cases of one file of tests, whose results stand in `kept.json` beside it."""

    def __init__(self, file: str) -> None:
        self.path = Path(file).with_name("kept.json")
        self.cases: dict[str, Callable] = {}

    def case(self, make: Callable) -> Callable:
        """Take a function without arguments, whose result is kept under its name."""
        self.cases[make.__name__] = make
        return make

    def check(self, name: str) -> None:
        """Hold a case's result against the one that was kept."""
        wanted = json.loads(self.path.read_text())[name]
        found = told(self.cases[name]())
        assert list(found) == list(wanted)
        off = [place for place in found if not alike(found[place], wanted[place])]
        assert not off, "\n".join(f"{at}: {found[at]}, kept {wanted[at]}" for at in off)

    def keep(self) -> None:
        """Write today's results."""
        lines = [
            f"{json.dumps(name)}: {json.dumps(told(make()))}" for name, make in self.cases.items()
        ]
        self.path.write_text("{\n" + ",\n".join(lines) + "\n}\n")


def told(value: object) -> dict[str, list]:
    """Tell a result by its parts: words as they are, each array by at most five numbers."""
    return dict(_parts(value, ""))


def alike(found: list, wanted: list) -> bool:
    """Tell whether two arrays are the same but for rounding."""
    if len(found) != len(wanted) or not all(isinstance(x, float | int) for x in found + wanted):
        return found == wanted
    a, b = np.array(found, dtype=float), np.array(wanted, dtype=float)
    size = np.abs(b[len(b) // 2])
    with np.errstate(invalid="ignore"):
        near = np.abs(a - b) <= (LIKE * size + NEAR if np.isfinite(size) else 0.0)
    return bool(np.all(near | (a == b) | (np.isnan(a) & np.isnan(b))))


def _parts(value: object, place: str) -> Iterator[tuple[str, list]]:
    if value is None or isinstance(value, str):
        yield place, [value]
    elif isinstance(value, Enum | bool | int | float | np.ndarray | np.generic):
        yield place, _numbers(np.asarray(value, dtype=float))
    elif isinstance(value, BSpline):
        yield f"{place}.t", _numbers(value.t)
        yield f"{place}.c", _numbers(value.c)
    elif is_dataclass(value):
        for field in fields(value):
            yield from _parts(getattr(value, field.name), f"{place}.{field.name}")
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _parts(item, f"{place}.{key}")
    elif isinstance(value, list | tuple | set):
        items = sorted(value) if isinstance(value, set) else value
        if items and all(isinstance(x, bool | int | float | np.generic) for x in items):
            yield place, _numbers(np.array(items, dtype=float))
        else:
            yield place, [f"{len(items)} items"]
            for n, item in enumerate(items):
                yield from _parts(item, f"{place}[{n}]")


def _numbers(x: np.ndarray) -> list:
    """Size, how many are not finite, root mean square, and two means with weights of any sign.

    A single number stands for itself.
    """
    x = x.ravel()
    if x.size == 1:
        return [float(f"{x[0]:.10g}")]
    finite = np.isfinite(x)
    y, n = np.where(finite, x, 0.0), np.arange(x.size)
    rms = np.sqrt(np.mean(y * y)) if x.size else 0.0
    means = [np.mean(y * np.cos(w * (n + 1))) if x.size else 0.0 for w in (0.9, 2.39996)]
    return [x.size, int(x.size - finite.sum()), *(float(f"{a:.10g}") for a in (rms, *means))]


def main(rooms: list[str]) -> None:
    """Keep today's results."""
    for room in rooms or ROOMS:
        if Path(__file__).with_name(room).joinpath("test_kept.py").exists():
            importlib.import_module(f"tests.{room}.test_kept").KEPT.keep()


if __name__ == "__main__":
    main(sys.argv[1:])

"""The stroke that the mock tutor draws: one of the shapes, or a polyline from a CSV file."""

import csv
import io
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import reference_paths
from dmpcli.errors import InputError
from dmpcli.records import file_io
from dmpcli.records.file_io import Source
from dmpcli.records.untrusted import decoder
from dmpcli.settings.record import RecordSettings

AXES = ("x", "y", "z")
SHAPES = ("sine", "line", "circle")
DURATION = 10.0
"""Of a stroke where nothing else is said, s."""


@dataclass(frozen=True)
class Reference:
    """A stroke over time on a plate.

    Attributes
    ----------
    at : callable
        From times, shape (T,), s, and a duration, s, to positions, shape (T, 3), mm.
    start : array, shape (3,)
        mm.
    normal : array, shape (3,)
        Unit normal of the plate that it lies on, on the tool's side.
    facts : dict
        What it is, for the file's metadata.
    source : Source or None
        The CSV file it was read from.
    """

    at: Callable[[Floats, float], Floats]
    start: Floats
    normal: Floats
    facts: dict[str, object]
    source: Source | None = None


def build(settings: RecordSettings) -> Reference:
    """Make the reference stroke that the settings ask for.

    Raises
    ------
    InputError
        The shape is unknown, start and goal are the same, or the CSV file is wrong.
    """
    shape = settings.reference
    if shape.endswith(".csv"):
        return _from_csv(file_io.read(shape))
    if shape not in SHAPES:
        raise InputError(
            f"--reference {shape}: no such stroke; there are {', '.join(SHAPES)}, "
            "or give a file that ends in .csv"
        )
    start, goal = np.array(settings.start), np.array(settings.goal)
    if np.linalg.norm(goal - start) < 1e-3:
        raise InputError("--start and --goal: are the same point; the stroke needs two")
    normal = level_normal(goal - start)
    ends = {"start": [*settings.start], "goal": [*settings.goal]}
    facts: dict[str, object] = {"shape": shape, **ends}
    if shape == "line":
        return Reference(lambda t, T: reference_paths.line(start, goal, t, T), start, normal, facts)
    if shape == "circle":
        return Reference(
            lambda t, T: reference_paths.circle(start, goal, t, T, normal), start, normal, facts
        )
    facts |= {"wave_height": settings.wave_height, "periods": settings.periods}
    return Reference(
        lambda t, T: reference_paths.sine(
            start, goal, settings.wave_height, t, T, settings.periods, normal
        ),
        start,
        normal,
        facts,
    )


def level_normal(along: Floats) -> Floats:
    """Unit normal of the most level plane that holds a direction, pointing up.

    Parameters
    ----------
    along : array, shape (3,)
        Not zero. For a vertical one the plane is the one across base x.
    """
    u = along / np.linalg.norm(along)
    up = np.array([0.0, 0.0, 1.0]) if abs(u[2]) < 0.99 else np.array([1.0, 0.0, 0.0])
    normal = up - (up @ u) * u
    return np.asarray(normal / np.linalg.norm(normal))


def _from_csv(source: Source) -> Reference:
    points = read_points(source)
    chord = points[-1] - points[0]
    normal = np.array([0.0, 0.0, 1.0])
    if np.linalg.norm(chord) > 1e-3:
        normal = level_normal(chord)
    facts = {"shape": "polyline", "points": len(points)}
    return Reference(
        lambda t, T: reference_paths.polyline(points, t, T), points[0], normal, facts, source
    )


@decoder
def read_points(source: Source) -> Floats:
    """Read the points of a polyline from the columns x, y, z (mm) of a CSV file.

    Raises
    ------
    InputError
        A column is missing, a value is not a finite number, or there are fewer than two different
        points; file, column and row are named.
    """
    try:
        text = source.content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{source.name}: is not text; a CSV with x, y, z is needed") from None
    # newline="": csv tells line ends and quoted ones apart by itself.
    rows = csv.reader(io.StringIO(text, newline=""), skipinitialspace=True)
    try:
        table = [row for row in rows if row]
    except csv.Error as error:
        raise InputError(f"{source.name}: is not CSV: {error}") from None
    names = [name.strip() for name in table[0]] if table else []
    for column in AXES:
        if column not in names:
            raise InputError(
                f"{source.name}: column {column!r} is missing; the first row has {', '.join(names)}"
            )
    places = [(column, names.index(column)) for column in AXES]
    points = [
        [
            _number(row[place] if place < len(row) else "", source.name, column, number)
            for column, place in places
        ]
        for number, row in enumerate(table[1:], start=1)
    ]
    array = np.array(points).reshape(-1, 3)
    if len(array) < 2 or np.ptp(array, axis=0).max() < 1e-3:
        raise InputError(
            f"{source.name}: a polyline needs two different points, it has {len(array)}"
        )
    return array


def _number(text: str, file: str, column: str, row: int) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(
            f"{file}: column {column!r}, row {row}: {text!r} is not a finite number; mend the row"
        )
    return value

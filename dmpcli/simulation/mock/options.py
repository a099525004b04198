"""The options of a ``mock:`` URL, and the scene that they arrange."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.simulation.mock.parameters import Plate, Scene
from dmpcli.spatial.rotations import from_euler

KEYS = {
    "x": "mm, where the TCP stands at the beginning",
    "y": "mm",
    "z": "mm",
    "rx": "rad, X-Y-Z Euler angles",
    "ry": "rad",
    "rz": "rad",
    "plate": "mm, height of a level plate; 'none' for no plate",
    "stiffness": "N/mm, of the plate",
    "friction": "1, of the pen on the plate",
    "lag": "s, of the servo",
    "speed": "mm/s, fastest that the servo follows",
    "seed": "1, of the sensor's noise and drift",
    "estop_at": "s after the start, the emergency stop is pressed",
    "silent_at": "s after the start, the sensor falls silent",
    "refuse_at": "s after the start, the controller refuses set-points",
}
"""What may follow ``mock:?``, as key=value pairs joined by ``&``."""

_NOT_NEGATIVE = {"friction", "lag", "seed", "estop_at", "silent_at", "refuse_at"}
_POSITIVE = {"stiffness", "speed"}
_SMALLEST, _LARGEST, _LONGEST_LAG = 1e-6, 1e6, 10.0


def numbers(options: Mapping[str, str], url: str) -> dict[str, float | None]:
    """Return the options as numbers, None for ``none``.

    Parameters
    ----------
    options : mapping
        As they stand in the URL.
    url : str
        For messages: the option and the URL that it was given.

    Raises
    ------
    InputError
        One is unknown, or is not a number in its range.
    """
    read: dict[str, float | None] = {}
    for key, text in options.items():
        where = f"{url}: {key}"
        if key not in KEYS:
            raise InputError(f"{where}: the mock has no such option; it has {', '.join(KEYS)}")
        read[key] = None if (key, text) == ("plate", "none") else _number(where, key, text)
    return read


def _number(where: str, key: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where} = {text!r}: a finite number is needed ({KEYS[key]})")
    largest = _LONGEST_LAG if key == "lag" else _LARGEST
    if abs(value) > largest and key != "seed":
        raise InputError(f"{where} = {text}: must lie within ±{largest:g} ({KEYS[key]})")
    if value < 0.0 and key in _NOT_NEGATIVE:
        raise InputError(f"{where} = {text}: must not be negative ({KEYS[key]})")
    if value < _SMALLEST and key in _POSITIVE:
        raise InputError(f"{where} = {text}: must be {_SMALLEST:g} or more ({KEYS[key]})")
    if key == "seed" and value != int(value):
        raise InputError(f"{where} = {text}: must be a whole number")
    return value


def arranged(scene: Scene, options: Mapping[str, float | None]) -> Scene:
    """Return a scene changed by the options of a ``mock:`` URL.

    Parameters
    ----------
    scene : Scene
    options : mapping
        By the keys of `KEYS`.
    """
    given = {key: value for key, value in options.items() if value is not None}

    def picked(*keys: str) -> dict[str, Any]:
        return {key: given[key] for key in keys if key in given}

    def each_of(keys: str, otherwise: Iterable[float]) -> Floats:
        return np.array([given.get(k, o) for k, o in zip(keys.split(), otherwise, strict=True)])

    rotation, plate = scene.rotation, scene.plate
    if given.keys() & {"rx", "ry", "rz"}:
        # Angles that are not given are those of a pen that points straight down.
        rotation = from_euler(each_of("rx ry rz", (np.pi, 0.0, 0.0)))
    if "plate" in options:
        plate = Plate(np.array([0.0, 0.0, given["plate"]])) if "plate" in given else None
    return replace(
        scene,
        position=each_of("x y z", scene.position.tolist()),
        rotation=rotation,
        plate=plate and replace(plate, **picked("stiffness", "friction")),
        servo=replace(scene.servo, **picked("lag", "speed")),
        faults=replace(scene.faults, **picked("estop_at", "silent_at", "refuse_at")),
        seed=int(given.get("seed", scene.seed)),
    )

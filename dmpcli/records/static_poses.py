"""Static poses: where the tool stood, and what the sensor read there in the mean; Parquet."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmpcli.arrays import AnyArray, Floats
from dmpcli.errors import InputError
from dmpcli.records import record, schemas
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance, Record
from dmpcli.records.schemas import EULER_ANGLES, POSITION, WRENCH, suffixed
from dmpcli.records.untrusted import decoder
from dmpcli.spatial.rotations import from_euler, to_euler

_RAW, _STD = suffixed(WRENCH, "raw"), suffixed(WRENCH, "std")
_STILL = ("moved", "turned", "unsteady")


@dataclass(frozen=True)
class StaticPose:
    """One dwell of the tool, at rest or nearly.

    Attributes
    ----------
    t : float
        When it ended, s.
    position, rotation : array, shape (3,) and (3, 3)
        Mean actual TCP, mm.
    moved, turned : float
        Furthest from the mean meanwhile, mm and rad.
    wrench, spread : array, shape (6,)
        Mean and standard deviation of the readings, N and N·m, sensor axes; NaN without a sensor.
    samples : int
        How many readings.
    unsteady : float
        By how much the mean force of the second half differs from the first's, N.
    """

    t: float
    position: Floats
    rotation: Floats
    moved: float
    turned: float
    wrench: Floats
    spread: Floats
    samples: int
    unsteady: float


def encode(poses: list[StaticPose], provenance: Provenance) -> bytes:
    """Return poses as the bytes of a Parquet file.

    Parameters
    ----------
    poses : list of StaticPose
        At least one.
    provenance : Provenance
    """
    columns: dict[str, AnyArray] = {"t": np.array([pose.t for pose in poses])}
    columns |= _split(POSITION, np.array([pose.position for pose in poses]))
    columns |= _split(EULER_ANGLES, to_euler(np.array([pose.rotation for pose in poses])))
    columns |= _split(_RAW, np.array([pose.wrench for pose in poses]))
    columns |= _split(_STD, np.array([pose.spread for pose in poses]))
    columns["samples"] = np.array([pose.samples for pose in poses], dtype=np.int64)
    columns |= _split(_STILL, np.array([[getattr(p, name) for name in _STILL] for p in poses]))
    return record.encode(Record(schemas.POSES, columns, provenance))


@decoder
def decode(source: Source) -> tuple[list[StaticPose], dict[str, Any]]:
    """Read static poses, and the facts that their file states.

    Raises
    ------
    InputError
        Not such a file, or an orientation or a reading is missing; names column and row.
    """
    found = record.decode(source, schemas.POSES)
    for name in (*EULER_ANGLES, *_RAW):
        values = found.columns.get(name, np.full(len(found), np.nan))
        missing = np.flatnonzero(np.isnan(values))
        if len(missing):
            raise InputError(
                f"{found.name}: column {name!r}, row {missing[0] + 1}: no value; a pose needs an "
                "orientation and a reading"
            )
    rotation, raw = from_euler(found.stack(EULER_ANGLES)), found.stack(_RAW)
    spread = found.stack(_STD) if found.has(*_STD) else np.full_like(raw, np.nan)
    # A file from elsewhere may not say how the tool rested.
    still = {name: found.columns.get(name, np.zeros(len(found))) for name in _STILL}
    moved, turned, unsteady = (np.nan_to_num(still[name]) for name in _STILL)
    t, position = found.t, found.position()
    poses = [
        StaticPose(
            float(t[i]),
            position[i],
            rotation[i],
            float(moved[i]),
            float(turned[i]),
            raw[i],
            spread[i],
            int(found.columns["samples"][i]),
            float(unsteady[i]),
        )
        for i in range(len(found))
    ]
    return poses, dict(found.provenance.facts)


def _split(names: tuple[str, ...], values: Floats) -> dict[str, AnyArray]:
    return {name: values[:, i] for i, name in enumerate(names)}

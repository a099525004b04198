"""The plane file: a point and a normal, as JSON."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from dmpcli.errors import InputError
from dmpcli.records import documents
from dmpcli.records.documents import Part
from dmpcli.records.pairs import FARTHEST
from dmpcli.records.streams import Source
from dmpcli.surfaces.plane import Plane

SCHEMA = "plane"
VERSION = 1


class PlaneFile(Part):
    """A plane in the robot's base frame."""

    schema_name: Annotated[Literal["plane"], Field(alias="schema")] = "plane"
    version: Annotated[int, Field(ge=1)] = VERSION
    point: Annotated[list[float], Field(min_length=3, max_length=3, description="mm")]
    normal: Annotated[
        list[float],
        Field(min_length=3, max_length=3, description="of any length, on the tool's side"),
    ]


def decode(source: Source) -> Plane:
    """Read a plane file.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or not a point and a normal.
    """
    remedy = 'a plane is {"point": [x, y, z], "normal": [nx, ny, nz]} in mm'
    file = documents.validated(source, PlaneFile, SCHEMA, VERSION, remedy, by_hand=True)
    normal, point = np.array(file.normal), np.array(file.point)
    if np.abs(point).max() > FARTHEST:
        raise InputError(f"{source.name}: point: is beyond {FARTHEST:g} mm; check its unit")
    largest = np.abs(normal).max()
    if largest == 0.0:
        raise InputError(f"{source.name}: normal: is zero; it must point off the plane")
    normal = normal / largest  # so that squares neither overflow nor vanish
    return Plane(point, normal / np.linalg.norm(normal))


def schema() -> dict[str, Any]:
    """Return the JSON Schema of plane files."""
    return documents.json_schema(PlaneFile, SCHEMA)

"""The plane file: a point and a normal, as JSON."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from dmpcli.errors import InputError
from dmpcli.records.pairs import FARTHEST
from dmpcli.records.skill import json_document
from dmpcli.records.streams import Source
from dmpcli.surfaces.plane import Plane

VERSION = 1


class PlaneFile(BaseModel):
    """A plane in the robot's base frame."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

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
    document = json_document(source)
    version = document.get("version", VERSION)
    if isinstance(version, int) and version > VERSION:
        raise InputError(
            f"{source.name}: plane version {version} is newer than this program's ({VERSION}); "
            "upgrade dmpcli"
        )
    try:
        file = PlaneFile.model_validate(document)
    except ValidationError as error:
        detail = error.errors()[0]
        where = ".".join(str(part) for part in detail["loc"]) or "document"
        raise InputError(
            f"{source.name}: {where}: {detail['msg']}; a plane is "
            '{"point": [x, y, z], "normal": [nx, ny, nz]} in mm'
        ) from None
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
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "dmpcli plane",
    } | PlaneFile.model_json_schema(by_alias=True)

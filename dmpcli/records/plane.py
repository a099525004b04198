"""The plane file: a point and a normal, as JSON."""

from typing import Annotated, Any, Literal

from pydantic import Field

from dmpcli.records import directions, json_files
from dmpcli.records.file_io import Source
from dmpcli.records.json_files import JsonPart
from dmpcli.records.untrusted import decoder
from dmpcli.surfaces.plane import Plane

SCHEMA = "plane"
VERSION = 1
FORM = '{"point": [x, y, z], "normal": [nx, ny, nz]}'
"""What people write."""


class PlaneFile(JsonPart):
    """A plane in the robot's base frame."""

    schema_name: Annotated[Literal["plane"], Field(alias="schema")] = "plane"
    version: Annotated[int, Field(ge=1)] = VERSION
    point: Annotated[list[float], Field(min_length=3, max_length=3, description="mm")]
    normal: Annotated[
        list[float],
        Field(min_length=3, max_length=3, description="of any length, on the tool's side"),
    ]


@decoder
def decode(source: Source) -> Plane:
    """Read a plane file.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or not a point and a normal.
    """
    remedy = f"a plane is {FORM} in mm"
    file = json_files.validated(source, PlaneFile, SCHEMA, VERSION, remedy, by_hand=True)
    return Plane(
        directions.near(source, "point", file.point),
        directions.unit(source, "normal", file.normal, "point off the plane"),
    )


def schema() -> dict[str, Any]:
    """Return the JSON Schema of plane files."""
    return json_files.json_schema(PlaneFile, SCHEMA)

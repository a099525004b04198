"""The sphere file: a centre and a radius, as JSON."""

from typing import Annotated, Any, Literal

from pydantic import Field

from dmpcli.records import directions, json_files
from dmpcli.records.cylinder import Radius
from dmpcli.records.file_io import Source
from dmpcli.records.json_files import JsonPart
from dmpcli.records.untrusted import decoder
from dmpcli.surfaces.sphere import Sphere

SCHEMA = "sphere"
VERSION = 1
FORM = '{"centre": [x, y, z], "radius": r}'
"""What people write."""


class SphereFile(JsonPart):
    """A sphere in the robot's base frame; the tool may be outside or inside of it."""

    schema_name: Annotated[Literal["sphere"], Field(alias="schema")] = "sphere"
    version: Annotated[int, Field(ge=1)] = VERSION
    centre: Annotated[list[float], Field(min_length=3, max_length=3, description="mm")]
    radius: Radius


@decoder
def decode(source: Source) -> Sphere:
    """Read a sphere file.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or not a centre and a radius.
    """
    remedy = f"a sphere is {FORM} in mm"
    file = json_files.validated(source, SphereFile, SCHEMA, VERSION, remedy, by_hand=True)
    return Sphere(directions.near(source, "centre", file.centre), file.radius)


def schema() -> dict[str, Any]:
    """Return the JSON Schema of sphere files."""
    return json_files.json_schema(SphereFile, SCHEMA)

"""The cylinder file: a point on the axis, the axis and a radius, as JSON."""

from typing import Annotated, Any, Literal

from pydantic import Field

from dmpcli.records import directions, json_files
from dmpcli.records.columns import FARTHEST
from dmpcli.records.file_io import Source
from dmpcli.records.json_files import JsonPart
from dmpcli.records.untrusted import decoder
from dmpcli.surfaces.cylinder import Cylinder

SCHEMA = "cylinder"
VERSION = 1
FORM = '{"point": [x, y, z], "axis": [ax, ay, az], "radius": r}'
"""What people write."""

SMALLEST = 0.1
"""mm; a smaller radius is more likely in another unit than meant so."""

Radius = Annotated[float, Field(ge=SMALLEST, le=FARTHEST, description="mm")]


class CylinderFile(JsonPart):
    """An endless cylinder in the robot's base frame; the tool may be outside or inside of it."""

    schema_name: Annotated[Literal["cylinder"], Field(alias="schema")] = "cylinder"
    version: Annotated[int, Field(ge=1)] = VERSION
    point: Annotated[
        list[float], Field(min_length=3, max_length=3, description="any on the axis, mm")
    ]
    axis: Annotated[
        list[float], Field(min_length=3, max_length=3, description="of any length, either way")
    ]
    radius: Radius


@decoder
def decode(source: Source) -> Cylinder:
    """Read a cylinder file.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or not a point, an axis and a radius.
    """
    remedy = f"a cylinder is {FORM} in mm"
    file = json_files.validated(source, CylinderFile, SCHEMA, VERSION, remedy, by_hand=True)
    return Cylinder(
        directions.near(source, "point", file.point),
        directions.unit(source, "axis", file.axis, "point along the cylinder"),
        file.radius,
    )


def schema() -> dict[str, Any]:
    """Return the JSON Schema of cylinder files."""
    return json_files.json_schema(CylinderFile, SCHEMA)

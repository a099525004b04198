"""Surface files in closed form: a plane, a cylinder or a sphere, as JSON."""

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from dmpcli.records import directions, json_files
from dmpcli.records.columns import FARTHEST
from dmpcli.records.file_io import Source
from dmpcli.records.json_files import JsonPart
from dmpcli.records.untrusted import decoder
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere

Exact: TypeAlias = Plane | Cylinder | Sphere
"""Surfaces that a JSON file gives in closed form."""

VERSION = 1
"""Of all three schemas."""

FORMS = {
    "plane": '{"point": [x, y, z], "normal": [nx, ny, nz]}',
    "cylinder": '{"point": [x, y, z], "axis": [ax, ay, az], "radius": r}',
    "sphere": '{"centre": [x, y, z], "radius": r}',
}
"""What people write."""

SMALLEST = 0.1
"""mm; a smaller radius is more likely in another unit than meant so."""

_Radius = Annotated[float, Field(ge=SMALLEST, le=FARTHEST, description="mm")]


class PlaneFile(JsonPart):
    """A plane in the robot's base frame."""

    schema_name: Annotated[Literal["plane"], Field(alias="schema")] = "plane"
    version: Annotated[int, Field(ge=1)] = VERSION
    point: Annotated[list[float], Field(min_length=3, max_length=3, description="mm")]
    normal: Annotated[
        list[float],
        Field(min_length=3, max_length=3, description="of any length, on the tool's side"),
    ]

    def surface(self, source: Source) -> Plane:
        """Return the plane, checked."""
        return Plane(
            directions.near(source, "point", self.point),
            directions.unit(source, "normal", self.normal, "point off the plane"),
        )


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
    radius: _Radius

    def surface(self, source: Source) -> Cylinder:
        """Return the cylinder, checked."""
        return Cylinder(
            directions.near(source, "point", self.point),
            directions.unit(source, "axis", self.axis, "point along the cylinder"),
            self.radius,
        )


class SphereFile(JsonPart):
    """A sphere in the robot's base frame; the tool may be outside or inside of it."""

    schema_name: Annotated[Literal["sphere"], Field(alias="schema")] = "sphere"
    version: Annotated[int, Field(ge=1)] = VERSION
    centre: Annotated[list[float], Field(min_length=3, max_length=3, description="mm")]
    radius: _Radius

    def surface(self, source: Source) -> Sphere:
        """Return the sphere, checked."""
        return Sphere(directions.near(source, "centre", self.centre), self.radius)


FILES: dict[str, type[PlaneFile | CylinderFile | SphereFile]] = {
    "plane": PlaneFile,
    "cylinder": CylinderFile,
    "sphere": SphereFile,
}
"""By the names of their schemas."""


@decoder
def decode(source: Source, kind: str) -> Exact:
    """Read a file of one of `FILES`.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or not the lengths and directions of its kind.
    """
    remedy = f"a {kind} is {FORMS[kind]} in mm"
    file = json_files.validated(source, FILES[kind], kind, VERSION, remedy, by_hand=True)
    return file.surface(source)

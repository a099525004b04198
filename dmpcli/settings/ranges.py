"""Ranges that several settings have."""

from typing import Annotated, Any

from annotated_types import Ge, Le


class Ordered:
    """Of a box: that its minima lie below its maxima; pydantic asks by this method."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Check the box after its numbers."""
        from pydantic_core import core_schema

        return core_schema.no_info_after_validator_function(_ordered, handler(source))


# Wide enough for any arm, and no product of two of them overflows.
Coordinate = Annotated[float, Ge(-1e6), Le(1e6)]
Three = tuple[Coordinate, Coordinate, Coordinate]
Box = Annotated[
    tuple[Coordinate, Coordinate, Coordinate, Coordinate, Coordinate, Coordinate], Ordered()
]
"""Smallest and largest x, y and z, mm."""

WIDEST = (-1e6, 1e6) * 3
"""A box that no arm leaves."""

XYZ = "X Y Z"
CORNERS = "XMIN XMAX YMIN YMAX ZMIN ZMAX"


def _ordered(box: tuple[float, ...]) -> tuple[float, ...]:
    if not all(low < high for low, high in zip(box[::2], box[1::2], strict=True)):
        raise ValueError("each minimum of the workspace must lie below its maximum")
    return box

"""The tool file: where TCP and sensor sit on the flange, and the payload on the sensor; JSON."""

import json
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from dmpcli.primitives.wrench import Tool
from dmpcli.records import documents
from dmpcli.records.documents import Part
from dmpcli.records.schemas import EULER
from dmpcli.records.streams import Source
from dmpcli.rotations import from_euler, to_euler

SCHEMA = "tool"
VERSION = 1

Three = Annotated[list[float], Field(min_length=3, max_length=3)]


class Transform(Part):
    """A frame on the flange."""

    position: Annotated[Three, Field(description="in flange axes, mm")]
    rotation: Annotated[Three, Field(description=f"Euler angles, {EULER}, rad")] = Field(
        default_factory=lambda: [0.0] * 3
    )


class Zero(Part):
    """What the sensor reads with nothing on it."""

    force: Annotated[Three, Field(description="N")]
    torque: Annotated[Three, Field(description="N·m")]


class Payload(Part):
    """What hangs on the sensor."""

    weight: Annotated[float, Field(ge=0, description="N")]
    centre_of_mass: Annotated[Three, Field(description="from the sensor's origin, its axes, mm")]
    inclination: Annotated[
        list[float],
        Field(min_length=2, max_length=2, description="U, V of the robot's base, rad"),
    ] = Field(default_factory=lambda: [0.0] * 2)
    zero: Annotated[Zero | None, Field(description="null: taken at rest before each recording")] = (
        None
    )


class ToolFile(Part):
    """A tool on the robot's flange."""

    schema_name: Annotated[Literal["tool"], Field(alias="schema")] = "tool"
    version: Annotated[int, Field(ge=1)] = VERSION
    flange_to_tcp: Transform
    flange_to_sensor: Transform
    payload: Payload


def encode(tool: Tool) -> bytes:
    """Return a tool as the bytes of its JSON file; floats round-trip exactly."""
    zero = tool.zero
    document = ToolFile(
        flange_to_tcp=Transform(
            position=tool.tcp_position.tolist(), rotation=to_euler(tool.tcp_rotation).tolist()
        ),
        flange_to_sensor=Transform(
            position=tool.sensor_position.tolist(), rotation=to_euler(tool.sensor_rotation).tolist()
        ),
        payload=Payload(
            weight=tool.weight,
            centre_of_mass=tool.centre.tolist(),
            inclination=tool.inclination.tolist(),
            zero=None if zero is None else Zero(force=zero[:3].tolist(), torque=zero[3:].tolist()),
        ),
    )
    plain = document.model_dump(mode="json", by_alias=True)
    return (json.dumps(plain, indent=2, allow_nan=False) + "\n").encode()


def decode(source: Source) -> Tool:
    """Read a tool file.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or a field that is missing or wrong; by name.
    """
    file = documents.validated(source, ToolFile, SCHEMA, VERSION, "mend the file")
    zero = file.payload.zero
    return Tool(
        tcp_position=np.array(file.flange_to_tcp.position),
        tcp_rotation=from_euler(np.array(file.flange_to_tcp.rotation)),
        sensor_position=np.array(file.flange_to_sensor.position),
        sensor_rotation=from_euler(np.array(file.flange_to_sensor.rotation)),
        weight=file.payload.weight,
        centre=np.array(file.payload.centre_of_mass),
        inclination=np.array(file.payload.inclination),
        zero=None if zero is None else np.array([*zero.force, *zero.torque]),
    )


def schema() -> dict[str, Any]:
    """Return the JSON Schema of tool files."""
    return documents.json_schema(ToolFile, SCHEMA)

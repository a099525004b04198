"""The tool file: where TCP and sensor sit on the flange, and the payload on the sensor; JSON.

``dmpcli calibrate`` writes it whole. Written by hand it may lack the payload: then it is the
geometry that ``calibrate --tool`` reads.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from dmpcli.admittance.payload_identification import Identification
from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.records import json_files
from dmpcli.records.file_io import Source
from dmpcli.records.json_files import JsonPart
from dmpcli.records.schemas import EULER
from dmpcli.records.untrusted import decoder
from dmpcli.spatial.rotations import from_euler, to_euler
from dmpcli.spatial.wrench import Tool
from dmpcli.version import __version__

SCHEMA = "tool"
VERSION = 2
"""2 says how a payload was identified, and lets a file lack one."""

_TRANSFORMS = ("flange_to_tcp", "flange_to_sensor")

Three = Annotated[list[float], Field(min_length=3, max_length=3)]
Two = Annotated[list[float], Field(min_length=2, max_length=2)]
NotNegative = Annotated[float, Field(ge=0)]


class Transform(JsonPart):
    """A frame on the flange."""

    position: Annotated[Three, Field(description="in flange axes, mm")]
    rotation: Annotated[Three, Field(description=f"Euler angles, {EULER}, rad")] = Field(
        default_factory=lambda: [0.0] * 3
    )


class Zero(JsonPart):
    """What the sensor reads with nothing on it."""

    force: Annotated[Three, Field(description="N")]
    torque: Annotated[Three, Field(description="N·m")]


class Payload(JsonPart):
    """What hangs on the sensor."""

    weight: Annotated[NotNegative, Field(description="N")]
    centre_of_mass: Annotated[Three, Field(description="from the sensor's origin, its axes, mm")]
    inclination: Annotated[Two, Field(description="U, V of the robot's base, rad")] = Field(
        default_factory=lambda: [0.0] * 2
    )
    zero: Annotated[Zero | None, Field(description="null: taken at rest before each recording")] = (
        None
    )


class SensorIdentity(JsonPart):
    """The sensor that the zero belongs to."""

    make: str
    product: str = ""
    serial: str = ""

    def __str__(self) -> str:
        return " ".join(part for part in (self.make, self.product, self.serial) if part)


class StandardErrors(JsonPart):
    """Standard deviations of what was identified."""

    weight: Annotated[NotNegative, Field(description="N")]
    centre_of_mass: Annotated[Three, Field(description="mm")]
    inclination: Annotated[Two, Field(description="rad")]
    zero: Zero


class Residuals(JsonPart):
    """What the payload leaves of the poses' readings."""

    force: Annotated[NotNegative, Field(description="RMS, N")]
    torque: Annotated[NotNegative, Field(description="RMS, N·m")]
    largest_force: Annotated[NotNegative, Field(description="N")]
    largest_torque: Annotated[NotNegative, Field(description="N·m")]


class Conditioning(JsonPart):
    """Condition numbers of the two least-squares systems, see docs/calibration.md."""

    force: Annotated[float, Field(ge=1)]
    torque: Annotated[float, Field(ge=1)]


class Calibration(JsonPart):
    """How the payload was identified."""

    tool: str = __version__
    poses: Annotated[int, Field(ge=3, description="that were used")]
    rejected: Annotated[list[int], Field(description="numbers of the poses left out, from 1")]
    residuals: Residuals
    conditioning: Conditioning
    standard_errors: StandardErrors
    drift: Annotated[
        Zero | None, Field(description="of the zero meanwhile, per second; null: not looked for")
    ] = None
    sensor: SensorIdentity | None = None
    options: dict[str, Any] = Field(default_factory=dict)
    inputs: list[dict[str, str]] = Field(default_factory=list)


class ToolFile(JsonPart):
    """A tool on the robot's flange."""

    schema_name: Annotated[Literal["tool"], Field(alias="schema")] = "tool"
    version: Annotated[int, Field(ge=1)] = VERSION
    flange_to_tcp: Transform
    flange_to_sensor: Transform
    payload: Annotated[
        Payload | None, Field(description="null: not known yet; dmpcli calibrate finds it")
    ] = None
    calibration: Annotated[
        Calibration | None, Field(description="null: the payload was written by hand")
    ] = None


def encode(tool: Tool, calibration: Calibration | None = None) -> bytes:
    """Return a tool as the bytes of its JSON file; floats round-trip exactly.

    Parameters
    ----------
    tool : Tool
    calibration : Calibration, optional
        How its payload was identified.
    """
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
            zero=None if zero is None else _zero(zero),
        ),
        calibration=calibration,
    )
    plain = document.model_dump(mode="json", by_alias=True)
    return (json.dumps(plain, indent=2, allow_nan=False, ensure_ascii=False) + "\n").encode()


@decoder
def decode(source: Source) -> Tool:
    """Read a tool file with its payload.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or a field that is missing or wrong; by name.
    """
    file = _read(source)
    if file.payload is None:
        raise InputError(
            f"{source.name}: payload: is missing; dmpcli calibrate --tool {source.name} finds it"
        )
    payload, zero = file.payload, file.payload.zero
    sensor = file.calibration.sensor if file.calibration else None
    return replace(
        _geometry(file),
        weight=payload.weight,
        centre=np.array(payload.centre_of_mass),
        inclination=np.array(payload.inclination),
        zero=None if zero is None else np.array([*zero.force, *zero.torque]),
        sensor=str(sensor or ""),
    )


@decoder
def geometry(source: Source) -> Tool:
    """Read where TCP and sensor sit on the flange; a payload, if there is one, is left out.

    Raises
    ------
    InputError
        As in `decode`, but for a missing payload.
    """
    return _geometry(_read(source))


def calibrated(
    found: Identification,
    sensor: SensorIdentity | None,
    options: dict[str, Any],
    inputs: list[dict[str, str]],
) -> Calibration:
    """Return how a payload was identified, as the tool file keeps it.

    Parameters
    ----------
    found : Identification
    sensor : SensorIdentity or None
        None where it is not known.
    options : dict
        That change the result.
    inputs : list of dict
        Role and SHA-256 of each input.
    """
    error = found.error
    return Calibration(
        poses=int(found.used.sum()),
        rejected=[int(pose) + 1 for pose in np.flatnonzero(~found.used)],
        residuals=Residuals(
            force=float(found.rms[0]),
            torque=float(found.rms[1]),
            largest_force=float(found.largest[0]),
            largest_torque=float(found.largest[1]),
        ),
        conditioning=Conditioning(
            force=float(found.condition[0]), torque=float(found.condition[1])
        ),
        standard_errors=StandardErrors(
            weight=error.weight,
            centre_of_mass=error.centre.tolist(),
            inclination=error.inclination.tolist(),
            zero=_zero(error.zero),
        ),
        drift=None if found.drift is None else _zero(found.drift),
        sensor=sensor,
        options=options,
        inputs=inputs,
    )


def transforms(tool: Tool) -> dict[str, Any]:
    """Return where TCP and sensor sit, for the facts of another file; `restored` reads it."""
    document: dict[str, Any] = json.loads(encode(tool))
    return {key: document[key] for key in _TRANSFORMS}


def restored(facts: Mapping[str, Any], name: str) -> tuple[Tool, SensorIdentity | None]:
    """Return the geometry and the sensor that the facts of a file of poses state.

    Parameters
    ----------
    facts : mapping
        ``geometry`` as of `transforms`, and ``sensor``.
    name : str
        What messages call the file.

    Raises
    ------
    InputError
        They state no geometry, or what is none.
    """
    said = facts.get("geometry")
    if not isinstance(said, dict):
        raise InputError(f"{name}: does not say where the sensor sits on the flange: --tool FILE")
    document = {"schema": SCHEMA} | {key: said.get(key) for key in _TRANSFORMS}
    return geometry(Source(name, json.dumps(document).encode())), sensor_of(facts, name)


def sensor_of(facts: Mapping[str, Any], name: str) -> SensorIdentity | None:
    """Return the sensor that the facts of a file of poses state; None where they state none.

    Raises
    ------
    InputError
        What they state is none.
    """
    if facts.get("sensor") is None:
        return None
    try:
        return SensorIdentity.model_validate(facts["sensor"])
    except ValidationError:
        raise InputError(f"{name}: its metadata are damaged: sensor; measure again") from None


def _zero(six: Floats) -> Zero:
    return Zero(force=six[:3].tolist(), torque=six[3:].tolist())


def _read(source: Source) -> ToolFile:
    return json_files.validated(source, ToolFile, SCHEMA, VERSION, "mend the file")


def _geometry(file: ToolFile) -> Tool:
    return Tool(
        tcp_position=np.array(file.flange_to_tcp.position),
        tcp_rotation=from_euler(np.array(file.flange_to_tcp.rotation)),
        sensor_position=np.array(file.flange_to_sensor.position),
        sensor_rotation=from_euler(np.array(file.flange_to_sensor.rotation)),
        weight=0.0,
        centre=np.zeros(3),
    )

"""The pose file: where a part lies in the robot's base frame, as JSON; and six words for one."""

import json
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from dmpcli.errors import InputError
from dmpcli.records import file_io, json_files
from dmpcli.records.file_io import Source
from dmpcli.records.json_files import JsonPart
from dmpcli.records.schemas import EULER, FRAME
from dmpcli.records.untrusted import decoder
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from dmpcli.version import __version__

SCHEMA = "pose"
VERSION = 1

Three = Annotated[list[float], Field(min_length=3, max_length=3)]
Distance = Annotated[float, Field(ge=0)]


class Residuals(JsonPart):
    """Distances that the fit leaves, mm."""

    points: Annotated[int, Field(ge=0)]
    rms: Distance
    largest: Distance


class Conditioning(JsonPart):
    """How well the touched points hold the part, see docs/registration.md."""

    number: Annotated[float, Field(ge=1, description="largest gain over smallest")]
    gain: Annotated[
        float, Field(ge=0, description="residual RMS per unit of the least certain motion")
    ]
    weakest: Annotated[str, Field(description="the least certain motion, in the base frame")]
    uncertainty: Annotated[
        Distance,
        Field(description="bound on the displacement at any point of the part, with 95 %, mm"),
    ]


class RunnerUp(JsonPart):
    """The pose that fits best but one, among those that differ from it."""

    position: Annotated[Three, Field(description="as the pose's own, mm")]
    rotation: Annotated[Three, Field(description="as the pose's own, rad")]
    rms: Annotated[Distance, Field(description="of the distances that it leaves, mm")]
    apart: Annotated[
        Distance, Field(description="largest distance between the two at any point of the part, mm")
    ]


class PoseFile(JsonPart):
    """Where a part lies in the robot's base frame."""

    schema_name: Annotated[Literal["pose"], Field(alias="schema")] = "pose"
    version: Annotated[int, Field(ge=1)] = VERSION
    tool: str = __version__
    frame_convention: str = FRAME
    euler_convention: str = EULER
    position: Annotated[Three, Field(description="the part's origin in base axes, mm")]
    rotation: Annotated[Three, Field(description=f"Euler angles, {EULER}, rad")]
    residuals: Residuals | None = None
    conditioning: Conditioning | None = None
    unit: Annotated[
        str | None,
        Field(pattern="^(mm|cm|m|in)$", description="of the part's file; the pose is in mm"),
    ] = None
    runner_up: RunnerUp | None = None
    options: dict[str, Any] = Field(default_factory=dict)
    inputs: list[dict[str, str]] = Field(default_factory=list)


def encode(
    pose: Pose,
    residuals: Residuals | None = None,
    conditioning: Conditioning | None = None,
    options: dict[str, Any] | None = None,
    inputs: list[dict[str, str]] | None = None,
    unit: str | None = None,
    runner_up: RunnerUp | None = None,
) -> bytes:
    """Return a pose as the bytes of its JSON file.

    Parameters
    ----------
    pose : Pose
        Of the part's frame in the base frame, mm; its rotation is written as X-Y-Z Euler angles.
    residuals : Residuals, optional
        Of touched points, mm, where the pose comes of a registration; so do the other parts.
    conditioning : Conditioning, optional
    options : dict, optional
        Those of the command that change the result; JSON values.
    inputs : list of dict, optional
        ``{"role": ..., "sha256": ...}`` of each input file.
    unit : {'mm', 'cm', 'm', 'in'}, optional
        Of the part's own file, so that it is read alike elsewhere.
    runner_up : RunnerUp, optional
        The pose that fits next best.
    """
    document = PoseFile(
        position=pose.position.tolist(),
        rotation=rotations.to_euler(pose.rotation).tolist(),
        residuals=residuals,
        conditioning=conditioning,
        unit=unit,
        runner_up=runner_up,
        options=options or {},
        inputs=inputs or [],
    )
    plain = document.model_dump(mode="json", by_alias=True)
    return (json.dumps(plain, indent=2, allow_nan=False, ensure_ascii=False) + "\n").encode()


@decoder
def decode(source: Source) -> tuple[Pose, PoseFile]:
    """Read a pose file.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or a field that is missing or wrong; by name.
    """
    remedy = 'a pose is {"position": [x, y, z], "rotation": [rx, ry, rz]} in mm and rad'
    file = json_files.validated(source, PoseFile, SCHEMA, VERSION, remedy, by_hand=True)
    return Pose.of(np.array([*file.position, *file.rotation])), file


def parse(value: str, option: str) -> tuple[Pose, Source | None]:
    """Read a pose from an option's value.

    Parameters
    ----------
    value : str
        ``X Y Z RX RY RZ`` in mm and rad, or the path of a pose file; - is standard input.
    option : str
        What messages call it.

    Returns
    -------
    pose : Pose
    source : Source or None
        Of the pose file, where it came from one.

    Raises
    ------
    InputError
        Neither six finite numbers nor a pose file.
    """
    words = value.split()
    numbers = [_number(word) for word in words]
    if not words or numbers[0] is None:
        source = file_io.read(value)
        return decode(source)[0], source
    if len(words) != 6 or None in numbers:
        raise InputError(
            f"{option} {value}: a pose is six numbers, X Y Z in mm and RX RY RZ in rad, or a file"
        )
    six = np.array(numbers, dtype=float)
    if not np.isfinite(six).all():
        raise InputError(f"{option} {value}: a pose needs finite numbers")
    return Pose.of(six), None


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None

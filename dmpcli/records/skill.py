"""The skill file: one JSON document, human-readable, diff-able, exact.

Its JSON Schema is published in the package, ``json_schemas/skill.schema.json``.
"""

import json
from dataclasses import asdict
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from dmpcli.arrays import Floats
from dmpcli.dmp import skill as skills
from dmpcli.dmp.canonical_system import Basis
from dmpcli.dmp.force_profile import ForceProfile
from dmpcli.dmp.skill import Skill, TaskFrame, TaughtSurface
from dmpcli.dmp.transformation_system import TransformationGains
from dmpcli.records import json_files
from dmpcli.records.file_io import Source
from dmpcli.records.json_files import JsonPart
from dmpcli.records.record import Provenance
from dmpcli.records.schemas import EULER, FRAME
from dmpcli.records.untrusted import decoder
from dmpcli.spatial import rotations

SCHEMA: Literal["skill"] = "skill"
VERSION = 3
# Of skills without a force profile.
_PLAIN = 2

Six = Annotated[list[float], Field(min_length=6, max_length=6)]
Three = Annotated[list[float], Field(min_length=3, max_length=3)]
Positive = Annotated[float, Field(gt=0)]
Weights = Annotated[list[float], Field(min_length=1)]


class Frame(JsonPart):
    """Where and how the stroke was demonstrated, in the base frame."""

    start: Annotated[Three, Field(description="mm")]
    goal: Annotated[Three, Field(description="mm")]
    length: Annotated[float, Field(ge=0, description="distance from start to goal, mm")]
    axes: Annotated[
        list[Three],
        Field(min_length=3, max_length=3, description="rows of C_d; its columns are e_u, e_v, n"),
    ]
    rotation: Annotated[
        Three | None, Field(description="R(0) as X-Y-Z Euler angles, rad; null when unknown")
    ]


class Reproduction(JsonPart):
    """How well the skill gives back one demonstration, in mm."""

    sha256: str
    duration: Annotated[Positive, Field(description="after trimming, s")]
    rms: Annotated[float, Field(ge=0, description="deviation at equal times")]
    largest: Annotated[float, Field(ge=0)]
    end: Annotated[float, Field(ge=0, description="deviation at the last sample")]
    smoothing: Annotated[float, Field(ge=0, description="RMS of what smoothing took off")]
    wave: Annotated[
        tuple[float, float] | None, Field(description="wave height demonstrated and reproduced")
    ] = None
    angle: Annotated[float, Field(ge=0, description="largest of the orientation, rad")] = 0.0
    noise: Annotated[float, Field(ge=0, description="standard deviation of the recording's")] = 0.0
    cutoff: Annotated[
        float | None, Field(gt=0, description="of the smoothing, Hz; null where there was none")
    ] = None


class Surface(JsonPart):
    """The surface that the skill was taught on; its chart is the skill's."""

    kind: Literal["plane", "cylinder", "sphere", "mesh"]
    facts: Annotated[dict[str, Any], Field(description="its file's SHA-256, unit and pose")]


class Reached(JsonPart):
    """How well the skill gives back what it was learned from, beyond the noise, in mm."""

    tolerance: Annotated[Positive, Field(description="of RMS and wave; four times it anywhere")]
    rms: Annotated[float, Field(ge=0)]
    largest: Annotated[float, Field(ge=0)]
    noise: Annotated[float, Field(ge=0)]
    within: Annotated[bool, Field(description="false marks the skill: later commands repeat it")]


class Spread(JsonPart):
    """Scatter of several demonstrations about their mean."""

    share: Annotated[Weights, Field(description="of the duration")]
    deviation: Annotated[
        list[Six], Field(description="standard deviation of u v w, mm, and of the angles, rad")
    ]


class Force(JsonPart):
    """The force along the normal, N: a seventh primitive on the same phase and basis."""

    weights: Weights
    alpha_f: float
    start: Annotated[float, Field(description="x0, N")]
    goal: Annotated[float, Field(description="g, N")]
    initial_velocity: Annotated[float, Field(description="V0 = tau dF/dt(0), N")]
    rms: Annotated[float, Field(ge=0, description="deviation at equal times, N")]
    largest: Annotated[float, Field(ge=0)]


class SkillFile(JsonPart):
    """A dynamic movement primitive of six coordinates, learned by dmpcli fit."""

    schema_name: Annotated[Literal["skill"], Field(alias="schema")] = SCHEMA
    version: Annotated[int, Field(ge=1, strict=True)]
    tool: str
    frame_convention: str = FRAME
    euler_convention: str = EULER
    model: Literal["modified", "original"]
    forcing_scale: Literal["axis", "distance"] | None
    closed: bool
    duration: Annotated[Positive, Field(description="T_d, s")]
    tau: Annotated[Positive, Field(description="s")]
    alpha_1: Positive
    k: Annotated[Six, Field(description="spring constants")]
    d: Annotated[Six, Field(description="damping")]
    alpha_f: Six
    alpha_e: Six
    start: Annotated[Six, Field(description="x0 in the skill's coordinates, mm and rad")]
    goal: Annotated[Six, Field(description="g in the skill's coordinates, mm and rad")]
    initial_velocity: Annotated[Six, Field(description="V0 = tau dx/dt(0), mm and rad")]
    forcing_factor: Annotated[Six, Field(description="factor beside s in eq. (7)")]
    exempt: Annotated[list[bool], Field(min_length=6, max_length=6)]
    task_frame: Frame
    basis: Annotated[int, Field(ge=1, description="N")]
    centres: Weights
    widths: Weights
    weights: Annotated[list[Weights], Field(min_length=6, max_length=6, description="6 x N")]
    learning: Annotated[Literal["tolerance", "paper"], Field(description="how it was learned")] = (
        "paper"
    )
    passes: Annotated[int, Field(ge=1, description="of LWR")] = 1
    surface: Surface | None = None
    heights: Annotated[
        tuple[float, float], Field(description="least and largest w demonstrated, mm")
    ] = (0.0, 0.0)
    side_guessed: Annotated[
        bool, Field(description="nothing told the plane's side; a surface named later does")
    ] = False
    reached: Reached | None = None
    spread: Spread | None = None
    force_profile: Annotated[Force | None, Field(description="since version 3")] = None
    reproduction: Annotated[list[Reproduction], Field(min_length=1)]
    options: dict[str, Any]
    inputs: list[dict[str, str]]

    @model_validator(mode="after")
    def _consistent(self) -> "SkillFile":
        lengths = {len(self.centres), len(self.widths), *(len(row) for row in self.weights)}
        if lengths != {self.basis}:
            raise ValueError(f"centres, widths and weights must each have basis = {self.basis}")
        if self.force_profile is not None and len(self.force_profile.weights) != self.basis:
            raise ValueError(f"force_profile.weights must have basis = {self.basis}")
        if self.force_profile is not None and self.model != "modified":
            raise ValueError("force_profile belongs to the modified model")
        if min(self.k) <= 0 or min(self.d) <= 0 or min(self.widths) <= 0:
            raise ValueError("k, d and widths must be positive")
        C = np.array(self.task_frame.axes)
        if np.abs(C.T @ C - np.eye(3)).max() > 1e-6 or np.linalg.det(C) < 0:
            raise ValueError("task_frame.axes is not a right-handed rotation")
        if 0.0 in self.forcing_factor:
            raise ValueError("forcing_factor must not hold 0")
        if (self.model == "original") != (self.forcing_scale is not None):
            raise ValueError("forcing_scale belongs to the original model, and to it alone")
        frame = self.task_frame
        gap = np.linalg.norm(np.array(frame.goal) - np.array(frame.start))
        if abs(gap - frame.length) > 1e-6 * (1.0 + frame.length):
            raise ValueError("task_frame.length is not the distance from start to goal")
        return self


def encode(skill: Skill, reproduction: list[Reproduction], provenance: Provenance) -> bytes:
    """Return a skill as the bytes of its JSON file; floats round-trip exactly.

    Parameters
    ----------
    skill : Skill
        In its own coordinates; of its task frame, in the base frame, the rotation becomes Euler
        angles.
    reproduction : list of Reproduction
        How well it draws each of its demonstrations again.
    provenance : Provenance
        Of which the program's version, options and inputs are written.

    Returns
    -------
    bytes
        Of version 3 where there is a force profile, else of version 2.
    """
    frame = skill.frame
    rotation = None if frame.rotation is None else rotations.to_euler(frame.rotation).tolist()
    force = skill.force
    document = SkillFile(
        schema_name=SCHEMA,
        version=_PLAIN if force is None else VERSION,
        tool=provenance.tool,
        model=skill.model,
        forcing_scale=skill.forcing_scale,
        closed=skill.closed,
        duration=skill.duration,
        tau=skill.spring.tau,
        alpha_1=skill.alpha_1,
        k=skill.spring.k.tolist(),
        d=skill.spring.d.tolist(),
        alpha_f=skill.alpha_f.tolist(),
        alpha_e=skill.alpha_e.tolist(),
        start=skill.start.tolist(),
        goal=skill.goal.tolist(),
        initial_velocity=skill.initial_velocity.tolist(),
        forcing_factor=skill.forcing_factor.tolist(),
        exempt=skill.exempt.tolist(),
        task_frame=Frame(
            start=frame.start.tolist(),
            goal=frame.goal.tolist(),
            length=frame.length,
            axes=frame.axes.tolist(),
            rotation=rotation,
        ),
        basis=len(skill.basis),
        centres=skill.basis.centres.tolist(),
        widths=skill.basis.widths.tolist(),
        weights=skill.weights.tolist(),
        learning=skill.learning,
        passes=skill.passes,
        surface=None
        if skill.surface is None
        else Surface(kind=skill.surface.kind, facts=dict(skill.surface.facts)),
        heights=skill.heights,
        side_guessed=skill.side_guessed,
        reached=None if skill.reached is None else Reached(**asdict(skill.reached)),
        spread=None
        if skill.spread is None
        else Spread(share=skill.spread.share.tolist(), deviation=skill.spread.deviation.tolist()),
        force_profile=None
        if force is None
        else Force(**asdict(force) | {"weights": force.weights.tolist()}),
        reproduction=reproduction,
        options=provenance.options,
        inputs=list(provenance.inputs),
    )
    unsaid = {"force_profile"} if force is None else None
    content = document.model_dump(mode="json", by_alias=True, exclude=unsaid)
    return (_layout(content) + "\n").encode()


@decoder
def decode(source: Source) -> tuple[Skill, SkillFile]:
    """Read a skill file.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or a field that is missing or wrong; by name.
    """
    file = json_files.validated(source, SkillFile, SCHEMA, VERSION, "fit the skill again")
    return _skill(file), file


def _skill(file: SkillFile) -> Skill:
    def array(values: Any) -> Floats:
        return np.array(values, dtype=float)

    frame = file.task_frame
    return Skill(
        model=file.model,
        forcing_scale=file.forcing_scale,
        spring=TransformationGains(array(file.k), array(file.d), file.tau),
        alpha_1=file.alpha_1,
        basis=Basis(array(file.centres), array(file.widths)),
        weights=array(file.weights),
        forcing_factor=array(file.forcing_factor),
        exempt=np.array(file.exempt, dtype=bool),
        alpha_f=array(file.alpha_f),
        alpha_e=array(file.alpha_e),
        start=array(file.start),
        goal=array(file.goal),
        initial_velocity=array(file.initial_velocity),
        duration=file.duration,
        closed=file.closed,
        frame=TaskFrame(
            array(frame.start),
            array(frame.goal),
            array(frame.axes),
            None if frame.rotation is None else rotations.from_euler(array(frame.rotation)),
        ),
        learning=file.learning,
        passes=file.passes,
        surface=None
        if file.surface is None
        else TaughtSurface(file.surface.kind, file.surface.facts),
        heights=file.heights,
        side_guessed=file.side_guessed,
        reached=None if file.reached is None else skills.Accuracy(**file.reached.model_dump()),
        spread=None
        if file.spread is None
        else skills.DemonstrationSpread(array(file.spread.share), array(file.spread.deviation)),
        force=None if file.force_profile is None else _force(file.force_profile),
    )


def _force(part: Force) -> ForceProfile:
    return ForceProfile(**part.model_dump() | {"weights": np.array(part.weights)})


def _layout(value: Any, indent: int = 0) -> str:
    """JSON with one line per list of numbers: a changed weight is a changed line, not a page."""
    if isinstance(value, dict) and value:
        inner = ",\n".join(
            f"{' ' * (indent + 2)}{json.dumps(key)}: {_layout(item, indent + 2)}"
            for key, item in value.items()
        )
        return "{\n" + inner + "\n" + " " * indent + "}"
    if isinstance(value, list) and value and isinstance(value[0], list | dict):
        inner = ",\n".join(" " * (indent + 2) + _layout(item, indent + 2) for item in value)
        return "[\n" + inner + "\n" + " " * indent + "]"
    return json.dumps(value, allow_nan=False, ensure_ascii=False)

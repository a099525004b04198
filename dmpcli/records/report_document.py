"""``report.json`` as others may read it: its fields, and the JSON Schema that is published of them.

`reporting.document` makes it; lengths in mm, times in s, angles in degrees, null where a figure
does not exist. docs/report.md says what each is.
"""

from typing import Annotated, Any, Literal

from pydantic import Field

from dmpcli.records.json_files import JsonPart

VERSION = 1

Point = Annotated[list[float], Field(min_length=3, max_length=3)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Length = Annotated[float, Field(ge=0.0)]
Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class Extremum(JsonPart):
    """A peak or a trough of a wave."""

    t: float
    v: Annotated[float, Field(description="across the start-goal line")]
    position: Point


class Wave(JsonPart):
    """Wave heights of a stroke."""

    mean: Length | None
    spread: Length | None
    heights: list[Length]
    extrema: list[Extremum]


class Deviation(JsonPart):
    """Distance from the demonstration, start and goal laid upon each other."""

    nearest_rms: Length
    nearest_max: Length
    phase_rms: Length
    phase_max: Length


class Stroke(JsonPart):
    """What was measured of one stroke."""

    stroke: str
    kind: Literal["demonstration", "trajectory", "run"]
    role: str
    simulated: bool
    closed: bool
    elsewhere: bool
    by_skill: bool
    samples: Annotated[int, Field(ge=1)]
    start: Point
    goal: Point
    duration: Length
    length: Length
    peak_speed: Length
    wave: Wave
    as_recorded: dict[str, float | None] | None
    deviation: Deviation | None
    guide: dict[str, float] | None
    ldlj: float | None
    sparc: float | None
    start_error: Length | None
    goal_error: Length | None
    end_heights: Annotated[list[float], Field(min_length=2, max_length=2)]
    surface: dict[str, Any] | None
    beyond_tolerance: dict[str, float] | None


class Distribution(JsonPart):
    """How a figure is distributed over strokes."""

    count: Annotated[int, Field(ge=1)]
    least: float
    median: float
    largest: float
    mean: float
    spread: float
    quantiles: dict[str, float]


class Histogram(JsonPart):
    """Strokes counted by a figure."""

    edges: list[float]
    counts: list[int]


class Worst(JsonPart):
    """A stroke of a batch, and the figure by which it is the worst."""

    id: str
    part: str
    value: float


class Failure(JsonPart):
    """Why pairs of a batch were not drawn."""

    reason: str
    count: Annotated[int, Field(ge=1)]
    first: str


class Deadlines(JsonPart):
    """Punctuality of a run, and how closely the arm followed."""

    period: float | None
    median: float
    p99: float
    worst: float
    missed: Annotated[int, Field(ge=0)]
    cycles: Annotated[int, Field(ge=1)]
    lookahead: float
    tracking_rms: Length
    tracking_max: Length


class Contact(JsonPart):
    """Force along the normal while a run drew, N."""

    least: float
    mean: float
    largest: float
    absent: Share
    threshold: float
    unknown: Annotated[Share, Field(description="of what was drawn, without a known force")] = 0.0


class Summary(JsonPart):
    """Statistics of errors."""

    rmse: Length
    mean: Length
    median: Length
    std: Length
    min: Length
    max: Length
    sse: Length


class Errors(JsonPart):
    """Errors of position, mm, and of rotation, degrees."""

    position: Summary
    rotation: Summary | None


class Aligned(JsonPart):
    """APE after the motion that brings all poses nearest, and that motion."""

    ape: Errors
    rotation: Annotated[list[float], Field(min_length=4, max_length=4, description="x y z w")]
    position: Point
    scale: Annotated[float | None, Field(description="of the similarity, which was not applied")]


class PoseError(JsonPart):
    """Pose by pose with another trajectory."""

    stroke: str
    against: str
    pairs: Annotated[int, Field(ge=2)]
    of: Annotated[int, Field(ge=2)]
    largest_gap: float
    length: Length
    reference_length: Length
    ape: Errors
    rpe: Errors
    aligned: Aligned | None


class Origin(JsonPart):
    """Where one of our own files comes from."""

    tool: str
    command: str
    options: dict[str, Any]
    inputs: list[dict[str, str]]


class ReportedFile(JsonPart):
    """One input of the report."""

    file: str
    sha256: Sha256
    schema_name: Annotated[str, Field(alias="schema")]
    count: Annotated[int, Field(ge=0)]
    strokes: list[Stroke]
    statistics: dict[str, Distribution | None] | None
    histograms: dict[str, Histogram | None] | None
    worst: dict[str, list[Worst]] | None
    states: dict[str, int] | None
    failures: list[Failure] | None
    beyond_tolerance: dict[str, float] | None
    deadlines: Deadlines | None
    contact: Contact | None
    skill: dict[str, Any] | None
    pose_error: PoseError | None
    provenance: Origin | None
    kernels: Annotated[
        Literal["compiled"] | None, Field(description="by what means a large batch was measured")
    ] = None


class PaperTable(JsonPart):
    """One of the paper's tables beside ours."""

    table: int
    title: str
    rows: list[dict[str, Any]]
    notes: list[str]


class Report(JsonPart):
    """What dmpcli report measured."""

    schema_name: Annotated[Literal["report"], Field(alias="schema")] = "report"
    version: Annotated[int, Field(ge=1)] = VERSION
    tool: str
    summary: Annotated[list[str], Field(description="the same in plain words")]
    units: dict[str, str]
    reference: str | None
    surface: dict[str, Any] | None
    files: list[ReportedFile]
    skills: list[dict[str, Any]]
    paper: list[PaperTable]

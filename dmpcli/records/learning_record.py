"""How a skill saw its recordings: what `report` needs to see them the same way.

A trajectory carries it in its facts, so that a recording beside it is cut, smoothed and laid into
its plane as it was for the skill, whether or not the skill's file is at hand.
"""

import json
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from dmpcli.dmp.options import FitOptions, Learning, Model
from dmpcli.errors import InputError
from dmpcli.records.skill import SkillFile

FACT = "taught"

Vector = tuple[float, float, float]


class Lesson(BaseModel):
    """The options of `fit` that decide what a recording is taken for.

    Attributes
    ----------
    learning : {'tolerance', 'paper'}
    basis : int or None
        N of the paper's learning, which smooths by it.
    cutoff, start, until : float or None
        Hz; s.
    trim, cut_pauses : bool
    normal : tuple of float, or None
        Of the skill's plane, on the tool's side; None where it was taught on a surface, and of the
        paper's learning.
    force_profile : bool
        Whether the force was learned, and the pen's spring taken off the heights.
    closed : bool or None
        Whether the skill's stroke is; None asks the recording.
    surface : str or None
        Facts of the surface that it was taught on, as `surface_key` writes them.
    recordings : tuple of str
        SHA-256 of each.
    """

    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False)

    learning: Learning = "tolerance"
    basis: int | None = None
    cutoff: float | None = None
    trim: bool = True
    start: float | None = None
    until: float | None = None
    cut_pauses: bool = False
    normal: Vector | None = None
    force_profile: bool = False
    closed: bool | None = None
    surface: str | None = None
    recordings: tuple[str, ...] = ()

    def choices(self, model: Model = "modified") -> FitOptions:
        """Return it as the mathematics takes it."""
        return FitOptions(
            model=model,
            learning=self.learning,
            basis=self.basis,
            cutoff=self.cutoff,
            trim=self.trim,
            start=self.start,
            until=self.until,
            cut_pauses=self.cut_pauses,
            normal=self.normal,
            force_profile=self.force_profile,
        )

    def of(self, sha256: str) -> "Lesson":
        """Return how it would see this recording: another one was not cut there, nor lay there."""
        if not self.recordings or sha256 in self.recordings:
            return self
        return Lesson(learning=self.learning, basis=self.basis)

    def facts(self) -> dict[str, Any]:
        """Return it as a fact of a trajectory: what is not as by default."""
        return {FACT: self.model_dump(mode="json", exclude_defaults=True)}


PAPER = Lesson(learning="paper")
"""How the original model sees recordings: as the paper has it."""


def surface_key(facts: Mapping[str, Any]) -> str:
    """Return a surface's facts as one text; equal for the same file, unit and pose."""
    return json.dumps(dict(facts), sort_keys=True)


def of_skill(file: SkillFile) -> Lesson:
    """Return how a skill saw its recordings.

    Raises
    ------
    InputError
        Its options are not those of `fit`.
    """
    surface = None if file.surface is None else surface_key(file.surface.facts)
    paper = file.learning == "paper"
    options = {
        name: file.options[name]
        for name in ("cutoff", "trim", "start", "until", "cut_pauses")
        if file.options.get(name) is not None
    }
    axes = file.task_frame.axes
    return _checked(
        options
        | {
            "learning": file.learning,
            "basis": file.basis if paper else None,
            "normal": None if paper or surface else tuple(row[2] for row in axes),
            "closed": None if paper else file.closed,
            "force_profile": file.force_profile is not None,
            "surface": surface,
            "recordings": tuple(said["sha256"] for said in file.inputs if _taught(said)),
        },
        "options",
    )


def of_facts(facts: Mapping[str, Any]) -> Lesson | None:
    """Return how the skill that drew a trajectory saw its recordings; None where it is not said.

    Raises
    ------
    InputError
        It is said wrongly.
    """
    if FACT in facts:
        return _checked(facts[FACT], f"fact {FACT!r}")
    return PAPER if facts.get("model") == "original" else None


def _taught(said: Mapping[str, str]) -> bool:
    return said.get("role") == "demonstration" and "sha256" in said


def _checked(said: Any, what: str) -> Lesson:
    try:
        return Lesson.model_validate(said)
    except ValidationError as error:
        detail = error.errors()[0]
        where = ".".join(map(str, detail["loc"])) or "document"
        raise InputError(f"{what}: {where}: {detail['msg']}; generalize or fit it again") from None

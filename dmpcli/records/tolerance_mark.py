"""The mark of a skill beyond its tolerance: every later command repeats it with these words."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dmpcli.errors import beside

if TYPE_CHECKING:
    from dmpcli.dmp.skill import Accuracy
    from dmpcli.records.skill import Reached, SkillFile

FACT = "beyond_tolerance"


def of_reached(reached: "Accuracy | Reached | None") -> dict[str, float] | None:
    """Return tolerance, rms and largest, mm, where a skill is beyond its tolerance."""
    if reached is None or reached.within:
        return None
    return {"tolerance": reached.tolerance, "rms": reached.rms, "largest": reached.largest}


def of_file(file: "SkillFile") -> dict[str, float] | None:
    """Return the mark of a skill file."""
    return of_reached(file.reached)


def of_facts(facts: Mapping[str, Any]) -> dict[str, float] | None:
    """Return the mark that a trajectory or run carries."""
    said = facts.get(FACT) or dict(facts.get("trajectory") or {}).get(FACT)
    return None if said is None else dict(said)


def text(name: str, mark: Mapping[str, float]) -> str:
    """Say it in one line, with the remedy."""
    largest, tolerance = mark["largest"], mark["tolerance"]
    return (
        f"{name}: the skill strays from what was demonstrated by RMS {mark['rms']:.3g} mm, largest "
        f"{beside(largest, tolerance, '.3g')} mm, beyond its tolerance of "
        f"{beside(tolerance, largest, '.3g')} mm; fit it "
        "again with --regression ridge, or a --tolerance that will do"
    )

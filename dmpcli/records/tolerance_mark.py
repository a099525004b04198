"""The mark of a skill beyond its tolerance: every later command repeats it with these words."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dmpcli.errors import beside

if TYPE_CHECKING:
    from dmpcli.dmp.skill import Accuracy
    from dmpcli.records.skill import Reached, SkillFile

FACT = "beyond_tolerance"

ANGLE = 0.1
"""Tolerance of the tool's turn, degrees."""


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
    return (
        f"{name}: {strays(mark, 'the wave height or the turn of the tool')}; fit it again with "
        "--regression ridge, or a --tolerance that will do"
    )


def strays(mark: Mapping[str, float], else_: str, also: str = "") -> str:
    """Say by how much a skill is beyond its tolerance.

    Parameters
    ----------
    mark : mapping
    else_ : str
        What is beyond it where the path is not.
    also : str, optional
        What is beyond it beside the path.
    """
    from dmpcli.dmp.options import LARGEST  # few skills are beyond: execute starts without

    rms, largest, tolerance = mark["rms"], mark["largest"], mark["tolerance"]
    anywhere = LARGEST * tolerance
    if rms <= tolerance and largest <= anywhere:
        return (
            f"the skill keeps the path, RMS {rms:.3g} mm, largest {largest:.3g} mm, but not "
            f"{else_} within its tolerance of {tolerance:.3g} mm and {ANGLE:g}°"
        )
    return (
        f"the skill strays from what was demonstrated by RMS {beside(rms, tolerance, '.3g')} mm, "
        f"largest {beside(largest, anywhere, '.3g')} mm{also}, beyond its tolerance of "
        f"{beside(tolerance, rms, '.3g')} mm, {beside(anywhere, largest, '.3g')} mm anywhere"
    )

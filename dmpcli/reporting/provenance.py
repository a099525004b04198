"""Where the files of a report come from: command, options and inputs of each, by SHA-256."""

from collections.abc import Mapping, Sequence
from typing import Any

from dmpcli.records.record import Provenance
from dmpcli.records.skill import SkillFile
from dmpcli.reporting.stroke_measures import Row


def row_of(origin: Provenance | None) -> Row | None:
    """Return what the document says of a file's origin; None of another program's file."""
    if origin is None or not origin.command:
        return None
    return {
        "tool": origin.tool,
        "command": origin.command,
        "options": origin.options,
        "inputs": [dict(entry) for entry in origin.inputs],
    }


def of_skill(file: SkillFile) -> Provenance:
    """Return a skill's origin."""
    return Provenance("fit", file.options, tuple(file.inputs), {}, file.tool)


def steps(report: Mapping[str, Any]) -> list[Row]:
    """Return the files from recording to run, each after what it was made from.

    Parameters
    ----------
    report : dict
        The document.

    Returns
    -------
    list of dict
        name, sha256, schema, origin, and for each input its role, sha256 and name where it is one
        of these files, else None.
    """
    names = {entry["sha256"]: entry["file"] for entry in report["files"]}
    if report["surface"]:
        names.setdefault(report["surface"]["sha256"], report["surface"]["file"])
    entries = sorted(report["files"], key=lambda entry: _RANK.get(entry["schema"], 0))
    return [_step(entry, names) for entry in entries]


_RANK = {"recording": 0, "demonstration": 0, "skill": 1, "trajectory": 2, "pairs": 2, "run": 3}


def _step(entry: Row, names: Mapping[str, str]) -> Row:
    origin = entry["provenance"]
    inputs: Sequence[Row] = origin["inputs"] if origin else ()
    return {
        "name": entry["file"],
        "sha256": entry["sha256"],
        "schema": entry["schema"],
        "origin": origin,
        "inputs": [
            {
                "role": given.get("role", "input"),
                "sha256": given.get("sha256", ""),
                "name": names.get(given.get("sha256", "")),
            }
            for given in inputs
        ],
    }

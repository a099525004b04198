"""Write the JSON Schemas of our JSON files into the package: ``make schemas``."""

import json
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from dmpcli.records import exact_surface, json_files
from dmpcli.records.manifest import Manifest
from dmpcli.records.pose import PoseFile
from dmpcli.records.report_document import Report
from dmpcli.records.skill import SkillFile
from dmpcli.records.tool import ToolFile

FILES: dict[str, type[BaseModel]] = {
    "skill": SkillFile,
    **exact_surface.FILES,
    "tool": ToolFile,
    "pose": PoseFile,
    "manifest": Manifest,
    "report": Report,
}
"""What each schema describes."""


def folder() -> Path:
    """Return where the published schemas lie."""
    return Path(str(resources.files("dmpcli.records") / "json_schemas"))


def schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema of one kind of file."""
    return json_files.json_schema(FILES[name], name)


def text(name: str) -> str:
    """Return one published schema as it shall stand in its file."""
    return json.dumps(schema(name), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    for schema_name in FILES:
        (folder() / f"{schema_name}.schema.json").write_text(text(schema_name), encoding="utf-8")

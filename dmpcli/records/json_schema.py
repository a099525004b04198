"""Write the JSON Schemas of our JSON files into the package: ``make schemas``."""

import json
from importlib import resources
from pathlib import Path

from dmpcli.records import cylinder, manifest, plane, pose, report_document, skill, sphere, tool

SCHEMAS = {
    "skill": skill.schema,
    "plane": plane.schema,
    "cylinder": cylinder.schema,
    "sphere": sphere.schema,
    "tool": tool.schema,
    "pose": pose.schema,
    "manifest": manifest.schema,
    "report": report_document.schema,
}


def folder() -> Path:
    """Return where the published schemas lie."""
    return Path(str(resources.files("dmpcli.records") / "json_schemas"))


def text(name: str) -> str:
    """Return one published schema as it shall stand in its file."""
    return json.dumps(SCHEMAS[name](), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    for schema_name in SCHEMAS:
        (folder() / f"{schema_name}.schema.json").write_text(text(schema_name), encoding="utf-8")

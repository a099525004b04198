"""JSON files of ours: read, checked against their model, refused by name; and their schemas."""

import json
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from dmpcli.errors import InputError
from dmpcli.records.file_io import Source
from dmpcli.records.untrusted import LARGEST_JSON, decoder, judge_size


class JsonPart(BaseModel):
    """Base of every model of a file: unknown fields, NaN and infinity are errors."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        validate_by_name=True,
        validate_by_alias=True,
    )


M = TypeVar("M", bound=BaseModel)


def json_document(source: Source) -> dict[str, Any]:
    """Return the object of a JSON source; InputError where it is not JSON or not an object."""
    judge_size(source.name, len(source.content), LARGEST_JSON, "a JSON file")
    try:
        document = json.loads(source.content)
    except (ValueError, RecursionError) as error:
        reason = str(error) if isinstance(error, json.JSONDecodeError) else "not text"
        raise InputError(f"{source.name}: is not JSON: {reason}") from None
    if not isinstance(document, dict):
        raise InputError(f"{source.name}: is JSON, but not an object")
    return document


@decoder
def validated(
    source: Source, model: type[M], name: str, version: int, remedy: str, by_hand: bool = False
) -> M:
    """Read a JSON file of one of our schemas.

    Parameters
    ----------
    source : Source
    model : type
        Its pydantic model.
    name : str
        Its schema's name.
    version : int
        The newest version that this program knows.
    remedy : str
        What to do about a field that is wrong.
    by_hand : bool
        People write this file: then schema and version may be left out.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or a field that is missing or wrong; by name.
    """
    document = json_document(source)
    said = document.get("schema", name if by_hand else None)
    if said != name:
        raise InputError(f"{source.name}: has schema {said!r}, a {name} file is needed")
    newer = document.get("version")
    if isinstance(newer, int) and newer > version:
        raise InputError(
            f"{source.name}: {name} version {newer} is newer than this program's ({version}); "
            "upgrade dmpcli"
        )
    try:
        return model.model_validate(document)
    except ValidationError as error:
        detail = error.errors()[0]
        where = ".".join(str(part) for part in detail["loc"]) or "document"
        raise InputError(f"{source.name}: {where}: {detail['msg']}; {remedy}") from None


def json_schema(model: type[BaseModel], name: str) -> dict[str, Any]:
    """Return the JSON Schema of a file, as it is published."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"dmpcli {name}",
    } | model.model_json_schema(by_alias=True)

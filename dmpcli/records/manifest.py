"""The manifest of a batch: written last, so that a folder with one is a finished batch."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Field

from dmpcli.records import json_files
from dmpcli.records.file_io import Source
from dmpcli.records.json_files import JsonPart
from dmpcli.records.record import Provenance
from dmpcli.records.untrusted import decoder

SCHEMA = "manifest"
VERSION = 1


class Entry(JsonPart):
    """One part of the batch."""

    file: str
    pairs: Annotated[int, Field(ge=1, description="of the table that were to be drawn")]
    rows: Annotated[int, Field(ge=1)]
    bytes: Annotated[int, Field(ge=1)]


class Input(JsonPart):
    """One input of the batch."""

    role: str
    sha256: str


class Manifest(JsonPart):
    """A finished batch."""

    schema_name: Annotated[Literal["manifest"], Field(alias="schema")] = "manifest"
    version: Annotated[int, Field(ge=1)] = VERSION
    tool: str
    options: dict[str, Any]
    inputs: list[Input]
    pairs: Annotated[int, Field(ge=1, description="rows of the table")]
    drawn: Annotated[int, Field(ge=0, description="pairs that have a trajectory")]
    parts: list[Entry]


def document(
    parts: Sequence[Entry], pairs: int, drawn: int, provenance: Provenance
) -> dict[str, Any]:
    """Return the manifest of a batch as it stands in its file.

    Parameters
    ----------
    parts : sequence of Entry
        In the order of the table.
    pairs : int
        Rows of the table.
    drawn : int
        Pairs that have a trajectory.
    provenance : Provenance
        Of which the program's version, options and inputs are written.

    Returns
    -------
    dict
        JSON values.
    """
    found = Manifest(
        tool=provenance.tool,
        options=provenance.options,
        inputs=[Input(**entry) for entry in provenance.inputs],
        pairs=pairs,
        drawn=drawn,
        parts=list(parts),
    )
    return found.model_dump(mode="json", by_alias=True)


@decoder
def decode(source: Source) -> Manifest:
    """Read a manifest.

    Raises
    ------
    InputError
        Not JSON, another schema, a newer version, or a field that is missing or wrong; by name.
    """
    return json_files.validated(source, Manifest, SCHEMA, VERSION, "draw the batch again")

"""How ``generalize`` draws a table of pairs: what only the command line says."""

import re
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from annotated_types import Ge, Le

from dmpcli.errors import InputError
from dmpcli.settings.model import Option, Settings

_MOST_SHARDS = 1_000_000


@dataclass(frozen=True, kw_only=True)
class BatchOptions(Settings):
    """The options that belong to ``--pairs``."""

    on_error: Annotated[
        Literal["stop", "skip"],
        Option("What a bad pair does: stop all before anything is written, or be skipped."),
    ] = "stop"
    jobs: Annotated[int, Ge(1), Le(1024), Option("Processes that draw a table of pairs.")] = 1
    cluster: Annotated[
        str | None,
        Option("Draw on a Dask cluster.", metavar="tcp://HOST:PORT", unset="this machine"),
    ] = None
    shard: Annotated[str, Option("Draw only every N-th part, from the I-th on.", metavar="I/N")] = (
        "1/1"
    )
    pairs_per_part: Annotated[
        int, Ge(1), Le(1_000_000), Option("Pairs in one file of the folder.")
    ] = 2000
    surfaces_per_part: Annotated[
        int, Ge(1), Le(10_000), Option("Surfaces in one file, where the table names them.")
    ] = 16
    surface_cache: Annotated[
        str | None,
        Option("Keep prepared meshes here for later runs.", metavar="DIR", unset="none"),
    ] = None
    float32: Annotated[bool, Option("Store poses in single precision.")] = False
    compression: Annotated[Literal["zstd", "lz4", "snappy", "none"], Option("Of the parts.")] = (
        "zstd"
    )

    @property
    def stop(self) -> bool:
        """Whether a bad pair ends the batch, else it is skipped."""
        return self.on_error == "stop"

    def __post_init__(self) -> None:
        """Refuse a share that there is not."""
        _share(self.shard)

    @property
    def share(self) -> tuple[int, int]:
        """Which share, from 1, of how many."""
        return _share(self.shard)

    def as_options(self, sites: bool = False) -> dict[str, Any]:
        """Return what changes the result; who draws, and in how many shares, does not.

        Parameters
        ----------
        sites : bool
            Whether the table names surfaces.
        """
        said = super().as_options()
        names = ["on_error", "pairs_per_part", "float32", "compression"]
        return {key: said[key] for key in [*names, *(["surfaces_per_part"] if sites else [])]}


def _share(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,7})/(\d{1,7})", text)
    index, count = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= index <= count <= _MOST_SHARDS:
        raise InputError(f"--shard {text}: must be I/N with I from 1 to N, as in 3/8")
    return index, count

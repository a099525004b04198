"""The options of ``generalize`` that belong to a table of pairs."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.workflows.batches import Wanted

_MOST_JOBS, _MOST_PER_PART, _MOST_SHARDS = 1024, 1_000_000, 1_000_000


def asked(
    pairs: Path | None,
    on_error: str | None,
    jobs: int | None,
    cluster: str | None,
    shard: str | None,
    pairs_per_part: int | None,
    float32: bool,
    compression: str | None,
) -> "Wanted":
    """Check the options that belong to ``--pairs``.

    Raises
    ------
    InputError
        One is given without ``--pairs``, or is out of its range.
    """
    from dmpcli.workflows.batches import PAIRS_PER_PART, Wanted

    given = {
        "--on-error": on_error,
        "--jobs": jobs,
        "--cluster": cluster,
        "--shard": shard,
        "--pairs-per-part": pairs_per_part,
        "--float32": float32 or None,
        "--compression": compression,
    }
    alone = next((name for name, value in given.items() if value is not None), None)
    if pairs is None and alone is not None:
        raise InputError(f"{alone}: belongs to --pairs; leave it out")
    if on_error not in (None, "stop", "skip"):
        raise InputError(f"--on-error {on_error}: must be stop or skip")
    if cluster is not None and jobs is not None:
        raise InputError("--jobs and --cluster: the cluster has its own workers; leave --jobs out")
    if cluster is not None and "://" not in cluster:
        raise InputError(f"--cluster {cluster}: must be an address, as in tcp://HOST:8786")
    if compression not in (None, "zstd", "lz4", "snappy", "none"):
        raise InputError(f"--compression {compression}: must be zstd, lz4, snappy or none")
    return Wanted(
        on_error != "skip",
        _counted("--jobs", jobs, 1, _MOST_JOBS),
        cluster,
        _share(shard),
        _counted("--pairs-per-part", pairs_per_part, PAIRS_PER_PART, _MOST_PER_PART),
        float32,
        compression or "zstd",
    )


def _counted(name: str, value: int | None, default: int, most: int) -> int:
    if value is None:
        return default
    if not 1 <= value <= most:
        raise InputError(f"{name} {value}: must be 1 to {most}")
    return value


def _share(text: str | None) -> tuple[int, int]:
    if text is None:
        return 1, 1
    found = re.fullmatch(r"(\d{1,7})/(\d{1,7})", text)
    index, count = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= index <= count <= _MOST_SHARDS:
        raise InputError(f"--shard {text}: must be I/N with I from 1 to N, as in 3/8")
    return index, count

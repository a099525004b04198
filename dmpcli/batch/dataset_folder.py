"""The folder of a batch: which parts are already there, what must go, and what comes last.

A folder with a manifest is a finished batch. Parts stay when a run is stopped, and the next run
with the same inputs and options goes on from them: each part's metadata say what it was made of.
"""

import contextlib
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from dmpcli.batch.part import FACT, Job, Outcome, file_of
from dmpcli.errors import InputError
from dmpcli.records import file_io, record, schemas
from dmpcli.records.record import Record

_TEMPORARY = f".{file_io.PART}.*.tmp"


class Folder:
    """Where the parts of one batch go.

    Parameters
    ----------
    job : Job
        Its folder need not exist yet.
    """

    def __init__(self, job: Job) -> None:
        self.path = Path(job.folder)
        columns = {schemas.EVENT: np.empty(0, dtype=object)} if job.task.events else {}
        empty = Record(schemas.TRAJECTORY, columns, job.provenance)
        self._expected = json.loads(record.header(empty))
        self._own = () if job.prepare is None else tuple(job.provenance.facts)

    def open(
        self, numbers: Iterable[int], whole: bool, hashes: Callable[[int], list[list[str | None]]]
    ) -> dict[int, Outcome]:
        """Make room for these parts, and return the outcomes of those that are already there.

        What a finished batch ends with goes first, so that nobody takes the folder for one.

        Parameters
        ----------
        numbers : iterable of int
            Of the parts.
        whole : bool
            Whether these are all parts of the batch: then other parts are stale, and go.
        hashes : callable
            Returns the hashes of the files that a part's own pairs lie on.

        Raises
        ------
        InputError
            The folder cannot be written.
        """
        try:
            self.path.mkdir(exist_ok=True)
            (self.path / file_io.MANIFEST).unlink(missing_ok=True)
            (self.path / file_io.TABLE).unlink(missing_ok=True)
            parts = {file_of(number): number for number in numbers}
            for stale in self.path.glob(_TEMPORARY):
                # Another machine may be writing a part of its own share.
                if whole or stale.name[1:].split(".parquet.")[0] + ".parquet" in parts:
                    stale.unlink(missing_ok=True)
            kept = {}
            for file, number in parts.items():
                outcome = self._outcome(file, number)
                if outcome is not None and outcome.sites != hashes(number):
                    outcome = None
                if outcome is None:
                    (self.path / file).unlink(missing_ok=True)
                else:
                    kept[number] = outcome
            if whole:
                for other in self.path.glob(file_io.PART):
                    if other.name not in parts:
                        other.unlink()
        except OSError as error:
            raise InputError(f"{self.path}: cannot be written: {error.strerror}") from None
        return kept

    def _outcome(self, name: str, number: int) -> Outcome | None:
        """Outcome of a part that is there, whole and of the same inputs; None otherwise."""
        file = self.path / name
        try:
            footer = pq.read_metadata(file)
            found = json.loads((footer.metadata or {})[record.KEY])
            fact = found["facts"].pop(FACT)
        except (pa.ArrowException, OSError, ValueError, KeyError, TypeError, AttributeError):
            return None
        if self._own:
            # What is so for these surfaces alone.
            found["facts"] = {k: v for k, v in found["facts"].items() if k in self._own}
        if found != self._expected or fact.get("number") != number:
            return None
        return Outcome(
            number,
            {int(row): why for row, why in fact["failed"].items()},
            {int(row): seconds for row, seconds in fact["clipped"].items()},
            fact["unfolded"],
            footer.num_rows,
            file.stat().st_size,
            pieces={int(row): ends for row, ends in fact.get("pieces", {}).items()},
            slow=fact.get("slow", 0),
            placed={int(row): place for row, place in fact.get("placed", {}).items()},
            sites=fact.get("sites", []),
        )

    def leave(self) -> None:
        """Leave no folder behind that nothing was drawn into."""
        with contextlib.suppress(OSError):
            self.path.rmdir()

    def finish(self, table: Record, manifest: dict[str, Any]) -> None:
        """Write the table of pairs and, last of all, the manifest.

        Raises
        ------
        InputError
            The folder cannot be written.
        """
        # There is none where no pair could be drawn: its table says why.
        with contextlib.suppress(OSError):
            self.path.mkdir(exist_ok=True)
        # A worker that died in the middle of a part has left its half.
        for stale in self.path.glob(_TEMPORARY):
            stale.unlink(missing_ok=True)
        file_io.write(self.path / file_io.TABLE, record.encode(table))
        text = json.dumps(manifest, indent=2, sort_keys=True, allow_nan=False) + "\n"
        file_io.write(self.path / file_io.MANIFEST, text.encode())

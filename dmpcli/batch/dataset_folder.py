"""The folder of a batch: which parts are already there, what must go, and what comes last.

A folder with a manifest is a finished batch. Parts stay when a run is stopped, and the next run
with the same inputs and options goes on from them: each part's metadata say what it was made of.
"""

import contextlib
import json
from collections.abc import Callable, Container, Iterable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from dmpcli.batch.ledger import Ledger
from dmpcli.batch.part import FACT, Job, Outcome, outcome_of
from dmpcli.errors import InputError
from dmpcli.records import file_io, record, schemas
from dmpcli.records.record import Record

_TEMPORARY = ".part-*.parquet.*.tmp"


class Folder:
    """Where the parts of one batch go.

    Parameters
    ----------
    job : Job
        Its folder need not exist yet.
    share : str
        Of the batch, that this run draws; its ledger has this name.
    """

    def __init__(self, job: Job, share: str = "1-of-1") -> None:
        self.job, self.path = job, Path(job.folder)
        self._expected = json.loads(record.header(Record(schemas.TRAJECTORY, {}, job.provenance)))
        self._own = () if job.prepare is None else tuple(job.provenance.facts)
        self._ledger = Ledger(self.path, self._expected, share)

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
            parts = {self.job.file_of(number): number for number in numbers}
            self._tidy(None if whole else parts)
            there = file_io.parts_of(self.path)
            told = self._ledger.read(there)
            kept = {}
            for file, number in parts.items():
                if file not in there:
                    continue
                outcome = told.get(file) or self._outcome(file, number)
                if outcome is None or outcome.number != number or outcome.sites != hashes(number):
                    (self.path / file).unlink()
                else:
                    kept[number] = outcome
                    if file not in told:
                        self._ledger.note(file, outcome)
            for other in there.keys() - parts.keys() if whole else ():
                (self.path / other).unlink()
        except OSError as error:
            raise InputError(f"{self.path}: cannot be written: {error.strerror}") from None
        return kept

    def _tidy(self, parts: Container[str] | None) -> None:
        """Remove the halves that a run left which was killed: those of some parts, or all.

        Another machine may be writing a part of its own share.
        """
        for folder in file_io.part_folders(self.path):
            inner = "" if folder == self.path else f"{folder.name}/"
            for stale in folder.glob(_TEMPORARY):
                of = f"{inner}{stale.name[1:].split('.parquet.')[0]}.parquet"
                if parts is None or of in parts:
                    stale.unlink(missing_ok=True)

    def _outcome(self, name: str, number: int) -> Outcome | None:
        """Outcome of a part that is there, whole and of the same inputs; None otherwise."""
        file = self.path / name
        try:
            footer = pq.read_metadata(file)
            found = json.loads((footer.metadata or {})[record.KEY])
            fact = found["facts"].pop(FACT)
            if self._own:
                # What is so for these surfaces alone.
                found["facts"] = {k: v for k, v in found["facts"].items() if k in self._own}
            if found != self._expected or fact.get("number") != number:
                return None
            return outcome_of(fact, footer.num_rows, file.stat().st_size)
        except (pa.ArrowException, OSError, ValueError, KeyError, TypeError, AttributeError):
            return None

    def note(self, outcome: Outcome) -> None:
        """Write down that a part was drawn.

        Raises
        ------
        InputError
            The ledger cannot be written.
        """
        if outcome.rows:
            try:
                self._ledger.note(self.job.file_of(outcome.number), outcome)
            except OSError as error:
                raise InputError(f"{self.path}: cannot be written: {error.strerror}") from None

    def leave(self) -> None:
        """Leave no folder behind that nothing was drawn into."""
        self._ledger.close()
        with contextlib.suppress(OSError):
            for folder in reversed(file_io.part_folders(self.path)):
                with contextlib.suppress(OSError):
                    folder.rmdir()

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
        self._tidy(None)
        file_io.write(self.path / file_io.TABLE, record.encode(table))
        text = json.dumps(manifest, indent=2, sort_keys=True, allow_nan=False) + "\n"
        file_io.write(self.path / file_io.MANIFEST, text.encode())
        with contextlib.suppress(OSError):
            self._ledger.remove()

"""The folder of a batch: which parts are already there, what must go, and what comes last.

A folder with a manifest is a finished batch. Parts stay when a run is stopped, and the next run
with the same inputs and options goes on from them: each part's metadata say what it was made of.
"""

import contextlib
import json
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyarrow as pa

from dmpcli.batch.ledger import Ledger
from dmpcli.batch.part import FACT, Job, Outcome, outcome_of
from dmpcli.errors import InputError
from dmpcli.records import file_io, parquet, record, schemas
from dmpcli.records.draft import Draft, remove_abandoned
from dmpcli.records.record import Record
from dmpcli.records.storage import Stats, each, located

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
        self.job, self.path = job, located(job.folder)
        columns = {schemas.EVENT: np.empty(0, dtype=object)} if job.task.events else {}
        empty = Record(schemas.TRAJECTORY, columns, job.provenance)
        self._expected = json.loads(record.header(empty))
        self._own = () if job.prepare is None else tuple(job.provenance.facts)
        self._ledger = Ledger(self.path, self._expected, share)
        self._whole = True
        self._there: Stats = {}
        self._told: dict[str, Outcome] = {}
        self._stale: set[str] = set()
        self._table: tuple[Draft, record.GrowingRecord] | None = None

    def open(self, whole: bool) -> None:
        """Make room for a batch, and look what is there.

        What a finished batch ends with goes first, so that nobody takes the folder for one.

        Parameters
        ----------
        whole : bool
            Whether all parts of the batch are to be drawn, and not a share of them.

        Raises
        ------
        InputError
            The folder cannot be written.
        """
        self._whole = whole
        with self._writing():
            self.path.mkdir(exist_ok=True)
            (self.path / file_io.MANIFEST).unlink(missing_ok=True)
            (self.path / file_io.TABLE).unlink(missing_ok=True)
            if whole:
                self._tidy(None)
            self._there = file_io.parts_of(self.path)
            self._told = self._ledger.read(self._there)
            self._stale = set(self._there)

    def kept(
        self, numbers: Iterable[int], hashes: Callable[[int], list[list[str | None]]]
    ) -> dict[int, Outcome]:
        """Return the outcomes of those parts that are already there; what is left of others goes.

        Parameters
        ----------
        numbers : iterable of int
            Of the parts.
        hashes : callable
            Returns the hashes of the files that a part's own pairs lie on.

        Raises
        ------
        InputError
            The folder cannot be written.
        """
        kept = {}
        with self._writing():
            parts = {self.job.file_of(number): number for number in numbers}
            if not self._whole:
                self._tidy(parts)
            asked = [file for file in parts if file in self._there and file not in self._told]
            found = each(self.path, lambda file: self._outcome(file, parts[file]), asked)
            own = dict(zip(asked, found, strict=True))
            for file, number in parts.items():
                self._stale.discard(file)
                if file not in self._there:
                    continue
                outcome = self._told.pop(file, None)
                told = outcome is not None
                outcome = outcome or own.get(file)
                if outcome is None or outcome.number != number or outcome.sites != hashes(number):
                    (self.path / file).unlink(missing_ok=True)
                    continue
                kept[number] = outcome
                if not told:
                    self._ledger.note(file, outcome)
        return kept

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise InputError(f"{self.path}: cannot be written: {error.strerror}") from None

    def _tidy(self, parts: Container[str] | None, but: Path | None = None) -> None:
        """Remove the halves that a run left which was killed: those of some parts, or all.

        Another machine may be writing a part of its own share. In an object store there are none.
        """
        if not isinstance(self.path, Path):
            return
        for stale in self.path.glob(f".{file_io.TABLE}.*.tmp") if parts is None else ():
            if stale != but:
                remove_abandoned(stale)
        for folder in cast(Sequence[Path], file_io.part_folders(self.path)):
            inner = "" if folder == self.path else f"{folder.name}/"
            for half in folder.glob(_TEMPORARY):
                of = f"{inner}{half.name[1:].split('.parquet.')[0]}.parquet"
                if parts is None or of in parts:
                    remove_abandoned(half)

    def _outcome(self, name: str, number: int) -> Outcome | None:
        """Outcome of a part that is there, whole and of the same inputs; None otherwise."""
        try:
            footer = parquet.footer(self.path / name)
            found = json.loads((footer.metadata or {})[record.KEY])
            fact = found["facts"].pop(FACT)
            if self._own:
                # What is so for these surfaces alone.
                found["facts"] = {k: v for k, v in found["facts"].items() if k in self._own}
            if found != self._expected or fact.get("number") != number:
                return None
            return outcome_of(fact, footer.num_rows, self._there[name].st_size)
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
            with self._writing():
                self._ledger.note(self.job.file_of(outcome.number), outcome)

    def add(self, table: Record) -> None:
        """Write rows of the table of pairs, which grows beside its name.

        Raises
        ------
        InputError
            The folder cannot be written.
        """
        with self._writing():
            if self._table is None:
                # There is none where no pair could be drawn: its table says why.
                self.path.mkdir(exist_ok=True)
                draft = Draft(self.path / file_io.TABLE)
                self._table = draft, record.GrowingRecord(draft.stream)
            self._table[1].add(table)

    def leave(self) -> None:
        """End writing; leave no folder behind that nothing was drawn into."""
        self._ledger.close()
        if self._table is not None:
            # Else Arrow would do it as Python ends, on a file that is closed, and complain.
            with contextlib.suppress(OSError, ValueError, pa.ArrowException):
                self._table[1].close()
            self._table[0].drop()
        if not isinstance(self.path, Path):
            return
        with contextlib.suppress(OSError):
            for folder in reversed(file_io.part_folders(self.path)):
                with contextlib.suppress(OSError):
                    Path(str(folder)).rmdir()

    def finish(self, manifest: dict[str, Any]) -> None:
        """Give the table of pairs its name and, last of all, write the manifest.

        Raises
        ------
        InputError
            The folder cannot be written, or somebody else has written into it.
        """
        assert self._table is not None
        draft, table = self._table
        with self._writing():
            there = file_io.parts_of(self.path)
            for part in manifest["parts"]:
                name, size = part["file"], part["bytes"]
                if name not in there or there[name].st_size != size:
                    raise InputError(
                        f"{self.path / name}: another run has removed or replaced it; let one "
                        "alone draw into a folder: the same command goes on from here"
                    )
            for stale in self._stale:
                (self.path / stale).unlink(missing_ok=True)
            # A worker that died in the middle of a part has left its half.
            self._tidy(None, draft.path)
            table.close()
            draft.settle()
            draft.keep()
        self._table = None
        text = json.dumps(manifest, indent=2, sort_keys=True, allow_nan=False) + "\n"
        file_io.write(self.path / file_io.MANIFEST, text.encode())
        with contextlib.suppress(OSError):
            self._ledger.remove()

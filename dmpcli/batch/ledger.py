"""The ledger of a run: what became of each part, one line each, so that the next run goes on.

A line is worth something only for a part that still has the size and the time that it tells: any
other is asked itself. It says nothing that the parts do not say, and goes when the batch is
finished. Each share of a batch has its own, for they may be written on several machines. In an
object store, where nothing can be added to, a ledger is several objects of some lines each; what a
run that was killed had not yet sent is asked of the parts themselves.
"""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO
from uuid import uuid4

from dmpcli.batch.part import Outcome, outcome_of
from dmpcli.errors import DmpError
from dmpcli.records.object_store import ObjectPath
from dmpcli.records.storage import Location, Stats

_NAMES = "_ledger-*.jsonl"

_TOGETHER = 200
"""Lines that are sent to a store at once."""


class Ledger:
    """What a folder's ledgers tell, and the one that this run writes.

    Parameters
    ----------
    folder : Path or ObjectPath
    header : object
        What all parts of the batch have in common, as JSON has it.
    share : str
        Of this run.
    """

    def __init__(self, folder: Location, header: Any, share: str) -> None:
        self._folder, self._header = folder, header
        self._share = share
        self._file: TextIO | None = None
        self._unsent: list[str] = []

    def read(self, there: Stats) -> dict[str, Outcome]:
        """Return the outcomes of parts of this batch that are as they were written, by name.

        Parameters
        ----------
        there : mapping
            Size and time of the files that are there.

        Raises
        ------
        OSError
        """
        found: dict[str, Outcome] = {}
        paths: list[Location] = [*self._folder.glob(_NAMES)]
        for path in sorted(paths, key=str):
            for line in self._lines(path):
                with contextlib.suppress(KeyError, TypeError, ValueError, AttributeError):
                    now = there.get(line["file"])
                    if now is None or [now.st_size, now.st_mtime_ns] != line["is"]:
                        continue
                    one = outcome_of(line["part"], line["rows"], now.st_size)
                    found[line["file"]] = one
        return found

    def _lines(self, path: Location) -> Iterator[Any]:
        """Lines of a ledger of this batch; none of another one's, and no half ones."""
        with path.open(encoding="utf-8", errors="replace") as stream:
            if not self._is_ours(stream.readline()):
                return
            for text in stream:
                with contextlib.suppress(ValueError):
                    yield json.loads(text)

    def note(self, name: str, outcome: Outcome) -> None:
        """Write down a part that was drawn.

        Raises
        ------
        OSError
        """
        now = (self._folder / name).stat()
        line = {
            "file": name,
            "is": [now.st_size, now.st_mtime_ns],
            "rows": outcome.rows,
            "part": outcome.fact(),
        }
        if isinstance(self._folder, ObjectPath):
            self._unsent.append(_text(line))
            if len(self._unsent) == _TOGETHER:
                self._send(self._folder)
            return
        if self._file is None:
            self._file = self._begin(self._folder)
        self._file.write(_text(line))
        self._file.flush()

    def _begin(self, folder: Path) -> TextIO:
        """Go on with the ledger of an earlier run of this batch, or begin anew."""
        ours, path = False, folder / f"_ledger-{self._share}.jsonl"
        if path.is_file():
            with path.open(encoding="utf-8", errors="replace") as stream:
                ours = self._is_ours(stream.readline())
        file = path.open("a" if ours else "w", encoding="utf-8")
        # A run that was killed may have left half a line.
        file.write("\n" if ours else _text(self._header))
        return file

    def _send(self, folder: ObjectPath) -> None:
        """Write the lines that are not in the store yet, into an object of their own."""
        text = _text(self._header) + "".join(self._unsent)
        (folder / f"_ledger-{self._share}-{uuid4().hex}.jsonl").put(text.encode())
        self._unsent.clear()

    def _is_ours(self, text: str) -> bool:
        try:
            return bool(json.loads(text) == self._header)
        except ValueError:
            return False

    def close(self) -> None:
        """End writing."""
        if self._unsent and isinstance(self._folder, ObjectPath):
            with contextlib.suppress(
                DmpError
            ):  # what ends the run is told, and parts tell the rest
                self._send(self._folder)
        if self._file is not None:
            self._file.close()
            self._file = None

    def remove(self) -> None:
        """Remove all ledgers of the folder: its batch is finished.

        Raises
        ------
        OSError
        """
        self._unsent.clear()
        self.close()
        for path in self._folder.glob(_NAMES):
            path.unlink(missing_ok=True)


def told_in(folder: Location, there: Stats) -> set[str]:
    """Return the names of those parts that the ledgers of any batch here tell of as they are."""
    told = set()
    for path in folder.glob(_NAMES):
        with path.open(encoding="utf-8", errors="replace") as stream:
            for text in stream:
                with contextlib.suppress(ValueError, KeyError, TypeError):
                    line = json.loads(text)
                    now = there.get(line["file"])
                    if now is not None and [now.st_size, now.st_mtime_ns] == line["is"]:
                        told.add(line["file"])
    return told


def _text(line: Any) -> str:
    return json.dumps(line, sort_keys=True, separators=(",", ":"), allow_nan=False) + "\n"

"""The ledger of a run: what became of each part, one line each, so that the next run goes on.

A line is worth something only for a part that still has the size and the time that it tells: any
other is asked itself. It says nothing that the parts do not say, and goes when the batch is
finished. Each share of a batch has its own, for they may be written on several machines.
"""

import contextlib
import json
from collections.abc import Iterator, Mapping
from os import stat_result
from pathlib import Path
from typing import Any, TextIO

from dmpcli.batch.part import Outcome, outcome_of

_NAMES = "_ledger-*.jsonl"


class Ledger:
    """What a folder's ledgers tell, and the one that this run writes.

    Parameters
    ----------
    folder : Path
    header : object
        What all parts of the batch have in common, as JSON has it.
    share : str
        Of this run.
    """

    def __init__(self, folder: Path, header: Any, share: str) -> None:
        self._folder, self._header = folder, header
        self._path = folder / f"_ledger-{share}.jsonl"
        self._file: TextIO | None = None

    def read(self, there: Mapping[str, stat_result]) -> dict[str, Outcome]:
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
        for path in sorted(self._folder.glob(_NAMES)):
            for line in self._lines(path):
                with contextlib.suppress(KeyError, TypeError, ValueError, AttributeError):
                    now = there.get(line["file"])
                    if now is None or [now.st_size, now.st_mtime_ns] != line["is"]:
                        continue
                    one = outcome_of(line["part"], line["rows"], now.st_size)
                    found[line["file"]] = one
        return found

    def _lines(self, path: Path) -> Iterator[Any]:
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
        if self._file is None:
            self._begin()
        assert self._file is not None
        line = {
            "file": name,
            "is": [now.st_size, now.st_mtime_ns],
            "rows": outcome.rows,
            "part": outcome.fact(),
        }
        self._file.write(_text(line))
        self._file.flush()

    def _begin(self) -> None:
        """Go on with the ledger of an earlier run of this batch, or begin anew."""
        ours = False
        if self._path.is_file():
            with self._path.open(encoding="utf-8", errors="replace") as stream:
                ours = self._is_ours(stream.readline())
        self._file = self._path.open("a" if ours else "w", encoding="utf-8")
        # A run that was killed may have left half a line.
        self._file.write("\n" if ours else _text(self._header))

    def _is_ours(self, text: str) -> bool:
        try:
            return bool(json.loads(text) == self._header)
        except ValueError:
            return False

    def close(self) -> None:
        """End writing."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def remove(self) -> None:
        """Remove all ledgers of the folder: its batch is finished.

        Raises
        ------
        OSError
        """
        self.close()
        for path in self._folder.glob(_NAMES):
            path.unlink(missing_ok=True)


def _text(line: Any) -> str:
    return json.dumps(line, sort_keys=True, separators=(",", ":"), allow_nan=False) + "\n"

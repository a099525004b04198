"""So that nothing of a run is lost: a journal while it goes on, then the file."""

import contextlib
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dmpcli.control.signals import Interruption
from dmpcli.errors import DmpError, InputError, InstrumentError
from dmpcli.messages import tell, warn

if TYPE_CHECKING:
    from dmpcli.records.journal import Journal
    from dmpcli.records.record import Provenance, Record
    from dmpcli.records.row_buffer import RowBuffer
    from dmpcli.records.schemas import Schema


@dataclass(frozen=True)
class FinishedRun:
    """A recording or an execution that no failure ended.

    Attributes
    ----------
    record : Record or None
        What was logged; None where a signal came before anything was.
    signal : int or None
        The one that ended it.
    reason : str
        Why it ended.
    """

    record: "Record | None"
    signal: int | None
    reason: str


@contextlib.contextmanager
def interruptible(realtime: bool) -> Iterator[Interruption]:
    """Count signals while it is entered; beside the main thread none can come.

    Raises
    ------
    InputError
        A run in real time that no signal could stop.
    """
    if threading.current_thread() is threading.main_thread():
        with Interruption() as signals:
            yield signals
        return
    if realtime:
        raise InputError(
            "a run in real time must be begun in the main thread: no other gets the signals that "
            "stop the arm"
        )
    yield Interruption()


def refuse_replacing(
    output: str | None,
    repeatable: bool,
    force: bool,
    why: str,
    remedy: str = "choose another name, or give --force",
) -> None:
    """Refuse an output that holds what cannot be made again, or none where it would be lost.

    Parameters
    ----------
    output : str or None
        A file's name, ``-``, or None where what is made stays in memory.
    repeatable, force : bool
        Whether it can be made again, and whether it may be lost nevertheless.
    why : str
        What cannot be made again.
    remedy : str

    Raises
    ------
    InputError
        Names the file.
    """
    if repeatable or force or output == "-":
        return
    if output is None:
        raise InputError(f"output: name a file, for {why}")
    if Path(output).exists():
        raise InputError(f"{output}: exists, and {why}; {remedy}")


class RunOutput:
    """The output of one run, and its journal where the run cannot be made again.

    Simulated time has none: the same command gives the same bytes again.

    Parameters
    ----------
    output : str or None
        None: the run stays in memory.
    realtime : bool
    replaces : bool
        Whether it may take the place of a file that is there by the end: of one that can be made
        again, or where that was asked for.

    Attributes
    ----------
    output : str or None
    kept : bool
        Whether the output is there.
    """

    def __init__(self, output: str | None, realtime: bool, replaces: bool = True) -> None:
        self.output, self._realtime, self._replaces = output, realtime, replaces
        self._journal: Journal | None = None
        self.kept = False

    def check(self) -> None:
        """Refuse the name of a run that goes on, before an instrument of it is disturbed.

        Raises
        ------
        InputError
            Another run has a journal of this name, or one that did not end has left it.
        """
        if self.output is None or not self._realtime:
            return
        from dmpcli.records import journal

        path = journal.beside(self.output)
        if path is not None:
            journal.refuse_taken(path)

    def begin(self, rows: "RowBuffer", schema: "Schema", provenance: "Provenance") -> None:
        """Open the journal, before anything moves.

        Parameters
        ----------
        rows : RowBuffer
            Filled by the loop.
        schema : Schema
        provenance : Provenance
            What is known before the run.

        Raises
        ------
        InputError
            A run that did not end left one of this name, or it cannot be written.
        """
        if self.output is None or not self._realtime:
            return
        from dmpcli.records import journal

        path = journal.beside(self.output)
        if path is None:
            tell(f"-o {self.output}: has no journal; a crash would lose the run")
            return
        self._journal = journal.Journal(path, rows, schema, provenance)

    def hindrance(self) -> InstrumentError | None:
        """Return why the journal cannot go on; None while it can, or where there is none."""
        return None if self._journal is None else self._journal.hindrance()

    def keep(self, whole: "Record", failure: DmpError | None) -> None:
        """Write the output; what cannot be written stays in the journal.

        Parameters
        ----------
        whole : Record
        failure : DmpError or None
            What the command ends with: it is told last, and this only before it.

        Raises
        ------
        InputError
            The output cannot be written, or a file of its name has appeared meanwhile, beside
            which it is kept; and nothing else failed.
        """
        from dmpcli.records import record

        if self._journal is not None:
            self._journal.finish(whole.provenance.facts)
        if self.output is None:
            return
        try:
            name = kept_as(self.output, record.encode(whole), self._replaces)
        except InputError as error:
            self._told(InputError(f"{error}{self._where()}"), failure)
            return
        self.kept = True
        self.drop()
        if name != self.output:
            appeared, self.output = self.output, name
            self._told(_moved(appeared, name), failure)

    def _told(self, error: InputError, failure: DmpError | None) -> None:
        """End with an error, or tell it before the one that the command ends with."""
        if failure is None:
            raise error from None
        warn(str(error))

    def drop(self) -> None:
        """Remove the journal: the output is there, or there was nothing to keep."""
        if self._journal is not None:
            self._journal.discard()

    def _where(self) -> str:
        if self._journal is None:
            return ""
        path = self._journal.path
        return (
            f"\nthe run is kept in {path}: make room, then 'dmpcli recover {path} -o {self.output}'"
        )


def kept_as(output: str, content: bytes, replaces: bool) -> str:
    """Write what cannot be made again; return the name that it has got.

    Parameters
    ----------
    output : str
        What it is to be called; ``-`` is standard output.
    content : bytes
    replaces : bool
        Whether a file of that name may be replaced; else it is kept under a free name.

    Raises
    ------
    InputError
        It cannot be written.
    """
    from pathlib import Path

    from dmpcli.records import file_io

    if replaces or output == file_io.DASH:
        file_io.write(output, content)
        return output
    found = file_io.write_new(output, content)
    return output if found in (Path(output), Path(output).resolve()) else str(found)


def write_once(output: str, content: bytes, replaces: bool) -> None:
    """Write what cannot be made again, beside a file of that name that has appeared meanwhile.

    Parameters
    ----------
    output : str
        What it is to be called; ``-`` is standard output.
    content : bytes
    replaces : bool
        Whether a file of that name may be replaced.

    Raises
    ------
    InputError
        It cannot be written; or it was kept under another name, which is told.
    """
    name = kept_as(output, content, replaces)
    if name != output:
        raise _moved(output, name)


def _moved(output: str, name: str) -> InputError:
    return InputError(
        f"{output}: appeared meanwhile and is not replaced; what was measured is kept in {name}"
    )

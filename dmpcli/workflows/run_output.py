"""So that nothing of a run is lost: a journal while it goes on, then the file."""

from typing import TYPE_CHECKING

from dmpcli.errors import DmpError, InputError, InstrumentError
from dmpcli.messages import tell, warn

if TYPE_CHECKING:
    from dmpcli.records.journal import Journal
    from dmpcli.records.record import Provenance, Record
    from dmpcli.records.row_buffer import RowBuffer
    from dmpcli.records.schemas import Schema


class RunOutput:
    """The output of one run, and its journal where the run cannot be made again.

    Simulated time has none: the same command gives the same bytes again.

    Parameters
    ----------
    output : str
    realtime : bool

    Attributes
    ----------
    output : str
    kept : bool
        Whether the output is there.
    """

    def __init__(self, output: str, realtime: bool) -> None:
        self.output, self._realtime = output, realtime
        self._journal: Journal | None = None
        self.kept = False

    def check(self) -> None:
        """Refuse the name of a run that goes on, before an instrument of it is disturbed.

        Raises
        ------
        InputError
            Another run has a journal of this name, or one that did not end has left it.
        """
        from dmpcli.records import journal

        path = journal.beside(self.output) if self._realtime else None
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
        if not self._realtime:
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
            The output cannot be written, and nothing else failed.
        """
        from dmpcli.records import file_io, record

        if self._journal is not None:
            self._journal.finish(whole.provenance.facts)
        try:
            file_io.write(self.output, record.encode(whole))
        except InputError as error:
            told = InputError(f"{error}{self._where()}")
            if failure is None:
                raise told from None
            warn(str(told))
            return
        self.kept = True
        self.drop()

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

"""``dmpcli recover``: turn the journal of a run that did not end into its proper file."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.commands.options import Quiet
from dmpcli.errors import InputError, counted
from dmpcli.messages import on_terminal, tell

if TYPE_CHECKING:
    from dmpcli.records.journal import JournalContent
    from dmpcli.records.record import Record


def command(
    journal: Annotated[
        str, typer.Argument(metavar="JOURNAL", help="What the crash left; - is stdin.")
    ],
    output: Annotated[
        str,
        typer.Option("--output", "-o", metavar="FILE", help="Demonstration or run; - is stdout."),
    ],
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    quiet: Quiet = False,
) -> None:
    """Make the file that a crash kept `record` or `execute` from writing."""
    on_terminal(quiet)
    from dmpcli.records import file_io, record, suffixes
    from dmpcli.records import journal as journals
    from dmpcli.workflows.run_output import write_once

    suffixes.check(output, suffixes.PARQUET)
    file_io.check_writable(output, here=True)
    if output != file_io.DASH and Path(output).is_file() and not force:
        raise InputError(f"{output}: exists; choose another name, or give --force")
    found = journals.read(file_io.read(journal, journal=True))
    whole = _record(found)
    write_once(output, record.encode(whole), replaces=force)
    tell(_summary(output, journal, found, whole))


def _record(found: "JournalContent") -> "Record":
    """Return the proper file's record; a run that came to its end gives the very same file."""
    from dataclasses import replace

    from dmpcli.control import demonstration_log, run_log
    from dmpcli.records.record import Record
    from dmpcli.records.schemas import DEMONSTRATION

    drags = found.schema is DEMONSTRATION
    columns = demonstration_log.columns(found.rows) if drags else run_log.columns(found.rows)
    facts = found.provenance.facts
    if not found.whole:
        options = found.provenance.options
        facts = facts | (
            demonstration_log.recovered() if drags else run_log.recovered(columns, options)
        )
        seconds = float(columns["t"][-1])
        facts = facts | {"recovered": {"rows": len(found.rows), "seconds": seconds}}
    return Record(found.schema, columns, replace(found.provenance, facts=facts))


def _summary(output: str, journal: str, found: "JournalContent", whole: "Record") -> str:
    from dmpcli.records import file_io

    state = "all of the run" if found.whole else "as far as the journal goes"
    cut = f"; {found.unread} bytes of a broken end left out" if found.unread else ""
    last = "" if journal == file_io.DASH else f"; {journal} may be removed"
    return (
        f"{file_io.shown(output, output=True)}: {counted(len(whole), 'row')}, {whole.t[-1]:.2f} s, "
        f"{state}{cut}{last}"
    )

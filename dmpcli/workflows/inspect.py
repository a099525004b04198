"""`inspect`: what a file is, and of a batch's folder its table."""

from pathlib import Path

from dmpcli.messages import tell
from dmpcli.records import file_io, mesh
from dmpcli.records.layouts import Layout
from dmpcli.reporting import inspection
from dmpcli.reporting.stroke_measures import Row


def inspect(file: str, layout: Layout | None = None, options: str = "") -> Row:
    """Describe a file, and tell what will take its time.

    Parameters
    ----------
    file : str
        Or the folder of a batch, or ``-``.
    layout : Layout, optional
        How a recording of another program is read.
    options : str
        That say it, as they are typed.

    Raises
    ------
    InputError
        As `inspection.inspected`.
    """
    if Path(file).is_dir() and (Path(file) / file_io.TABLE).is_file():
        file = str(Path(file) / file_io.TABLE)
    source = file_io.read(file)
    waiting = mesh.waiting(source)
    if waiting is not None:
        tell(waiting)
    return inspection.inspected(source, layout, options)

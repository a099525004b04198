"""By what means a job is drawn: compiled kernels, or numpy; chosen once, and then kept to.

Both give the same strokes but for the last bits, so one job has one means, for all its parts and
whoever draws them. It is told by the job as a whole, never by the size of a part: a table of so
many rows, by whether the extra is here, or by what the folder says that is gone on with.
"""

import importlib.util
import json
from pathlib import Path
from typing import Protocol

import pyarrow as pa

from dmpcli import extras
from dmpcli.dmp.options import Kernels, Means
from dmpcli.errors import InputError
from dmpcli.messages import tell, warn
from dmpcli.records import file_io, parquet, record
from dmpcli.records.storage import Location

MANY_ON_MESH = 1000
"""Rows from which kernels bring more than loading them costs, on meshes, one or many ..."""

MANY = 30_000
"""... and on other surfaces, where only the tool's turn is theirs."""

MANY_TO_MEASURE = 5000
"""Strokes from which measuring them with kernels brings more than loading these costs."""

OPTION = "kernels"
"""Their name in the options of a job that is drawn with them; numpy leaves no trace."""


def means(asked: Kernels, rows: int, mesh: bool, turning: bool, output: Location) -> Means:
    """Choose the means of a job.

    Parameters
    ----------
    asked : {'auto', 'compiled', 'pure'}
    rows : int
        Of the whole table, whatever share of it is drawn here.
    mesh : bool
        Whether strokes may lie on meshes.
    turning : bool
        Whether their tools turn with a surface.
    output : Path or ObjectPath
        The job's folder: what was begun there goes on as it was.

    Raises
    ------
    InputError
        Kernels are asked for, or were used in the folder, and numba is not here.
    """
    if asked == "compiled":
        _must_be_there()
        return "compiled"
    if asked == "pure":
        return "pure"
    before = recorded(output)
    if before is not None:
        if before == "compiled" and extras.kernels_off():
            raise InputError(f"{output}: was begun with --kernels compiled; {_SWITCHED_OFF}")
        if before == "compiled" and not there():
            raise InputError(
                f"{output}: was begun with --kernels compiled, which needs numba, not installed "
                f"here: {extras.FAST.install}, or give --kernels pure to draw it anew"
            )
        return before
    many = (mesh and rows >= MANY_ON_MESH) or (turning and rows >= MANY)
    return "compiled" if many and there() else "pure"


_SWITCHED_OFF = (
    "NUMBA_DISABLE_JIT keeps numba from compiling: unset it, or give --kernels pure to draw it anew"
)


def there() -> bool:
    """Tell whether kernels can be compiled here, without loading what does it."""
    return importlib.util.find_spec("numba") is not None and not extras.kernels_off()


def _must_be_there() -> None:
    extras.load(extras.FAST, "--kernels compiled", "numba")
    if extras.kernels_off():
        raise InputError(f"--kernels compiled: {_SWITCHED_OFF}")


def recorded(output: Location) -> Means | None:
    """Means of the parts that a folder holds; None where there are none that tell."""
    for name in sorted(file_io.parts_of(output)) if output.is_dir() else ():
        try:
            footer = parquet.footer(output / name)
            options = json.loads((footer.metadata or {})[record.KEY])["options"]
            return "compiled" if options.get(OPTION) == "compiled" else "pure"
        except (pa.ArrowException, OSError, ValueError, KeyError, TypeError, AttributeError):
            continue
    return None


def to_measure(asked: Kernels, strokes: int, on_mesh: bool) -> Means:
    """Choose the means that the strokes of batches are measured with, all of a report alike.

    Parameters
    ----------
    asked : {'auto', 'compiled', 'pure'}
    strokes : int
        Of all batches, in however many processes they are measured.
    on_mesh : bool
        Whether some may lie on meshes.

    Raises
    ------
    InputError
        Kernels are asked for, and numba is not here.
    """
    if asked == "compiled":
        _must_be_there()
        return "compiled"
    many = strokes >= (MANY_ON_MESH if on_mesh else MANY_TO_MEASURE)
    return "compiled" if asked == "auto" and many and there() else "pure"


def kept(ready: "CompiledKernels | None" = None) -> bool:
    """Tell whether what an earlier run compiled is there, as far as names tell."""
    ready = _to_draw() if ready is None else ready
    return all(folder and any(Path(folder).glob(f"*{name}*.nbi")) for folder, name in ready.files())


def get_ready(ready: "CompiledKernels | None" = None) -> None:
    """Load the kernels of a job, or compile them; say so where it takes time.

    Those that draw, unless a module names others.
    """
    ready = _to_draw() if ready is None else ready
    if kept(ready):
        ready.load()
        return
    tell("kernels are compiled, once on this machine; it takes some 20 s of a processor")
    ready.load()
    if not kept(ready):
        warn(
            "what was compiled cannot be kept, so each process and the next command compile again: "
            "name a folder that can be written, and has room, as NUMBA_CACHE_DIR"
        )


class CompiledKernels(Protocol):
    """A module that knows the kernels of a job."""

    def files(self) -> list[tuple[str, str]]:
        """Folder where each is kept, and what the names of its files hold."""

    def load(self) -> None:
        """Call each once."""


def _to_draw() -> CompiledKernels:
    from dmpcli.surfaces.kernels import ready

    return ready

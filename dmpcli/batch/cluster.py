"""Drawing parts on the workers of a Dask cluster that is already there.

Dask only carries parts to workers and outcomes back; the files are ours, so they are the same as
from one machine, whatever the number of workers and whichever dies on the way. Every worker needs
the same programs and must see the batch's folder under the same path, which may be an object
store's: each then reads and writes it with credentials of its own environment.
"""

import contextlib
import importlib.metadata
import importlib.util
import platform
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any
from uuid import uuid4

import numpy as np
import pyarrow as pa
import scipy

from dmpcli import extras
from dmpcli.batch.part import Job, Outcome, Part
from dmpcli.batch.part_drawing import draw_part
from dmpcli.batch.workers import Draw
from dmpcli.errors import DmpError, InputError, InstrumentError
from dmpcli.records import file_io
from dmpcli.records.object_store import ObjectPath
from dmpcli.records.storage import Location, located
from dmpcli.version import __version__

PATIENCE = 5.0
"""How long a scheduler may take to answer, s."""

_MARK = b"dmpcli"
_AHEAD = 2
_PLUGIN = "dmpcli-"


def workers(address: str) -> AbstractContextManager[Draw]:
    """Return what lends, within it, what draws parts on a cluster.

    Parameters
    ----------
    address : str
        Of the scheduler, as ``tcp://HOST:8786``.

    Raises
    ------
    InputError
        Dask is not installed.
    InstrumentError
        Nobody answers there, or there are no workers.
    """
    distributed, _ = extras.load(extras.DASK, "--cluster", "distributed", "threadpoolctl")
    try:
        client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InstrumentError(
            f"--cluster {address}: no scheduler answers ({type(error).__name__}); "
            "check address and network"
        ) from None

    return _connected(client, address)


@contextlib.contextmanager
def _connected(client: Any, address: str) -> Iterator[Draw]:
    def draw(job: Job, parts: Iterable[Part]) -> Iterator[Outcome]:
        yield from _drawn(client, address, job, parts)

    with client:
        yield draw


def versions(kernels: bool = False) -> dict[str, str]:
    """Return the versions that decide about the bytes of a part.

    Parameters
    ----------
    kernels : bool
        Whether it is drawn with them.
    """
    found = {
        "dmpcli": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "pyarrow": pa.__version__,
    }
    if kernels:
        there = importlib.util.find_spec("numba") is not None
        found["numba"] = importlib.metadata.version("numba") if there else "not installed"
        if there and extras.kernels_off():
            found["numba"] = "switched off by NUMBA_DISABLE_JIT"
    return found


def _drawn(client: Any, address: str, job: Job, parts: Iterable[Part]) -> Iterator[Outcome]:
    from distributed import WorkerPlugin, as_completed

    class Bringer(WorkerPlugin):  # type: ignore[misc]
        """Brings the job once to each worker, those that come later too."""

        def __init__(self, name: str) -> None:
            self.name = name

        def setup(self, worker: Any) -> None:
            from threadpoolctl import threadpool_limits

            # With more threads the last bits of a product depend on the number of cores.
            self.limits = threadpool_limits(1)
            setattr(worker, self.name, _brought(job, ours, worker.name))

        def teardown(self, worker: Any) -> None:
            self.limits.restore_original_limits()
            worker.__dict__.pop(self.name, None)

    folder = located(job.folder).absolute()
    _check(client, address, folder, job.task.style.compiled)
    job = replace(job, folder=str(folder))
    ours = versions(job.task.style.compiled)
    name = _PLUGIN + uuid4().hex
    try:
        client.register_plugin(Bringer(name))
        waiting = as_completed(loop=client.loop, raise_errors=False)
        ahead = _AHEAD * sum(client.ncores().values())
        for part in parts:
            waiting.add(client.submit(_draw, name, part, pure=False, retries=2))
            if waiting.count() >= ahead:
                yield _result(next(waiting), address)
        for future in waiting:
            yield _result(future, address)
    except (OSError, CancelledError) as error:
        raise _lost(address, error) from None
    finally:
        with contextlib.suppress(OSError, CancelledError):  # nobody there has it any more
            client.unregister_worker_plugin(name)


def _check(client: Any, address: str, folder: Location, kernels: bool) -> None:
    """Refuse a cluster whose workers would draw other bytes, or elsewhere."""
    if not client.ncores():
        raise InstrumentError(f"--cluster {address}: the scheduler has no workers; start some")
    try:
        found: dict[str, dict[str, str]] = client.run(versions, kernels)
    except Exception as error:
        raise InputError(
            f"--cluster {address}: its workers cannot run dmpcli {__version__} ({error}); "
            "install it there"
        ) from None
    for worker, theirs in found.items():
        other = _differs(theirs, versions(kernels))
        if other is not None:
            raise InputError(f"--cluster {address}: worker {worker} {other}")
    mark = folder / f".{uuid4().hex}.tmp"
    try:
        file_io.write(mark, _MARK)
        seen: dict[str, bool] = client.run(_sees, str(mark))
    finally:
        mark.unlink(missing_ok=True)
    remedy = "choose a folder on a file system that all share"
    if isinstance(folder, ObjectPath):
        remedy = "it needs credentials, and AWS_ENDPOINT_URL and AWS_REGION, in its own environment"
    for worker, sees in seen.items():
        if not sees:
            raise InputError(
                f"--cluster {address}: worker {worker} does not see {folder}; {remedy}"
            )


def _differs(theirs: Mapping[str, str], ours: Mapping[str, str]) -> str | None:
    """Say which version of a worker is another than ours, and what to do; None if none is."""
    for package, version in ours.items():
        if theirs.get(package) != version:
            return f"has {package} {theirs.get(package)}, here it is {version}; install the same"
    return None


def _brought(job: Job, ours: Mapping[str, str], worker: object) -> Job | str:
    """Return the job for a worker, or why it cannot have it; runs on the worker.

    One that comes later was not there when all were asked.
    """
    other = _differs(versions(job.task.style.compiled), ours)
    return job if other is None else f"worker {worker} {other}"


def _sees(mark: str) -> bool:
    """Tell whether a file is there, as this process sees it; runs on a worker."""
    try:
        return located(mark).is_file()
    except DmpError:
        return False


def _draw(name: str, part: Part) -> Outcome:
    """Draw one part; runs on a worker."""
    from distributed import get_worker

    job: Job | str = getattr(get_worker(), name)
    if isinstance(job, str):
        raise InputError(f"--cluster: {job}")
    return draw_part(job, part)


def _result(future: Any, address: str) -> Outcome:
    from distributed import KilledWorker

    try:
        outcome: Outcome = future.result()
    except DmpError:
        raise
    except KilledWorker as error:
        raise InstrumentError(
            f"--cluster {address}: workers died again and again over one part ({error}); the same "
            "command goes on from here: give them more memory, or take fewer --pairs-per-part"
        ) from None
    except ImportError as error:
        raise InputError(
            f"--cluster {address}: a worker cannot run dmpcli {__version__} ({error}); install it "
            "there"
        ) from None
    except (OSError, CancelledError) as error:
        raise _lost(address, error) from None
    return outcome


def _lost(address: str, error: BaseException) -> InstrumentError:
    return InstrumentError(
        f"--cluster {address}: was lost ({type(error).__name__}); the same command goes on from "
        "here"
    )

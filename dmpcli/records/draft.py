"""A file that grows where nobody takes it for whole, and gets its name when it is.

On this machine it grows beside its name and is renamed. An object store renames nothing: there it
grows in a nameless file of this machine (in ``TMPDIR``) and is sent when it is whole.

A file that grows is locked, so that another run can tell it from one that nobody finishes. Where a
file system knows no locks, none can.
"""

import contextlib
import fcntl
import mmap
import os
import tempfile
from pathlib import Path
from typing import BinaryIO, cast

from dmpcli.records import file_io
from dmpcli.records.object_store import ObjectPath
from dmpcli.records.storage import Location


class Draft:
    """A file that is being written.

    Parameters
    ----------
    place : Path or ObjectPath
        Its name.

    Attributes
    ----------
    stream : binary file
    path : Path or None
        Where it grows, if that has a name.

    Raises
    ------
    OSError
        It cannot be created.
    """

    def __init__(self, place: Location) -> None:
        self._place = place
        self.path: Path | None = None
        self.stream: BinaryIO
        self._lock: int | None = None
        if isinstance(place, ObjectPath):
            place.reach()
            self.stream = cast("BinaryIO", tempfile.TemporaryFile())  # noqa: SIM115
        else:
            self.path, self.stream = file_io.temporary_of(place)
            with contextlib.suppress(OSError):
                fcntl.flock(self.stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Held until the file has its name, which it gets after the stream is closed.
            self._lock = os.dup(self.stream.fileno())

    def settle(self) -> None:
        """Bring what was written to the disk, before any of several files gets its name.

        Raises
        ------
        OSError
        """
        self.stream.flush()
        if self.path is not None:
            os.fsync(self.stream.fileno())

    def keep(self) -> int:
        """Give the file its name; what had it is replaced.

        Returns
        -------
        int
            Bytes.

        Raises
        ------
        OSError, InputError, InstrumentError
            It cannot be written; then nothing has changed.
        """
        self.stream.flush()
        if isinstance(self._place, ObjectPath):
            size = os.fstat(self.stream.fileno()).st_size
            descriptor = self.stream.fileno()
            self._place.put(mmap.mmap(descriptor, size, access=mmap.ACCESS_READ) if size else b"")
            self.stream.close()
            return size
        assert self.path is not None
        self.stream.close()
        size = self.path.stat().st_size
        self.path.replace(self._place)
        self._unlock()
        return size

    def drop(self) -> None:
        """Leave nothing behind; after `keep` there is nothing."""
        with contextlib.suppress(OSError):
            self.stream.close()
        if self.path is not None:
            with contextlib.suppress(OSError):
                self.path.unlink()
        self._unlock()

    def _unlock(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def remove_abandoned(half: Path) -> None:
    """Remove the file of a draft, unless somebody is writing it.

    Raises
    ------
    OSError
    """
    try:
        with half.open("rb") as stream:
            fcntl.flock(stream.fileno(), fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return
    except OSError:  # it is gone, or nothing can be locked there
        pass
    half.unlink(missing_ok=True)

"""The installed command at a pseudo-terminal: what a person types, and what is said."""

import contextlib
import os
import pty
import select
import subprocess
import sys
import time
from pathlib import Path

DMPCLI = str(Path(sys.executable).with_name("dmpcli"))


class Terminal:
    """One command with a terminal as standard input; what it says on standard error is gathered."""

    def __init__(self, *arguments, cwd):
        self._keys, side = pty.openpty()
        self.process = subprocess.Popen(
            [DMPCLI, *map(str, arguments)],
            stdin=side,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            cwd=cwd,
        )
        os.close(side)
        self.said = ""

    def wait_for(self, words, patience=30.0):
        """Read on until the words were said."""
        until = time.monotonic() + patience
        while words not in self.said:
            assert time.monotonic() < until, f"{words!r} was not said, but {self.said!r}"
            ready, _, _ = select.select([self.process.stderr], [], [], 1.0)
            if ready:
                more = os.read(self.process.stderr.fileno(), 4096).decode()
                assert more, f"it ended without {words!r}: {self.said!r}"
                self.said += more

    def type(self, line=""):
        """Type a line and press Enter."""
        os.write(self._keys, f"{line}\n".encode())

    def end(self, patience=30.0):
        """Wait for its end; return the exit code."""
        out, err = self.process.communicate(timeout=patience)
        self.said += err.decode()
        self.out = out
        return self.process.returncode

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with contextlib.suppress(ProcessLookupError):
            if self.process.poll() is None:
                self.process.kill()
                self.process.wait()
        os.close(self._keys)
        self.process.stdout.close()
        self.process.stderr.close()

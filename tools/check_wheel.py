"""Try a wheel as a user would: ``check_wheel.py WHEEL FOLDER CONSTRAINTS``.

It is installed into an empty environment of this Python, without extras; there one stroke goes
through record, fit, generalize, execute and report, and what needs an extra says how to get it.
Nothing of this folder can be imported there: all that is needed must have come along.
"""

import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAIR = "--start -701.698 132.420 -17.538 --goal -807.597 129.739 -17.518"
PIPELINE = (
    "record -o demo.parquet --seed 1",
    "fit demo.parquet -o skill.json",
    "fit demo.parquet -o paper.json --preset paper",
    f"generalize skill.json -o traj.parquet {PAIR} --ease-in 0.5 --ease-out 0.5",
    "execute traj.parquet -o run.parquet",
    "report demo.parquet traj.parquet run.parquet -o report",
    "inspect skill.json",
)
MADE = ("demo.parquet", "skill.json", "paper.json", "traj.parquet", "run.parquet")
FIGURES = ("report/report.json", "report/report.html", "report/plane.svg")
LACKING = {
    "ur": "execute traj.parquet -o none.parquet --robot ur://127.0.0.1",
    "view": "report demo.parquet -o none --view",
    "dask": "generalize skill.json -o none --pairs {pairs} --cluster tcp://127.0.0.1:1",
}
"""What each extra is for, by its name: exit code 2, and the line that installs it."""


def main(wheel: Path, folder: Path, constraints: Path) -> None:
    """Check what is in the wheel, install it and run it."""
    contents(wheel)
    shutil.rmtree(folder, ignore_errors=True)
    work = folder / "work"
    work.mkdir(parents=True)
    venv.create(folder / "venv", with_pip=True)
    python = (folder / "venv/bin/python").absolute()
    pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-compile"]
    run([*pip, "--only-binary", ":all:", "-c", constraints.resolve(), wheel.resolve()], work)
    dmpcli = python.with_name("dmpcli")
    for line in PIPELINE:
        run([dmpcli, *line.split()], work)
    absent = [name for name in (*MADE, *FIGURES) if not (work / name).exists()]
    expect(not absent, f"not made: {', '.join(absent)}")
    pairs = ROOT / "sample_runs/pairs.csv"
    for extra, line in LACKING.items():
        words = [pairs if word == "{pairs}" else word for word in line.split()]
        said = run([dmpcli, *words], work, code=2)
        expect(f"pip install 'dmpcli[{extra}]'" in said, f"{line}: no word of the extra: {said}")
    print(
        f"check_wheel: {wheel.name} draws a stroke without extras, Python {sys.version.split()[0]}"
    )


def contents(wheel: Path) -> None:
    """Make sure that every file of the package is in the wheel."""
    with zipfile.ZipFile(wheel) as archive:
        there = set(archive.namelist())
    package = (path for path in (ROOT / "dmpcli").rglob("*") if path.is_file())
    wanted = {p.relative_to(ROOT).as_posix() for p in package if "__pycache__" not in p.parts}
    expect(wanted <= there, f"not in the wheel: {', '.join(sorted(wanted - there))}")


def run(command: list[object], folder: Path, code: int = 0) -> str:
    """Run a command that must end with this code; return what it said on standard error."""
    words = [str(word) for word in command]
    clean = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(words, cwd=folder, env=clean, capture_output=True, text=True, check=False)
    told = (
        f"{' '.join(words)}: ended with {done.returncode}, not {code}:\n{done.stdout}{done.stderr}"
    )
    expect(done.returncode == code, told)
    return done.stderr


def expect(holds: bool, otherwise: str) -> None:
    """End with what is wrong where something does not hold."""
    if not holds:
        sys.exit(f"check_wheel: {otherwise}")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))

"""Make the environment that the Makefile's targets work in.

``set_up.py VENV LOCK OUT [bare | open [INDEX]]``. It is made anew when Python, lock file or place
is another than it was made with, or when it was never finished: what half an installation left
cannot be told from what is whole. ``VENV/installed`` says what it was made with, written last.
Whatever stands in the way is said in one line. A bare one holds the lock's packages without this
project; an open one is bare and made from requirements, for which pip finds what they need, in
INDEX too where the index at hand does not do.
"""

import contextlib
import fcntl
import functools
import hashlib
import importlib
import importlib.util
import json
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOG = "set-up.log"
OURS = {"installed", LOG, "pyvenv.cfg"}
"""Any of these says that a folder is an environment and may be emptied."""

NAME = f"CPython {platform.python_version()}"
# What a user's shell says to Python, and must not reach it in an environment.
QUIET = ("PYTHONPATH", "PYTHONHOME", "PYTHONSAFEPATH", "PYTHONOPTIMIZE", "FORCE_COLOR")

# What of a user's pip.conf and PIP_... reaches pip there: where packages come from, and how. Else
# user = true ends in "Can not perform a '--user' install" (pip issue 8977), another Python, target,
# prefix or root goes elsewhere, and constraints or hashes contradict the lock.
REACHES = {
    *("index-url", "extra-index-url", "no-index", "find-links", "trusted-host", "proxy"),
    *("cert", "client-cert", "keyring-provider", "use-feature", "use-deprecated"),
    *("cache-dir", "no-cache-dir", "timeout", "default-timeout", "retries", "resume-retries"),
}

# pip config list takes user = true for its own option --user, and tells of one file alone.
READ = """
import json, sys
from pip._internal.configuration import Configuration
from pip._internal.exceptions import PipError
try:
    found = Configuration(isolated=False)
    found.load()
except PipError as error:
    sys.exit("error: " + " ".join(str(error).split()))
print(json.dumps([(name, str(value)) for name, value in found.items()]))
"""

COMPILED = {
    "ssl": "libssl-dev",
    "zlib": "zlib1g-dev",
    "ctypes": "libffi-dev",
    "bz2": "libbz2-dev",
    "lzma": "liblzma-dev",
}
"""Modules that a Python which was built without these of Debian's packages does not have."""

UNREACHED = (
    "NewConnectionError|NameResolutionError|ConnectTimeoutError|ReadTimeoutError|ProxyError"
    "|Connection (refused|reset)|Network is unreachable|Failed to establish a new connection"
    "|Temporary failure in name resolution|getaddrinfo failed|Max retries exceeded"
)


class SetUpError(Exception):
    """What stands in the way, and what to do."""


def main(venv: Path, lock: Path, out: Path, mode: str = "", index: str = "") -> None:
    """Make the environment, unless it is there and whole."""
    if sys.prefix != sys.base_prefix and Path(sys.prefix).resolve() == venv.resolve():
        # Called by the environment's own Python: one that is about to be made anew cannot do it.
        os.execv(base(), [base(), *sys.argv])
    for folder, option in ((venv, "VENV"), (out, "OUT")):
        writable(folder, option)
    wanted = {
        "python": f"{sys.version} {sys.base_prefix}",
        "place": str(venv.resolve()),
        "lock": digest(lock),
        "project": "" if mode else digest(ROOT / "pyproject.toml", *installed_files()),
    }
    with alone(venv):
        there = made_with(venv)
        if there == wanted:
            return
        (venv / "installed").unlink(missing_ok=True)
        if there is None or {**there, "project": wanted["project"]} != wanted:
            fresh(venv)
            say(f"{NAME} into {venv}, from {lock.name}; about a minute")
            packages(venv, lock, mode, index)
        if not mode:
            project(venv)
            works(venv)
        (venv / "installed").write_text(json.dumps(wanted, indent=1) + "\n", encoding="utf-8")


def base() -> str:
    """Return the Python that an environment's Python was made with."""
    return str(getattr(sys, "_base_executable", sys.executable))


def digest(*files: Path) -> str:
    """Return the SHA-256 of files."""
    total = hashlib.sha256()
    for file in files:
        total.update(file.read_bytes())
    return total.hexdigest()


def editable() -> bool:
    """Tell whether the source folder can take the marks of an editable installation."""
    return os.access(ROOT, os.W_OK)


def installed_files() -> list[Path]:
    """Return the files of the package that an installation copies: none where it is editable."""
    if editable():
        return []
    return sorted(p for p in (ROOT / "dmpcli").rglob("*") if p.is_file() and p.suffix != ".pyc")


def writable(folder: Path, option: str) -> None:
    """Make a folder, and make sure that it can be written.

    Raises
    ------
    SetUpError
    """
    if os.path.lexists(folder) and not folder.is_dir():
        what = "a file" if folder.exists() else "a link that leads nowhere"
        raise SetUpError(
            f"{folder} is {what}, and a folder is needed: move it, or name another as make ... "
            f"{option}=DIR"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise SetUpError(
            f"{folder} cannot be written ({error.strerror}): copy this folder to where you may "
            "write, or name others: make ... VENV=DIR OUT=DIR"
        ) from None


@contextlib.contextmanager
def alone(venv: Path) -> Iterator[None]:
    """Let one make at a time work on an environment; the others wait, and then find it whole."""
    folder = os.open(venv.parent, os.O_RDONLY)
    try:
        # Where a file system knows no locks, two at a time are the user's to avoid.
        with contextlib.suppress(OSError):
            fcntl.flock(folder, fcntl.LOCK_EX)
        yield
    finally:
        os.close(folder)


def made_with(venv: Path) -> dict[str, str] | None:
    """Return what a whole environment was made with; nothing where there is none."""
    try:
        found = json.loads((venv / "installed").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    works = (venv / "bin/python").exists() and isinstance(found, dict)
    return found if works else None


def fresh(venv: Path) -> None:
    """Make an empty environment where one may have been.

    Raises
    ------
    SetUpError
    """
    there = {path.name for path in venv.iterdir()}
    if there and not there & OURS:
        raise SetUpError(
            f"{venv} holds files and is no environment: name another as make ... VENV=DIR"
        )
    missing = [name for name in ("venv", "ensurepip") if importlib.util.find_spec(name) is None]
    if missing:
        package = f"python{sys.version_info.major}.{sys.version_info.minor}-venv"
        raise SetUpError(
            f"{base()} ({NAME}) comes without its module {missing[0]}: on Debian and Ubuntu "
            f"sudo apt install {package} (or python3-venv); or name another: make ... PYTHON=..."
        )
    for module, needed in COMPILED.items():
        try:
            importlib.import_module(module)
        except ImportError:
            raise SetUpError(
                f"{base()} ({NAME}) was built without its module {module}: install what it needs "
                f"(Debian and Ubuntu: {needed}) and build it again, as pyenv install does; or name "
                "another: make ... PYTHON=..."
            ) from None
    if os.pathsep in str(venv.resolve()):
        raise SetUpError(
            f"{venv.resolve()}: no environment can lie in a folder with {os.pathsep!r} in its name:"
            " rename it, or name another as make ... VENV=DIR"
        )
    # First of all, so that an interrupted run leaves what the next one knows as ours.
    (venv / LOG).touch()
    for path in venv.iterdir():
        if path.name == LOG:
            continue
        shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
    done = run(venv, base(), "-m", "venv", str(venv))
    if done:
        raise SetUpError(
            f"{NAME} makes no environment: {last_line(done)}; name another Python as make ... "
            f"PYTHON=... (all of its words: {venv / LOG})"
        )


def packages(venv: Path, lock: Path, mode: str, index: str) -> None:
    """Install what a lock or, in an open environment, requirements name."""
    # Python writes its byte code of what is used when it is first used, in half the time.
    words = ("-r", str(lock), "--no-compile")
    if mode != "open":
        # The lock names every package, so that nothing is left to resolve; what no wheel is there
        # for would be compiled for minutes and fail in a compiler's words.
        pip(venv, *words, "--no-deps", "--only-binary", ":all:")
        return
    try:
        pip(venv, *words)
    except SetUpError:
        if not index:
            raise
        pip(venv, *words, "--extra-index-url", index)


def project(venv: Path) -> None:
    """Install this project: as it lies here, or a copy where the folder can't be written."""
    more = ("--no-deps", "--no-build-isolation")
    if editable():
        pip(venv, *more, "--editable", str(ROOT))
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "dmpcli")
        copy.mkdir()
        for name in ("pyproject.toml", "README.md", "LICENSE"):
            shutil.copy(ROOT / name, copy / name)
        ignore = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / "dmpcli", copy / "dmpcli", ignore=ignore)
        pip(venv, *more, "--force-reinstall", str(copy))


def works(venv: Path) -> None:
    """Make sure that what was installed can be run.

    Raises
    ------
    SetUpError
    """
    try:
        done = run(venv, str(venv / "bin/dmpcli"), "--version")
    except PermissionError:
        raise SetUpError(
            f"{venv} lies where no program may be run (a disk that is mounted noexec): name a "
            "place elsewhere as make ... VENV=DIR"
        ) from None
    if done:
        raise SetUpError(
            f"dmpcli was installed and does not run: {last_line(done)} (all of its words: "
            f"{venv / LOG})"
        )


def pip(venv: Path, *words: str) -> None:
    """Run ``pip install``; its words go to the log.

    Raises
    ------
    SetUpError
    """
    options = ("--quiet", "--disable-pip-version-check", "--no-input", "--retries", "3")
    said = run(
        venv, str(venv / "bin/python"), "-m", "pip", "install", *options, *words,
        settings=pip_settings(venv),
    )  # fmt: skip
    if said:
        raise SetUpError(f"{why(said)} (all of pip's words: {venv / LOG})")


@functools.cache
def pip_settings(venv: Path) -> tuple[tuple[str, str], ...]:
    """Return those of pip's settings that reach it, as variables of its environment.

    Raises
    ------
    SetUpError
    """
    environment = {name: value for name, value in os.environ.items() if name not in QUIET}
    ask = [str(venv / "bin/python"), "-c", READ]
    done = subprocess.run(ask, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        said = last_line(done.stderr or f"it ended with {done.returncode}")
        raise SetUpError(f"pip's settings cannot be read: {said}; mend pip.conf")
    found = {}
    for order in ("global", "install", ":env:"):
        for name, value in json.loads(done.stdout):
            section, _, key = name.partition(".")
            if section == order and key in REACHES:
                found["PIP_" + key.upper().replace("-", "_")] = " ".join(value.split())
    return tuple(found.items())


def run(venv: Path, *command: str, settings: tuple[tuple[str, str], ...] = ()) -> str:
    """Run a command and log it; return what it said where it failed, else nothing.

    Of pip's settings only those that are given reach it.
    """
    environment = {
        name: value
        for name, value in os.environ.items()
        if name not in QUIET and not name.startswith("PIP_")
    }
    environment |= dict(settings) | {"PIP_CONFIG_FILE": os.devnull, "PYTHONUTF8": "1"}
    done = subprocess.run(
        command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, encoding="utf-8", errors="replace", check=False,
    )  # fmt: skip
    with (venv / LOG).open("a", encoding="utf-8") as log:
        log.write(f"$ {' '.join(command)}\n{done.stdout}")
    return (done.stdout.strip() or f"it ended with {done.returncode}") if done.returncode else ""


def why(said: str) -> str:
    """Say in one line why pip failed, and what to do."""
    if "No space left on device" in said:
        return (
            "the disk is full: an environment takes about 1 GB; name a place as make ... VENV=DIR"
        )
    if re.search("certificate (is not yet valid|has expired)", said):
        return (
            "the package index's certificate is of another time than this machine's clock: check "
            "the date, else the index"
        )
    if "CERTIFICATE_VERIFY_FAILED" in said:
        return (
            "the package index's certificate is not trusted: name your authority's as PIP_CERT=FILE"
        )
    if re.search(UNREACHED, said):
        return (
            "no package index is reached: check network and proxy, or name one as PIP_INDEX_URL=URL"
        )
    none = re.search(r"No matching distribution found for (\S+)", said)
    if none:
        where = f"{NAME} on {platform.system()} {platform.machine()}"
        return f"the package index has no wheel of {none[1]} for {where}; try another PYTHON=..."
    return f"pip failed: {last_line(said)}"


def last_line(said: str) -> str:
    """Return the last error, or else the last line, of what a command said."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    errors = [line for line in lines if line.lower().startswith("error")]
    return (errors or lines)[-1]


def say(text: str) -> None:
    """Tell what is done or what is wrong, on standard error."""
    print(f"set-up: {text}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    try:
        folder, locked, outputs, *how = sys.argv[1:]
        main(Path(folder), Path(locked), Path(outputs), *how)
    except SetUpError as error:
        say(str(error))
        sys.exit(1)
    except KeyboardInterrupt:
        say("interrupted; the next make begins it anew")
        sys.exit(130)

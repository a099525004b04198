"""The set-up: done, or one line that says what to do; what an interrupted one left is no obstacle.

With an empty lock file and without the project, so that no package index is asked.
"""

import importlib.util
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[2] / "tools"


class Place:
    """A folder to set up in, and how."""

    def __init__(self, folder):
        self.folder = folder
        self.venv = folder / ".venv"
        self.stamp = self.venv / "installed"
        self.lock = folder / "empty.lock"
        self.lock.write_text("# nothing\n")
        self.python = sys.executable
        self.environment = dict(os.environ) | {"PIP_CONFIG_FILE": os.devnull}

    def command(self, venv=".venv"):
        words = [self.python, venv, self.lock.name, "out", "bare"]
        return ["sh", str(TOOLS / "set_up.sh"), *words]

    def run(self, venv=".venv", **more):
        environment = self.environment | more
        return subprocess.run(
            self.command(venv), cwd=self.folder, env=environment, capture_output=True, text=True
        )

    def done(self, **more):
        ran = self.run(**more)
        assert ran.returncode == 0, ran.stderr
        assert self.stamp.exists()
        return ran.stderr

    def refused(self, venv=".venv", **more):
        """Return the one line that it ended with."""
        ran = self.run(venv, **more)
        assert ran.returncode == 1
        *_, line = ran.stderr.splitlines()
        assert line.startswith("set-up: ")
        assert "Traceback" not in ran.stderr
        assert [x for x in ran.stderr.splitlines() if x != line and "into" not in x] == []
        assert not self.stamp.exists()
        return line

    def python_without(self, module):
        """Return the environment variable that takes a module from Python."""
        site = self.folder / "site"
        site.mkdir()
        (site / "sitecustomize.py").write_text(f"import sys\nsys.modules[{module!r}] = None\n")
        return {"PYTHONPATH": str(site)}

    def script(self, text):
        """Let PYTHON be a program of our own."""
        file = self.folder / "python"
        file.write_text(f"#!/bin/sh\n{text}\n")
        file.chmod(0o755)
        self.python = str(file)


@pytest.fixture
def place(tmp_path):
    return Place(tmp_path)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A place with an environment: each takes seconds to make, so it is a difficult one at once.

    It is interrupted once, and then made by two at once.
    """
    folder = tmp_path_factory.mktemp("whole") / "Größe und Platz" / ("lang " * 40).strip()
    folder.mkdir(parents=True)
    place = Place(folder)
    shell = {"LC_ALL": "C", "LANG": "C", "HOME": "/dev/null/home"}
    # As people have them, in pip.conf and in their shells.
    elsewhere = folder / "elsewhere"
    settings = ["[global]", "python = /usr/bin/python3", "user = true", "[install]"]
    settings += [f"target = {elsewhere}", f"prefix = {elsewhere}", f"root = {elsewhere}"]
    settings += ["require-hashes = true", "require-virtualenv = true", "dry-run = true"]
    (folder / "pip.conf").write_text("\n".join(settings) + "\n")
    (folder / "no.txt").write_text("pip<1\n")
    shell |= {"PIP_CONFIG_FILE": str(folder / "pip.conf"), "PIP_CONSTRAINT": str(folder / "no.txt")}
    shell |= {"PIP_USER": "1", "PIP_TARGET": str(elsewhere), "PIP_PYTHON": "/usr/bin/python3"}
    how = {"cwd": folder, "env": place.environment | shell, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(place.command(), start_new_session=True, **how) as running:
        while not (place.venv / "set-up.log").exists():
            assert running.poll() is None
            time.sleep(0.01)
        os.killpg(running.pid, signal.SIGKILL)
    place.stamped_too_early = place.stamp.exists()
    two = [subprocess.Popen(place.command(), **how) for _ in range(2)]
    place.told = [process.communicate()[1] for process in two]
    assert [process.returncode for process in two] == [0, 0], place.told
    return place


@pytest.fixture(scope="module")
def set_up():
    """The tool itself."""
    spec = importlib.util.spec_from_file_location("set_up", TOOLS / "set_up.py")
    set_up = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(set_up)
    return set_up


@pytest.fixture
def pip(set_up, whole, monkeypatch):
    """What `set_up` does to install into an environment; returns what it ends with."""
    monkeypatch.chdir(whole.folder)
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)

    def refused(*words):
        with pytest.raises(set_up.SetUpError) as caught:
            set_up.pip(whole.venv, *words, "--no-deps", "--only-binary", ":all:")
        assert "\n" not in str(caught.value)
        return str(caught.value)

    return refused


@pytest.mark.slow
def test_a_python_that_is_not_there_or_does_not_run_is_one_line(place):
    place.python = "python3.99"
    assert "python3.99 does not run: name CPython 3.11 or newer" in place.refused()
    place.script("echo 'pyenv: python3.12: command not found' >&2; exit 127")  # pyenv's stand-in
    assert "does not run" in place.refused()


@pytest.mark.slow
@pytest.mark.parametrize("told", ["CPython 3.9.2", "PyPy 3.11.13"])
def test_a_python_too_old_or_of_another_make_is_one_line(place, told):
    place.script(f"echo {told}; exit 3")
    assert f"is {told}, and dmpcli needs CPython 3.11 or newer" in place.refused()


@pytest.mark.parametrize("module", ["venv", "ensurepip"])
def test_a_python_without_venv_is_one_line_with_debians_package(place, module):
    said = place.refused(**place.python_without(module))
    package = f"python{sys.version_info.major}.{sys.version_info.minor}-venv"
    assert f"without its module {module}: on Debian and Ubuntu sudo apt install {package}" in said


@pytest.mark.slow
@pytest.mark.parametrize("venv", ["/dev/null/venv", "/proc/venv"])
def test_a_place_that_cannot_be_written_is_one_line(place, venv):
    assert "cannot be written" in place.refused(venv)
    assert "VENV=DIR OUT=DIR" in place.refused(venv)


def test_a_file_where_the_folder_should_be_is_named_with_its_option(place):
    place.venv.touch()
    assert "is a file, and a folder is needed: move it, or name another as" in place.refused()
    place.venv.unlink()
    place.venv.symlink_to("nowhere/at/all")
    assert "is a link that leads nowhere" in place.refused()
    place.venv.unlink()
    (place.folder / "out").touch()
    assert "OUT=DIR" in place.refused()


def test_a_python_that_was_built_without_a_module_is_told_with_what_it_needs(place):
    said = place.refused(**place.python_without("ssl"))
    assert (
        "was built without its module ssl: install what it needs (Debian and Ubuntu: libssl-dev"
        in said
    )


def test_a_folder_that_no_environment_can_lie_in_is_told(place):
    assert "in a folder with ':' in its name" in place.refused("a:b")


def test_where_no_program_may_be_run_it_is_told(set_up, tmp_path):
    program = tmp_path / "bin" / "dmpcli"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\n")
    program.chmod(0o644)
    with pytest.raises(set_up.SetUpError, match="no program may be run"):
        set_up.works(tmp_path)
    program.write_text('#!/bin/sh\necho "ImportError: libz.so.1" >&2; exit 1\n')
    program.chmod(0o755)
    with pytest.raises(set_up.SetUpError, match=r"does not run: ImportError: libz\.so\.1"):
        set_up.works(tmp_path)


def test_of_pips_settings_only_where_packages_come_from_reaches_it(whole, set_up, monkeypatch):
    said = {
        "[global]": ["user = true", "cert = /c.pem", "find-links =", "  /one", "  /two"],
        "[install]": ["target = /elsewhere", "index-url = https://mirror/simple"],
        "[wheel]": ["index-url = https://not"],
    }
    file = whole.folder / "other.conf"
    file.write_text("\n".join(line for head, lines in said.items() for line in (head, *lines)))
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PIP_CONFIG_FILE", str(file))
    monkeypatch.setenv("PIP_CERT", "/d.pem")
    monkeypatch.setenv("PIP_PYTHON", "/usr/bin/python3")
    found = dict(set_up.pip_settings.__wrapped__(whole.venv))
    assert found["PIP_CERT"] == "/d.pem"
    assert found["PIP_FIND_LINKS"] == "/one /two"
    assert found["PIP_INDEX_URL"] == "https://mirror/simple"
    assert not {"PIP_USER", "PIP_TARGET", "PIP_PYTHON"} & set(found)
    file.write_text("index-url = x\n")
    with pytest.raises(set_up.SetUpError, match=r"settings cannot be read: .*other\.conf"):
        set_up.pip_settings.__wrapped__(whole.venv)


def test_a_certificate_of_another_time_is_told_as_the_clocks(set_up):
    said = "SSLError(SSLCertVerificationError(1, '[SSL: CERTIFICATE_VERIFY_FAILED] certificate "
    assert "clock: check the date" in set_up.why(
        said + "verify failed: certificate is not yet valid"
    )
    assert "PIP_CERT=FILE" in set_up.why(said + "verify failed: self-signed certificate")


def test_git_leaves_the_ends_of_lines_as_they_are():
    """Where core.autocrlf is set, a shell would not run what it checks out."""
    root = TOOLS.parent
    if (root / ".git").exists():
        ask = ["git", "check-attr", "text", "Makefile", "tools/set_up.sh", "sample_runs/pairs.csv"]
        told = subprocess.run(ask, cwd=root, capture_output=True, text=True, check=True).stdout
        assert told.count("text: unset") == 3
    assert "* -text" in (root / ".gitattributes").read_text().splitlines()


def test_a_folder_that_holds_something_else_is_not_emptied(place):
    place.venv.mkdir()
    (place.venv / "thesis.tex").touch()
    assert "holds files and is no environment" in place.refused()
    assert (place.venv / "thesis.tex").exists()


@pytest.mark.thorough
def test_no_index_is_one_line(pip, monkeypatch):
    monkeypatch.setenv("PIP_INDEX_URL", "http://127.0.0.1:9/simple")
    monkeypatch.setenv("PIP_FIND_LINKS", "")
    said = pip("six==1.16.0")
    assert "no package index is reached: check network and proxy" in said
    assert "PIP_INDEX_URL=URL" in said


@pytest.mark.slow
def test_a_package_without_a_wheel_is_named_with_the_python(pip, tmp_path, monkeypatch):
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path))
    said = pip("ur-rtde==1.6.5")
    assert "no wheel of ur-rtde==1.6.5 for CPython" in said


@pytest.mark.slow
def test_what_an_interrupted_one_left_is_made_whole_once_also_by_two_at_once(whole):
    assert not whole.stamped_too_early
    assert sorted(said.count("into .venv") for said in whole.told) == [0, 1]
    assert whole.done() == ""


@pytest.mark.thorough
def test_it_is_made_once_and_anew_when_lock_or_python_changes(whole):
    assert whole.done() == ""
    # An activated environment's Python is the environment's own: it must outlive its folder.
    given, whole.python = whole.python, str(whole.venv / "bin/python")
    assert whole.done() == ""
    whole.lock.write_text("# another\n")
    (whole.venv / "left-over").touch()
    assert "into .venv" in whole.done()
    assert not (whole.venv / "left-over").exists()
    whole.python = given
    assert whole.done() == ""
    made = json.loads(whole.stamp.read_text())
    whole.stamp.write_text(json.dumps(made | {"python": "3.11.0 elsewhere"}))
    # What stops it shows as well that it sets out to make it anew, and sooner.
    assert "without its module venv" in whole.refused(**whole.python_without("venv"))


@pytest.mark.slow
def test_a_difficult_place_and_what_a_shell_says_to_pip_do_no_harm(whole):
    assert not (whole.folder / "elsewhere").exists()
    pip = subprocess.run([whole.venv / "bin/pip", "--version"], capture_output=True, check=True)
    assert b"pip" in pip.stdout


@pytest.mark.parametrize(("index", "asked"), [("", 1), ("https://more", 2)])
def test_requirements_are_resolved_in_another_index_where_the_first_does_not_do(
    set_up, monkeypatch, index, asked
):
    calls = []

    def pip(venv, *words):
        calls.append(words)
        raise set_up.SetUpError("the package index has no wheel of torch")

    monkeypatch.setattr(set_up, "pip", pip)
    with pytest.raises(set_up.SetUpError, match="no wheel of torch"):
        set_up.packages(Path("venv"), Path("some.txt"), "open", index)
    assert len(calls) == asked
    assert not {"--no-deps", "--only-binary"} & set(sum(calls, ()))
    assert calls[-1][-2:] == ("--extra-index-url", "https://more") or not index

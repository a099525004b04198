"""What other packages imported from version 0.1 is still found, with a note where it is now."""

import importlib
import subprocess
import sys

import numpy as np
import pytest

MOVED = [
    ("dmpcli.rotations", "from_euler", "dmpcli.spatial.rotations", "from_euler"),
    ("dmpcli.rotations", "to_quaternion", "dmpcli.spatial.rotations", "to_quaternion"),
    (
        "dmpcli.instruments.drivers",
        "Declaration",
        "dmpcli.instruments.driver_protocol",
        "DriverInfo",
    ),
    (
        "dmpcli.instruments.drivers",
        "DriverState",
        "dmpcli.instruments.driver_protocol",
        "DriverState",
    ),
    ("dmpcli.instruments.conversion", "servo", "dmpcli.instruments.servo_adapter", "servo"),
]


@pytest.mark.parametrize(("old", "was", "new", "now"), MOVED)
def test_an_old_path_gives_the_same_object_and_names_the_new_one(old, was, new, now):
    module = importlib.import_module(old)
    with pytest.warns(DeprecationWarning, match=f"{old} is {new} now.*will go") as told:
        found = getattr(module, was)
    assert found is getattr(importlib.import_module(new), now)
    assert told[0].filename == __file__
    with pytest.raises(AttributeError):
        _ = module.nothing_of_the_kind


def test_a_driver_sees_the_note_in_its_own_line(tmp_path):
    code = "from dmpcli.rotations import exp, log\nprint(log(exp([0, 0, 1])))\n"
    (tmp_path / "driver.py").write_text(code)
    done = subprocess.run(
        [sys.executable, "-W", "default", tmp_path / "driver.py"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    np.testing.assert_allclose(np.fromstring(done.stdout.strip("[] \n"), sep=" "), [0, 0, 1])
    assert "driver.py:1: DeprecationWarning: dmpcli.rotations is dmpcli.spatial" in done.stderr


def test_the_package_itself_uses_no_old_path():
    code = (
        "import sys; import dmpcli.control.workcell, dmpcli.instruments.ur; "
        "import dmpcli.instruments.elite; "
        "print([m for m in ('dmpcli.rotations', 'dmpcli.moved') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
